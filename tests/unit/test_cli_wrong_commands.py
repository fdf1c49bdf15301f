"""Fifty wrong commands: each is answered in two lines that name the fault and lead on."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from seals.cli.main import main

FIFTY = [
    # a mistyped verb, or none
    ("rnu robot=ball", "no verb 'rnu'", "Did you mean 'run'?"),
    ("Run robot=ball", "no verb 'Run'", "'run'"),
    ("help rnu", "no verb 'rnu'", "Did you mean 'run'?"),
    ("--verson", "no flag '--verson'", "Did you mean '--version'?"),
    # a mistyped key
    ("run robot=ball watter=fossen", "watter", "Did you mean 'water'?"),
    ("run robot=ball duration=2", "duration", "Did you mean 'time.duration'?"),
    ("run robot=ball effects.drag.coefficient_x=1", "'drag'", "'air_drag' or 'spin_drag' or"),
    ("diagnose log=run robt=ball", "robt", "Did you mean 'robot'?"),
    ("new robot x urdf=hexa.urdf mediun=water", "mediun", "Did you mean 'medium'?"),
    ("benchmark ot=x", "ot=x", "Did you mean 'out'?"),
    # a mistyped value
    ("run robot=bal", "robot 'bal'", "Did you mean 'ball'?"),
    ("run robot=ball guide=hovr", "guide 'hovr'", "Did you mean 'hover'?"),
    ("describe effect drag", "effect 'drag'", "'quadratic_drag'"),
    ("describe drag", "name 'drag'", "seals describe effect quadratic_drag"),
    ("describe efect wind", "'efect' is not a kind", "Did you mean 'effect'?"),
    ("render run fps=25Hz", "'25Hz' is not a number", "from 0.1 to 240 Hz"),
    ("render run quality=papr", "quality=papr", "Did you mean 'paper'?"),
    ("run robot=ball hide=[air_darg]", "hide=air_darg", "Did you mean 'air_drag'?"),
    ("autopilot robot=ball protocol=mavlink", "protocol=mavlink", "ardupilot, px4"),
    ("completion tcsh", "'tcsh' is not supported", "bash, fish, zsh"),
    # a unit, a range, a sign
    ("run robot=ball time.duration=2s", "'2s' is not a number", "to 1e+06 s"),
    ("run robot=ball time.duration=-1", "time.duration=-1", "from 0.0001 to 1e+06 s"),
    ("run robot=ball initial.rpy=[90,0,0]", "initial.rpy[0]=90", "from -6.3 to 6.3 rad"),
    ("render run end=-1", "end=-1", "from 0 to 1e+06 s"),
    ("convert log=a.csv reader=csv rate=-5 out=x", "rate=-5", "Hz"),
    ("view port=99999 robot=ball", "port=99999", "65535"),
    # a file that is not there, or of the wrong kind
    ("render nowhere", "run=nowhere: there is no such folder", "folder of a run"),
    ("render empty", "run=empty: there is no run in this folder", "run.json"),
    ("diagnose log=zzz", "log=zzz: there is no such file", "Give a log folder"),
    ("diagnose note.txt", "log=note.txt is not a log folder", "seals convert log=FILE"),
    ("diagnose log=answer", "log=answer is not a log folder", "seals convert log=FILE"),
    ("add diagnosis=run name=x", "diagnosis=run", "seals diagnose log=FOLDER"),
    ("check note.txt", "robot 'note.txt' exists here", "urdf=FILE"),
    ("teleop robot=ball script=nowhere.yaml", "script nowhere.yaml", "keys.yaml"),
    ("teleop robot=ball script=keys.yaml", "keys.yaml is not valid YAML", "brackets"),
    ("verify log=hidden_effect/flight_a model=nosuch", "model=nosuch", "seals add"),
    # a file for a folder, and the other way round
    ("compare log=run robot=ball out=note.txt", "note.txt is a file", "out=FOLDER"),
    ("diagnose log=hidden_effect/flight_a out=note.txt", "note.txt is a file", "out=FOLDER"),
    ("run robot=ball out=note.txt", "note.txt' is a file", "out=FOLDER"),
    ("new robot x urdf=empty", "empty", "URDF"),
    # two words that contradict each other, or too many
    ("run ball box", "robot is given twice: ball and box", "Leave one of them out"),
    ("check ball robot=box", "robot is given twice: box and ball", "Leave one of them out"),
    ("run robot=ball --resume", "--resume belongs to a sweep", "Add --multirun"),
    ("list effect wind", "more than one kind", "seals describe effect wind"),
    # a missing '=', brackets, key or value
    ("run robot:ball", "robot:ball", "Did you mean robot=ball?"),
    ("run robot = ball", "'=' is separated", "KEY=VALUE"),
    ("run robot=ball time.duration 2", "time.duration: no experiment", "value: time.duration=2."),
    ("run -robot ball", "no flag -robot", "robot="),
    ("calibrate log=hidden_effect/flight_a parameters=mass", "parameters=mass", "=[mass]"),
    ("new robot x", "urdf is not given", "seals new robot x urdf=FILE"),
]

FURTHER = [
    ("render note.txt", "run=note.txt: this is a file", "folder of a run"),
    ("view", "no run is given", "seals view FOLDER"),
    ("diagnose log=hidden_effect/flight_a out=", "out= does not name a folder", "out=FOLDER"),
    ("validate water full=yes", "full=yes is not allowed", "full=true"),
    ("run robot=ball +effect=wind", "(in effect/wind)", "+effect@effects.wind=wind"),
    ("run robot=ball effects=none", "effects holds named entries", "effects.water_drag"),
    # a bracket that is not closed, round ones, a list for a mapping
    ("run robot=ball initial.position=[0,0", "[0,0 cannot be read", "initial.position=[0,0]'"),
    ("run robot=ball 'initial.position=(0,0,1)'", "(0,0,1)", "square brackets"),
    ("diagnose log=hidden_effect/flight_a effects=[wnd]", "named entries", "effects.NAME.KEY"),
    ("run robot=ball optics=paper", "optics holds named entries", "optics.absorption"),
    ("render run film=gif", "neither true nor false", "Allowed: true, false"),
    # a key of another verb
    ("diagnose log=hidden_effect/flight_a span=[1,2]", "'span'", "a key of seals convert"),
    ("run robot=ball log=run", "'log' is not a key", "a key of seals add or seals calibrate"),
    ("diagnose log=hidden_effect/flight_a tolerance=3", "'tolerance'", "Allowed: actuators, "),
    ("run robot=ball wave.amplitude=1", "not a key of wave", "Choose one first: wave=NAME.  Allo"),
    # a name that nothing has, with the nearest, and a place that cannot be a key
    ("diagnose hidden_effect/flight_c", "no log, experiment", "log=hidden_effect/flight_b?  See:"),
    ("view some/place", "there is no such file here", "Give an existing folder or file"),
    ("describe", "nothing is named", "seals describe KIND NAME"),
    ("new robbot x urdf=hexa.urdf", "'robbot' is not a kind", "Did you mean 'robot'?"),
    ("compare experiment=falling_balls only=[golf]", "no log is called 'golf'", "'golf_ball'?"),
    ("record env=reach episodes=-1", "episodes=-1 is not", "a whole number from 1 to"),
    ("run --urdf my.urdf", "seals run needs a robot", "seals new robot NAME urdf=my.urdf"),
    ("check urdf=my.urdf", "seals check needs a robot", "seals new robot NAME urdf=my.urdf"),
    # a list of places without brackets of its own
    (
        "run robot=hexacopter controller=cascade guide=waypoints guide.places=[0,0,1]",
        "guide.places=[0,0,1] is not allowed",
        "guide.places=[[0,0,1],[1,0,1]]",
    ),
    # a table without a map, without a time, without a sample, and an empty folder
    ("convert log=stamped.csv out=e", "no column is mapped to the time", "columns: {time: t, NAME"),
    ("convert log=hollow.csv map=map.yaml out=e", "time stamps are not finite", "seals help"),
    ("convert log=empty out=e", "log=empty is an empty folder", "file or folder of a log"),
    # an empty file, a header alone, a kind that its bytes belie, a list for a map
    ("convert log=empty.csv out=e", "'empty.csv' is empty", "complete copy"),
    ("convert log=header.csv out=e", "has no rows", "rows of numbers"),
    ("convert log=a.csv reader=ulog out=e", "not a ULog file", "seals list reader"),
    ("convert log=a.csv map=list.yaml out=e", "but contains a list", "NAME: VALUE"),
    ("convert log=a.csv out=e", "2 rows", "seals help convert"),
    ("new robot x urdf=empty.csv", "is empty", "complete copy"),
    ("new robot x urdf=https://example.com/a.urdf", "is a web address", "Download it"),
    # letters of other alphabets, and signs that look like ours
    ("run robot=мяч", "robot=мяч cannot be read", "robot='\"мяч\"'"),
    ("run robot=ball ＋model=x", "cannot be read as KEY=VALUE", "letters of ASCII"),
    # a file for an experiment, a place that leads out, a robot of the wrong kind
    ("new sensor ../x", "'../x' cannot be the name of a sensor", "For instance: x"),
    ("new effect wind", "'wind' is already installed", "Choose another name: my_wind"),
    ("run repeat=note.txt", "repeat=note.txt: this is a file", "folder of a run"),
    ("run robot=ball ~effects.nothing", "there is no such key", "seals run --cfg job"),
    ("diagnose log=hidden_effect/flight_a robot=ball,box", "several values", "use [a,b]"),
    ("convert log=a.csv axes.world=nde out=e", "axes.world=nde", "Did you mean 'neu'?"),
]


@pytest.fixture
def desk(elsewhere: Path) -> Path:
    """A folder with a run, a diagnosis, a text, a damaged script, a URDF and an empty folder."""
    for name in ("run", "answer", "empty"):
        (elsewhere / name).mkdir()
    (elsewhere / "run" / "run.json").write_text("{}", encoding="utf-8")
    (elsewhere / "answer" / "diagnosis.json").write_text("{}", encoding="utf-8")
    (elsewhere / "note.txt").write_text("a note", encoding="utf-8")
    (elsewhere / "a.csv").write_text("t,x\n0,1\n0.1,2\n", encoding="utf-8")
    (elsewhere / "empty.csv").touch()
    (elsewhere / "header.csv").write_text("t,position_x\n", encoding="utf-8")
    (elsewhere / "stamped.csv").write_text("time,x\n0,1\n0.1,2\n", encoding="utf-8")
    (elsewhere / "hollow.csv").write_text("t,x\n" + 50 * "nan,nan\n", encoding="utf-8")
    (elsewhere / "map.yaml").write_text("reader: csv\ncolumns: {t: t, x: position_x}\n", "utf-8")
    (elsewhere / "list.yaml").write_text("- 1\n", encoding="utf-8")
    (elsewhere / "keys.yaml").write_text("a: [", encoding="utf-8")
    (elsewhere / "hexa.urdf").write_text("<robot name='x'><link name='a'/></robot>", "utf-8")
    return elsewhere


@pytest.mark.parametrize(
    ("line", "wrong", "advice"), FIFTY + FURTHER, ids=[line for line, *_ in FIFTY + FURTHER]
)
def test_a_wrong_command_is_answered_in_two_lines(
    line: str, wrong: str, advice: str, desk: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first line names what is wrong, the second what to do; nothing is left behind."""
    before = sorted(desk.rglob("*"))
    assert main(shlex.split(line)) == 2
    out, err = capsys.readouterr()
    lines = err.splitlines()
    assert (out, len(lines)) == ("", 2), err
    assert wrong in lines[0]
    assert advice in lines[1]
    assert sorted(desk.rglob("*")) == before


def test_there_are_fifty() -> None:
    """Each is another one, and none of the further ones is among them."""
    assert len({line for line, *_ in FIFTY}) == 50
    assert len({line for line, *_ in FIFTY + FURTHER}) == 50 + len(FURTHER)
