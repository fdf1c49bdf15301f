"""From a log to a calibrated robot: every command but the first is the one that was printed."""

from __future__ import annotations

import gzip
import json
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import pytest

from seals.cli.main import main

DATA = Path(__file__).parent / "strangers"
ROBOT = "quad, lent (1)"
"""A name that a shell and Hydra would each take apart."""
TUTORIAL = Path(__file__).parents[2] / "docs" / "tutorial_own_flight.md"


class Shell:
    """Console of a user who types what was printed.

    Attributes:
        said: all that the last command printed.
    """

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys
        self.said = ""

    def types(self, line: str, *, code: int = 0) -> str:
        """Run a command line; return what it printed."""
        program, *words = shlex.split(line)
        assert program == "seals"
        assert main(words) == code, line
        printed = self._capsys.readouterr()
        self.said = printed.out + printed.err
        return self.said

    def printed(self, verb: str, *, said: str = "", option: str = "") -> str:
        """Return the command of a verb that was printed, of several the one with an option."""
        lines = re.findall(rf"seals {verb} [^;\n]*", said or self.said)
        found = [line.rstrip() for line in lines if option in line]
        assert len(found) == 1, (verb, said or self.said)
        return str(found[0])

    def follow(
        self, verb: str, *, code: int = 0, said: str = "", option: str = "", log: str = ""
    ) -> str:
        """Type the command of a verb that was printed; another log is the one value to fill in."""
        line = self.printed(verb, said=said, option=option)
        assert ("ANOTHER_LOG" in line) == bool(log)
        return self.types(
            line.replace("log=ANOTHER_LOG", log).replace("ANOTHER_LOG", log), code=code
        )

    def read(self, name: str) -> dict[str, Any]:
        """Return the content of a file whose path the last command printed."""
        (path,) = re.findall(rf"^(.*{re.escape(name)})$", self.said, re.M)
        return json.loads(Path(path).read_text())


@pytest.fixture
def shell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Shell:
    """A console in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return Shell(capsys)


def robot_of_tutorial() -> None:
    """Write the robot folder of the page on one's own flight."""
    main(["new", "robot", "my_quad", "--urdf", "own_flight/quad"])
    (text,) = re.findall(r"^```yaml\n(summary:.*?)^```", TUTORIAL.read_text(), re.M | re.S)
    Path("my_quad/robot.yaml").write_text(text)
    Path("my_quad").rename(ROBOT)


def calibrated(shell: Shell, other: str, *, flies: bool = True) -> dict[str, Any]:
    """Follow add, verify on another log, plan, its flight, and calibrate; return the numbers."""
    shell.follow("add")
    said = shell.follow("verify", log=other)
    assert "never fitted" in said
    assert ("seals plan" in said) == flies
    if flies:
        shell.follow("plan", said=said)
        shell.follow("run", log="flown")
        assert "log=flown" in shell.printed("diagnose")
    shell.follow("calibrate", said=said)
    return shell.read("calibration.json")["parameters"]


@pytest.mark.slow
def test_the_ulog_of_an_autopilot(shell: Shell) -> None:
    """From ten seconds of a flight recorded by PX4 to the weak rotor; verified on two logs."""
    robot_of_tutorial()
    robot, flight = f"\"robot='{ROBOT}'\"", "seals convert log=own_flight/flight_1.ulg.gz rate=100"
    shell.types(f"{flight} {robot} span=[10,14] out=second")
    shell.types(f"{flight} {robot} span=[14,18] \"out='third, last'\"")
    shell.types(f"{flight} {robot} span=[0,10] \"out='flight, 1'\"")
    shell.follow("new datasheet")
    shell.follow("diagnose", code=10)
    (weak,) = shell.read("diagnosis.json")["effects"]
    assert weak["name"] == "weak_rotor"
    assert weak["parameters"]["rotor"]["value"] == 2
    numbers = calibrated(shell, "\"log=[second,'third, last']\"")
    assert "actuators.rotors.thrust_coefficient" in numbers


