"""Numbers that are allowed one by one, and whose system cannot be computed, end in words."""

from __future__ import annotations

import json
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.errors import ConfigError, LogError
from seals.logs.log import Log
from seals.logs.native import read_native, write_native
from seals.logs.shipped import find_log
from seals.sound_numbers import numeric_fault, sound_numbers
from seals.sysid.experiment_design.experiment import KIND, read_experiment
from seals.sysid.parallel import spread

pytestmark = pytest.mark.usefixtures("elsewhere")

LINK = (
    '<link name="l{0}"><inertial><mass value="{1}"/><inertia ixx="{2}" iyy="{2}" izz="{2}" ixy="0" '
    'ixz="0" iyz="0"/></inertial></link>\n'
)
JOINT = (
    '<joint name="j{0}" type="revolute"><parent link="l{0}"/><child link="l{1}"/>\n'
    '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>\n'
)


def robot(count: int = 1, mass: str = "0.1", moment: str = "0.01") -> str:
    """A robot that is a chain of links."""
    Path("r").mkdir()
    links = "".join(LINK.format(k, mass, moment) for k in range(count))
    joints = "".join(JOINT.format(k, k + 1) for k in range(count - 1))
    Path("r/r.urdf").write_text(f'<robot name="r">\n{links}{joints}</robot>\n')
    Path("r/robot.yaml").write_text("urdf: r.urdf\n")
    return "robot=r"


