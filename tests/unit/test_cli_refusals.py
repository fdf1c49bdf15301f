"""A wrong command line gets two helpful lines and exit code 2, and leaves nothing behind."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from seals.cli.main import main
from seals.errors import PhysicsError

pytestmark = pytest.mark.usefixtures("elsewhere")

WRONG = [
    ("run ROBOT tme.step=1", "tme.step", "Did you mean 'time'?"),
    ("run ROBOT effects.hull_drag.drag_coeficient=2", "effects.hull_drag.drag_coeficient", "coeff"),
    ("run ROBOT effects.hul_drag.coefficient_x=2", "effects.hul_drag", "Did you mean 'hull_drag'?"),
    ("run robot=bal", "robot 'bal'", "Did you mean 'ball'?"),
    ("run ROBOT +effect@effects.b=quadratic_darg", "'quadratic_darg'", "mean 'quadratic_drag'?"),
    ("run ROBOT +efect@effects.b=wind", "no group 'efect'", "Did you mean 'effect'?"),
    ("run ROBOT watter=fossen", "watter", "Did you mean 'water'?"),
    ("run ROBOT water=fosen", "water=fosen", "Did you mean 'fossen'?"),
    ("run ROBOT time.step=fast", "time.step=fast", "Allowed: a finite number from 1e-05 to 0.1 s"),
    ("run ROBOT time.step=0", "time.step=0.0", "from 1e-05 to 0.1 s"),
    ("run ROBOT time.step=nan", "time.step=nan", "a finite number"),
    (
        "run ROBOT effects.hull_drag.coefficient_x=inf",
        "effects.hull_drag.coefficient_x=inf",
        "finite",
    ),
    ("run ROBOT effects.hull_drag.medium=watr", "medium=watr", "Did you mean 'water'?"),
    ("run ROBOT time.step=[1", "time.step=[1 cannot be read", "not closed"),
    ("run ROBOT time.step", "time.step: no experiment", "give its value: time.step=VALUE"),
    ("run repeat=old hydra.run.dir=./old", "is the folder of the run itself", "Name another"),
    ("run ROBOT time.step=", "time.step=", "a finite number"),
    (
        "run ROBOT effect@effects.b=wind",
        "effect@effects.b is not chosen",
        "write +effect@effects.b=wind;",
    ),
    ("run ROBOT effect=wind", "effect is not chosen", "write +effect@effects.wind=wind;"),
    ("run ROBOT +effects.wind.velocity_x=3", "names no plug-in", "+effect@effects.wind=wind"),
    ("run ROBOT environment.wind=3", "'wind' is not a key", "plug-in: +effect@effects.wind=wind."),
    ("run ROBOT gravity=1.6", "'gravity' is not a key", "mean 'environment.gravity'?"),
    ("run ROBOT duration=5", "'duration' is not a key", "mean 'time.duration'?"),
    ("run ROBOT fluid=fossen", "fluid 'fossen'", "Write water=fossen."),
    ("run ROBOT time.duration=5s", "'5s' is not a number", "to 1e+06 s"),
    ("run ROBOT fluid.physics.adhesion=0.01", "fluid.physics.adhesion", "water=particles"),
    ("run ROBOT water=particles fluid.solid_scale.a=2", "solid_scale.a", "put a + in front"),
    ("run ROBOT initial.position=[0, 0, 1]", "ends inside", "'initial.position=[0, 0, 1]'"),
    ("run ROBOT --duration 5", "no flag --duration", "write duration=5"),
    ("run robot=own.urdf", "nor an existing file", "seals new robot NAME urdf=FILE"),
    ("diagnose flight.ulg", "log=flight.ulg: there is no such file", "Give a log folder"),
    ("convert flight.ulg out=x", "log=flight.ulg: there is no such file", "Shipped: hidden_effect"),
    ("run ROBOT +effect@effects.gravity=gravity", "effects.gravity is chosen twice", "leave the +"),
    ("run ROBOT +time.step=0.001", "+time.step: the key exists", "leave the + out"),
    ("run ROBOT ++time.stp=1", "time.stp", "Did you mean 'step'?"),
    ("run ROBOT ~effects.wake", "~effects.wake", "seals run --cfg job"),
    ("run ROBOT time.step=0.1,0.2", "holds several values", "--multirun"),
    ("run ROBOT name=${nme}", "'nme' not found", "${key.below}"),
    ("run ROBOT backend=null", "null", "~GROUP"),
    ("run ROBOT controller=none", "controller 'none'", "use ~controller.  Installed: autopilot"),
    ("train env=walk", "env=walk does not exist", "Write task=walk."),
    ("run ROBOT seed=1.5", "seed=1.5", "a whole number"),
    ("run", "robot is not given", "Choose one: robot=NAME"),
    ("run robot=", "robot= has no value", "Installed: aam"),
    ("run robot=no/such/folder", "no folder 'no/such/folder'", "ball"),
    ("run experiment=drop_tst", "experiment=drop_tst", "Did you mean 'drop_test'?"),
    ("run ROBOT --multirn", "--multirn", "--multirun"),
    ("rnu robot=ball", "no verb 'rnu'", "Did you mean 'run'?"),
    ("list efect", "'efect' is not a kind", "Did you mean 'effect'?"),
    ("describe effect wnd", "effect 'wnd'", "Did you mean 'wind'?"),
    ("describe a b c", "not a kind followed by a name", "seals describe KIND NAME"),
    ("check", "robot is not given", "robot=FOLDER"),
    ("run ROBOT learner=sac", "seals run does not know learner=", "belongs to seals train"),
    ("run ROBOT +learner=sac", "seals run does not know learner=", "belongs to seals train"),
    ("run env=reach", "seals run does not know env=", "seals evaluate or seals record or seals"),
    ("run --config-name run_schema ROBOT", "is a schema, not a configuration", "seals run KEY"),
    ("train --config-name=train_schema", "is a schema, not a configuration", "seals train KEY"),
    ("compare ROBOT reader=impak", "reader 'impak'", "Did you mean 'impack'?"),
    ("validate water --out", "argument --out: expected one argument", "validate water --help"),
    ("view nowhere", "no run, experiment or robot has this name", "seals help view"),
    ("export", "policy is not given", "seals export policy=FOLDER"),
    ("run ROBOT initial.position.z=2", "initial.position is a list", "initial.position.0=VALUE"),
    ("run ROBOT initial.position.7=2", "initial.position[7] is not allowed", "from 0"),
    ("teleop ROBOT script=", "script= has no value", "script=keys.yaml"),
    ("compare ROBOT fit.steps=abc", "fit is a list, which has no 'steps'", "fit.0=VALUE"),
    ("verify log=hidden_effect/flight_a model=", "model= does not exist", "Make one: seals add"),
    ("convert log=hidden_effect/flight_a out=x", "is already a log folder", "seals diagnose log="),
    ("compare ROBOT", "log is not given", "log=FOLDER"),
    ("run ROBOT seed=range(3)", "seed=range(3) holds several values", "--multirun"),
    ("run ROBOT ++water=fossen", "++water: the choice of a group", "write water=NAME"),
    ("run ROBOT ~water=particles", "~water=particles: there is no such key", "--cfg job"),
    ("run ROBOT ~time.step=3", "~time.step=3: the value is 0.004", "write ~time.step"),
    ("run ROBOT --config-path nowhere", "--config-path nowhere: there is no", "folder of config"),
    ("run ROBOT hydra.run.dir=", "hydra.run.dir= does not name a folder", "hydra.run.dir=FOLDER"),
    ("run ROBOT --config-dir nowhere", "--config-dir nowhere: there is no", "folder of config"),
    ("run ROBOT hide=wind", "hide=wind is not allowed", "in brackets is required: hide=[wind]"),
    (
        "check robot=ball robot=box",
        "robot=ball robot=box: several robots",
        "seals check robot=NAME",
    ),
    (
        "calibrate log=hidden_effect/flight_a parameters=[mass] prior=-1",
        "prior=-1.0 is not allowed",
        "from 0.01 to 10",
    ),
]


@pytest.mark.parametrize(("line", "wrong", "advice"), WRONG)
def test_wrong_line_gets_two_lines(
    line: str,
    wrong: str,
    advice: str,
    pebble: Path,
    elsewhere: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """What was wrong, then what to do: two lines, exit code 2, soon, no run folder."""
    start = time.process_time()
    code = main([f"robot={pebble}" if word == "ROBOT" else word for word in line.split()])
    spent = time.process_time() - start
    out, err = capsys.readouterr()
    lines = err.splitlines()
    assert (code, out, len(lines)) == (2, "", 2), err
    assert wrong in lines[0]
    assert advice in lines[1]
    assert spent < 2.0
    assert not list(elsewhere.iterdir())


@pytest.mark.parametrize(
    ("line", "advice"),
    [
        ("train varied=x", "Allowed: a finite number from 0 to 10"),
        ("train varied=11", "Allowed: a finite number from 0 to 10 (default source: "),
        ("run ROBOT environment.friction=x", "Allowed: a finite number from 0 to 10"),
        ("run ROBOT environment.friction=-1", "Allowed: a finite number from 0 to 10"),
        ("run ROBOT time.step=x", "Allowed: a finite number from 1e-05 to 0.1 s"),
        ("run ROBOT time.step=-1", "Allowed: a finite number from 1e-05 to 0.1 s (default"),
    ],
)
def test_the_bounds_of_a_pure_number_carry_no_unit(
    line: str, advice: str, pebble: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A number out of bounds, and a word in its place: the unit is told where there is one."""
    assert main([f"robot={pebble}" if word == "ROBOT" else word for word in line.split()]) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert last == advice or (last.startswith(advice) and "(default" in advice)