@pytest.mark.slow
def test_the_csv_file_of_another_simulator(shell: Shell) -> None:
    """From six seconds in a wind to the wind, its plan and the numbers that stand for it."""
    shutil.copytree(DATA / "quad", ROBOT)
    Path("log.csv").write_bytes(gzip.decompress((DATA / "wind.csv.gz").read_bytes()))
    first = f"seals convert log=log.csv map={DATA / 'map.yaml'} \"robot='{ROBOT}'\" rate=100"
    shell.types(f"{first} span=[6,9] \"out='flight (2)'\"")
    shell.types(f"{first} span=[0,6] \"out='flight (1)'\"")
    shell.follow("new datasheet")
    shell.follow("diagnose", code=10)
    (wind,) = shell.read("diagnosis.json")["effects"]
    assert wind["name"] == "wind"
    for axis, truth in zip("xyz", (3.0, -1.5, 0.0), strict=True):
        found = wind["parameters"][f"velocity_{axis}"]
        assert found["low90"] < truth < found["high90"]
    assert calibrated(shell, "\"log='flight (2)'\"")


@pytest.mark.slow
def test_a_run_of_ones_own(shell: Shell) -> None:
    """Rotors that are stated too strong: the calibration finds the coefficient of the run."""
    run = (
        "seals run robot=crazyflie guide=waypoints controller=cascade initial.position=[0,0,2] "
        "actuators.rotors.thrust_coefficient=[1.2e-8]"
    )
    shell.types(f"{run} 'guide.places=[[-1,0.5,2],[0,1,2.5]]' time.duration=3 out=second")
    shell.types(f"{run} 'guide.places=[[1,0.5,2],[0,0,2.5]]' time.duration=4 \"out='one, two'\"")
    # a run states its noise and tolerances: it takes no data sheet
    shell.types("seals convert \"log='one, two'\" out=converted", code=2)
    shell.follow("diagnose", option="robot=", code=10)
    (thrust,) = shell.read("diagnosis.json")["effects"]
    assert thrust["name"] == "thrust_coefficient"
    (found,) = calibrated(shell, "log=second").values()
    assert found["low90"] < 1.2e-8 < found["high90"]
    assert found["stated"] == pytest.approx(1.28e-8)


@pytest.mark.thorough
def test_a_thrown_ball(shell: Shell) -> None:
    """A drag that is stated too small, in a run of a third of a second; a throw takes no plan."""
    run = (
        "seals run robot=ball time.step=0.004 time.duration=0.3 effects.air_drag.coefficient_x=0.03"
    )
    shell.types(f"{run} initial.velocity=[5,0,3] out=second")
    shell.types(f"{run} initial.velocity=[6,0,2] \"out='one, two'\"")
    shell.types("seals convert \"log='one, two'\" out=converted", code=2)
    shell.follow("diagnose", option="robot=", code=10)
    (drag,) = shell.read("diagnosis.json")["effects"]
    assert drag["name"] == "quadratic_drag"
    numbers = calibrated(shell, "log=second", flies=False)
    found = numbers["effects.air_drag.coefficient_x"]
    assert found["low90"] < 0.03 < found["high90"]


@pytest.mark.slow
def test_rotors_stated_reversed(shell: Shell) -> None:
    """The line of robot.yaml that is printed makes the model whole; nothing is left to add."""
    shutil.copytree(DATA / "quad", ROBOT)
    stated = Path(ROBOT) / "robot.yaml"
    right = "direction: [-1.0, 1.0, -1.0, 1.0]"
    assert right in stated.read_text()
    wrong = stated.read_text().replace(right, "direction: [1.0, -1.0, 1.0, -1.0]")
    stated.write_text(wrong)
    Path("log.csv").write_bytes(gzip.decompress((DATA / "reversed.csv.gz").read_bytes()))
    first = f"seals convert log=log.csv map={DATA / 'map.yaml'} \"robot='{ROBOT}'\" rate=100"
    shell.types(f"{first} out=flight")
    shell.follow("new datasheet")
    said = shell.follow("diagnose", code=13)
    (entry,) = [one for one in shell.read("diagnosis.json")["stated_wrong"] if "set" in one]
    assert entry["words"] == "directions of rotors"
    line = re.search(r"in robot\.yaml, actuators\.rotors: (direction: .*)$", said, re.M)
    assert line is not None
    stated.write_text(re.sub(r"direction: .*", line[1], wrong))
    shell.follow("diagnose", code=0)