@pytest.mark.parametrize(
    "words",
    [
        ["robot=aam", "controller=cascade", "guide=hover", "environment.gravity=0"],
        ["robot=aam", "controller=cascade", "guide=hover", "controller.tilt=0"],
        ["robot=ball", "time.step=0.1", "initial.velocity=[100,100,100]", "wave=airy"],
        ["robot=ball", "environment.air_density=0", "environment.gravity=0"],
    ],
)
def test_systems_without_a_solution_end_in_words(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """The command ends with words or with a run, never with a traceback."""
    assert main(["run", *words, "time.duration=0.1"]) in (0, 2)
    assert "Traceback" not in capsys.readouterr().err


def test_a_flight_without_gravity_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """A cascade leans on gravity; the place of the fault is said."""
    words = ["run", "robot=aam", "controller=cascade", "guide=hover", "environment.gravity=0"]
    assert main([*words, "time.duration=0.1"]) == 2
    said = capsys.readouterr().err
    assert "lead to a system that cannot be solved: ZeroDivisionError" in said
    assert "lean_for" in said


@pytest.mark.parametrize(("mass", "moment"), [("1e300", "1"), ("1", "1e300"), ("1e-300", "0")])
@pytest.mark.parametrize("backend", ["mujoco", "free"])
def test_masses_out_of_proportion_end_in_words(backend: str, mass: str, moment: str) -> None:
    """Engines are not left with what they cannot hold."""
    assert main(["run", robot(1, mass, moment), f"backend={backend}", "time.duration=0.02"]) in (
        0,
        2,
    )


@pytest.mark.parametrize("count", [128, 129, 200])
def test_pybullet_has_a_most_of_links(count: int, capsys: pytest.CaptureFixture[str]) -> None:
    """The engine hands out the state of so many links, and not of more."""
    pytest.importorskip("pybullet")
    code = main(["run", robot(count), "backend=pybullet", "time.duration=0.004"])
    assert code == (0 if count <= 128 else 2), capsys.readouterr().err
    if code:
        assert "PyBullet supports 128 at most" in capsys.readouterr().err


@pytest.mark.parametrize("rows", [3, 10, 40, 60])
def test_short_logs_are_bad_data(rows: int, capsys: pytest.CaptureFixture[str]) -> None:
    """A log of few rows ends in bad data, not in an error of indices."""
    whole: Log = read_native(find_log("hidden_effect/flight_a"))
    columns = {name: values[:rows] for name, values in whole.columns.items()}
    short = Log(
        name="short",
        columns=columns,
        segment=whole.segment[:rows],
        meta=whole.meta,
        source=whole.source,
    )
    write_native(short, Path("short"))
    words = ["diagnose", "log=short", "out=made", "plan=false", "report=false", "processes=1"]
    assert main(words) == 20
    assert "bad data" in capsys.readouterr().out
    assert json.loads(Path("made/diagnosis.json").read_text())["verdict"] == "bad_data"


@pytest.mark.parametrize(
    ("stage", "more"),
    [
        ("seals.sysid.report.application._found", ""),
        ("seals.sysid.report.healthy_application.HealthyFlights.diagnose", "flight_b"),
    ],
)
def test_numbers_without_a_solution_are_bad_data(
    stage: str, more: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever stage of a diagnosis meets them, with healthy flights or without."""
    monkeypatch.setattr(stage, _singular)
    words = ["diagnose", "log=hidden_effect/flight_a", "out=made", "report=false"]
    assert main([*words, *([f"healthy=[hidden_effect/{more}]"] if more else [])]) == 20
    assert "LinAlgError" in capsys.readouterr().out
    assert json.loads(Path("made/diagnosis.json").read_text())["verdict"] == "bad_data"


_DROP = {
    "seconds": 1.0,
    "position": [0, 0, 1],
    "orientation": [1, 0, 0, 0],
    "velocity": [0, 0, 0],
    "angular_velocity": [0, 0, 0],
}


@pytest.mark.parametrize(
    "change",
    [
        {"runs": [{**_DROP, "seconds": 1e300}]},
        {"runs": [{**_DROP, "seconds": 1e8}]},
        {"runs": [{**_DROP, "seconds": -1.0}]},
        {"runs": [{**_DROP, "seconds": float("nan")}]},
        {"step": 0.0},
        {"step": -0.01},
        {"step": float("inf")},
        {"step": 1e-300},
    ],
)
def test_planned_manoeuvres_have_an_end(change: dict[str, Any]) -> None:
    """Drops count like flights, and a step is a time."""
    import yaml

    content = {
        "kind": KIND,
        "name": "a",
        "words": "a",
        "effects": [],
        "step": 0.01,
        "tilt": 0.3,
        "runs": [_DROP],
        "meta": {},
    }
    Path("x.yaml").write_text(yaml.safe_dump({**content, **change}))
    words = r"at most 10,000,000 steps|Allowed: (from|a finite number)"
    with pytest.raises(ConfigError, match=words):
        read_experiment("x.yaml")


_FLIGHT = {
    "spacing": 0.1,
    **{axis: [0, 1, 2] for axis in ("x", "y", "z", "yaw")},
    "joints": [],
    "voltage": 16,
}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"runs": 5}, "runs=5 is not allowed"),
        ({"runs": ["x"]}, r"runs\[0\]=x is not allowed"),
        ({"meta": [1]}, r"meta=\[1\] is not allowed"),
        ({"meta": "x"}, "meta=x is not allowed"),
        ({"runs": [{"seconds": 1.0}]}, r"runs\[0\] has no 'position'"),
        ({"runs": [{**_DROP, "orientation": [1, 0, 0]}]}, "orientation=.*Allowed: 4 entries"),
        ({"runs": [{**_DROP, "velocity": [0, 0, float("nan")]}]}, r"velocity\[2\]=nan"),
        ({"runs": [{**_DROP, "angular_velocity": ["a", 0, 0]}]}, r"angular_velocity\[0\]=a"),
        ({"runs": [_FLIGHT | {"yaw": [0, 0]}]}, "is damaged"),
        ({"runs": [_FLIGHT | {"x": []}]}, "is damaged"),
        ({"runs": [_FLIGHT | {"x": [], "y": [], "z": [], "yaw": []}]}, "is damaged"),
        ({"kind": "log"}, "kind=log is not allowed"),
    ],
)
def test_planned_manoeuvres_are_of_their_form(change: dict[str, Any], words: str) -> None:
    """What a drop starts from is needed as it is flown; lists in place of mappings are told."""
    import yaml

    content = {"kind": KIND, "name": "a", "words": "a", "effects": [], "step": 0.01, "tilt": 0.3}
    content |= {"runs": [_DROP], "meta": {}}
    Path("x.yaml").write_text(yaml.safe_dump(content))
    assert read_experiment("x.yaml").releases
    Path("x.yaml").write_text(yaml.safe_dump({**content, **change}))
    with pytest.raises(ConfigError, match=f"(?s){words}"):
        read_experiment("x.yaml")


def _singular(*_: object, **__: object) -> object:
    return np.linalg.inv(np.zeros((2, 2)))


def _beyond(_: object) -> object:
    return np.zeros(1)[int("1")]


def _beyond_words(words: list[str]) -> str:
    return words[7]


def test_a_fault_of_this_program_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    """An index beyond the end in a line of a command is no matter of the user's numbers."""
    ours = FunctionType(_beyond_words.__code__, {"__name__": "seals.cli.listing"})
    monkeypatch.setattr("seals.cli.listing.list_installed", ours)
    with pytest.raises(IndexError):
        main(["list"])


def test_the_boundary_tells_numbers_from_faults() -> None:
    """Linear algebra and overflow are numbers, also from another process; others rise."""
    for wrong in (
        lambda: 1.0 / 0.0,
        lambda: np.linalg.inv(np.zeros((2, 2))),
        lambda: np.delete(np.zeros(2), 7),
    ):
        with (
            pytest.raises(LogError, match="a fit cannot be computed from these numbers"),
            sound_numbers("a fit", "Look."),
        ):
            wrong()
    with pytest.raises(LogError, match="Singular"), sound_numbers("a fit", "Look."):
        spread(_singular, [1, 2], 2)
    with pytest.raises(ValueError, match="ours"), sound_numbers("a fit", "Look."):
        raise ValueError("ours")
    for ours in (lambda: np.zeros(1)[int("1")], lambda: [0.0][int("1")], lambda: ()[int("0")]):
        with pytest.raises(IndexError), sound_numbers("a fit", "Look."):
            ours()
    with pytest.raises(IndexError), sound_numbers("a fit", "Look."):
        spread(_beyond, [1, 2], 2)
    with pytest.raises(KeyError), sound_numbers("a fit", "Look."):
        {}["a"]
    assert numeric_fault(LogError("words")) is None