@pytest.mark.parametrize(
    ("line", "name", "wrong", "advice"),
    [
        ("render old", "run.json", "run=old: there is no run in this", ".hydra/config.yaml"),
        ("add old", "diagnosis.json", "name is not given", "name=my_model"),
        ("export policy=old", "run.json", "policy=old: there is no card.json", "that seals train"),
        ("evaluate policy=still out=old/run.json", "run.json", "run.json is a file", "out=FOLDER"),
        ("record out=old", "run.json", "out=old exists already", "another name"),
        ("record hdf5=old/run.json", "run.json", "hdf5=old/run.json exists", "another name"),
        (
            "validate water hydrostatics --out old/run.json",
            "run.json",
            "run.json' is a file",
            "--out FOLDER",
        ),
    ],
)
def test_a_folder_of_another_kind(
    line: str,
    name: str,
    wrong: str,
    advice: str,
    elsewhere: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A folder without its key, of another verb, or a file in its place: nothing is computed."""
    if line.startswith(("record", "evaluate")):
        pytest.importorskip("torchrl")
    (elsewhere / "old").mkdir()
    (elsewhere / "old" / name).write_text("{}", encoding="utf-8")
    assert main(line.split()) == 2
    first, second = capsys.readouterr().err.splitlines()
    assert wrong in first
    assert advice in second
    assert [path.name for path in elsewhere.iterdir()] == ["old"]


def test_an_interval_is_for_a_sweeper_that_searches(
    pebble: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The basic one needs values to count."""
    assert main(["run", "-m", f"robot={pebble}", "seed=interval(0,1)"]) == 2
    first, second = capsys.readouterr().err.splitlines()
    assert first == "ConfigError: an interval does not define a number of values."
    assert "hydra/sweeper=optuna" in second


def test_a_folder_that_is_no_robot_is_named(
    elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A folder that is there but is no robot is not told to be missing."""
    (elsewhere / "hull").mkdir()
    assert main(["run", "robot=hull"]) == 2
    assert capsys.readouterr().err.splitlines() == [
        "UnknownPlugin: robot 'hull' exists here, but contains no robot.yaml.",
        "Create one from a URDF: seals new robot NAME urdf=FILE, or see: seals list robot",
    ]


@pytest.mark.parametrize("verb", ["add name=x", "plan"])
def test_a_damaged_diagnosis_is_told_once(
    verb: str, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The fault of the file, once, and what to do."""
    (elsewhere / "diagnosis.json").write_text("{", encoding="utf-8")
    assert main([*verb.split(), "diagnosis=."]) == 2
    first, second = capsys.readouterr().err.splitlines()
    assert first.count("damaged") == 1
    assert ".." not in first + second
    assert "seals diagnose" in second or "Diagnose the log again" in second


def test_a_run_is_not_resumed_as_a_training(
    elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The verb that resumes it is named."""
    (elsewhere / "old" / ".hydra").mkdir(parents=True)
    (elsewhere / "old" / ".hydra" / "overrides.yaml").write_text("[]", encoding="utf-8")
    for name in ("run.json", "log.parquet"):
        (elsewhere / "old" / name).touch()
    assert main(["train", "resume=old"]) == 2
    first, second = capsys.readouterr().err.splitlines()
    assert first.endswith("this folder contains a run, not a training.")
    assert "seals run resume=old" in second


def test_a_key_with_two_values_is_remarked(
    pebble: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The last value holds, as scripts want it, and a person is told so."""
    seen = []
    application(monkeypatch, lambda config: seen.append(config.seed))
    assert main(["run", f"robot={pebble}", "seed=1", "seed=2"]) == 0
    assert seen == [2]
    assert capsys.readouterr().err == "seed is given 2 values; the last one is used: seed=2\n"


@pytest.mark.parametrize("line", ["run robot=bal", "run robot=FOLDER time.step=nan"])
def test_the_installed_command_refuses_the_same_way(
    line: str, pebble: Path, elsewhere: Path
) -> None:
    """The console script itself: exit code 2, two lines, no traceback."""
    command = [str(Path(sys.executable).with_name("seals")), *line.split()]
    command = [word.replace("FOLDER", str(pebble)) for word in command]
    start = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    # a guard against hanging, not a benchmark: a loaded machine starts Python slowly
    assert time.perf_counter() - start < 10.0
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 2
    assert not list(elsewhere.iterdir())


def application(monkeypatch: pytest.MonkeyPatch, execute: Any) -> None:
    """Put a function in the place of the simulation."""
    module = ModuleType("seals.run.application")
    module.execute = execute  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "seals.run.application", module)


def test_refusal_inside_the_simulation_leaves_no_folder(
    pebble: Path,
    elsewhere: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A refusal raised after composing prints likewise, and the empty run folder goes."""

    def execute(config: Any) -> None:
        raise PhysicsError("the step is above the stable bound.\nAllowed: at most 0.002 s")

    application(monkeypatch, execute)
    assert main(["run", f"robot={pebble}"]) == 2
    expected = "PhysicsError: the step is above the stable bound.\nAllowed: at most 0.002 s\n"
    assert capsys.readouterr().err == expected
    assert not list(elsewhere.iterdir())


def test_refusal_after_writing_keeps_what_was_written(
    pebble: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run that was refused half-way keeps its files: they may hold the reason."""
    from hydra.core.hydra_config import HydraConfig

    def execute(config: Any) -> None:
        folder = Path(HydraConfig.get().runtime.output_dir)
        (folder / "run.json").write_text("{}", encoding="utf-8")
        raise PhysicsError("the state is not finite.\nUse a smaller step")

    application(monkeypatch, execute)
    assert main(["run", f"robot={pebble}"]) == 2
    assert len(list(elsewhere.glob("runs/*/*/run.json"))) == 1


def test_good_line_runs_in_a_folder_of_its_own(
    pebble: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run gets runs/DATE/TIME_NAME with its resolved configuration, and stays where it is."""
    seen = []

    def execute(config: Any) -> int:
        seen.append((config.time.step, os.getcwd()))
        return 0

    application(monkeypatch, execute)
    assert main(["run", f"robot={pebble}", "time.step=0.001", "name=trial"]) == 0
    assert seen == [(0.001, str(elsewhere))]
    assert len(list(elsewhere.glob("runs/????-??-??/??-??-??_trial/.hydra/config.yaml"))) == 1


def test_multirun_runs_each_value(
    pebble: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``--multirun`` runs each value in a folder of its own."""
    steps = []
    application(monkeypatch, lambda config: steps.append(config.time.step))
    assert main(["run", f"robot={pebble}", "time.step=0.001,0.002", "--multirun"]) == 0
    assert steps == [0.001, 0.002]


def test_bug_in_the_simulation_is_not_dressed_up(
    pebble: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An error that is nobody's refusal keeps its type and traceback."""

    def execute(config: Any) -> None:
        raise ZeroDivisionError("a bug")

    application(monkeypatch, execute)
    with pytest.raises(ZeroDivisionError, match="a bug"):
        main(["run", f"robot={pebble}"])


@pytest.mark.parametrize("number", [errno.EACCES, errno.EROFS])
def test_what_may_not_be_written_is_said_in_words(
    number: int, pebble: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A folder without the right to write: exit code 2, and where to go."""

    def execute(config: Any) -> None:
        raise OSError(number, os.strerror(number), "/theirs/x.hdf5")

    application(monkeypatch, execute)
    assert main(["run", f"robot={pebble}"]) == 2
    said = capsys.readouterr().err.splitlines()
    assert said[0].endswith(f"'/theirs/x.hdf5' cannot be read or written: {os.strerror(number)}.")
    assert "another place" in said[1]


def test_interrupt_ends_with_one_line(
    pebble: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ctrl-C exits with 130 and one line."""

    def execute(config: Any) -> None:
        raise KeyboardInterrupt

    application(monkeypatch, execute)
    assert main(["run", f"robot={pebble}"]) == 130
    assert capsys.readouterr().err == "Interrupted.\n"


def test_debug_shows_the_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """SEALS_DEBUG=1 shows where a refusal comes from."""
    monkeypatch.setenv("SEALS_DEBUG", "1")
    assert main(["run", "robot=bal"]) == 2
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["run", "--experiment=drop_test"], "no dashes: write experiment=drop_test"),
        (["run", "--resolve"], "--cfg job --resolve"),
        (["run", "--multirn"], "--multirun"),
        (["run", "experiment=falling_balls"], "seals compare experiment=falling_balls"),
        (["compare", "experiment=drop_test"], "seals run experiment=drop_test"),
    ],
)
def test_flags_and_verbs_are_answered_in_two_lines(
    words: list[str],
    hint: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A flag that does not exist, or the wrong verb: exit code 2 and what to write instead."""
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 2
    assert hint in said[1]
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    "words", [[], ["-m", "seed=1,2"], ["out=runs"], ["out=runs/below"]], ids=" ".join
)
def test_a_folder_that_cannot_be_made_is_said_in_words(
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A file in the place of the run folder: exit code 2, no traceback, the setting that helps."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").write_text("in the way", encoding="utf-8")
    assert main(["run", *words, "experiment=drop_test"]) == 2
    said = capsys.readouterr().err
    assert "cannot be created" in said
    assert "Errno" not in said
    assert ": out=FOLDER" in said


def test_check_refuses_what_a_run_refuses(pebble: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A negative drag in robot.yaml is refused by the check, too."""
    text = (pebble / "robot.yaml").read_text(encoding="utf-8")
    broken = text.replace("coefficient_x: 3.1", "coefficient_x: -3.1")
    (pebble / "robot.yaml").write_text(broken, encoding="utf-8")
    assert main(["check", f"robot={pebble}"]) == 2
    assert "effects.hull_drag.coefficient_x" in capsys.readouterr().err
