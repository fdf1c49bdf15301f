"""Every command on logs reads its input in one way: logs, robot, data sheet, what is left out."""

from __future__ import annotations

import json
import shlex
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser

from seals.config.compose import compose
from seals.config.overrides import override, typed
from seals.config.source import find_robot
from seals.errors import ConfigError
from seals.logs import read_native
from seals.logs.log import Log
from seals.logs.native import write_native
from seals.logs.shipped import find_log
from seals.sysid.data.vehicle import read_vehicle
from seals.sysid.report.given_logs import given_logs
from seals.sysid.report.settable import read_usable
from seals.sysid.validation.answer import read_answer
from seals.sysid.validation.application import _refuse_other_logs

ROOTS = ("add", "verify", "calibrate", "diagnose", "plan")


@pytest.fixture
def logs(tmp_path: Path) -> list[Path]:
    """Two short logs of one vehicle in folders whose names a shell and Hydra would cut."""
    given = read_native(find_log("hidden_effect/flight_a"))
    made = []
    for k, name in enumerate(("first, one", "second (two)")):
        rows = slice(300 * k, 300 * k + 200)
        part = Log(
            name=name,
            columns={key: values[rows] for key, values in given.columns.items()},
            meta=given.meta,
        )
        made.append(write_native(part, tmp_path / name))
    return made


@pytest.mark.parametrize("root", ROOTS)
def test_the_data_sheet_of_the_robot_fills_what_a_log_leaves_out(root: str, tmp_path: Path) -> None:
    """A converted log states no tolerances: those of datasheet.yaml reach every command."""
    given = read_native(find_log("hidden_effect/flight_a"))
    bare = {k: v for k, v in given.meta.items() if k != "environment"}
    log = write_native(replace(given, meta=bare), tmp_path / "log")
    folder = tmp_path / "robot"
    shutil.copytree(find_robot("crazyflie").settings.folder, folder)
    (folder / "datasheet.yaml").write_text("environment: {gravity: [0, 0, 9.5]}\nmass: 77.0\n")
    config = compose([override("log", str(log)), override("robot", str(folder))], root=root)
    for read in (given_logs(config).read()[0], read_usable(log, robot=folder)):
        assert read.meta["environment"] == {"gravity": [0, 0, 9.5]}
        assert read.meta["vehicle"] == given.meta["vehicle"]


@pytest.mark.parametrize("root", ROOTS)
def test_several_logs_and_a_robot_folder_reach_every_command(root: str, logs: list[Path]) -> None:
    """All commands join the logs that they are given, and know the robot of ``robot=``."""
    config = compose([override("log", list(map(str, logs))), "robot=crazyflie"], root=root)
    log, robot = given_logs(config).read()
    assert [part["rows"] for part in log.meta["logs"]] == [200, 200]
    assert robot is not None
    assert robot.robot.name == "crazyflie"


@pytest.mark.parametrize("root", ROOTS)
def test_what_is_left_out_is_left_out_for_every_command(root: str, logs: list[Path]) -> None:
    """``without=`` takes an effect out of the log's model and out of the robot's."""
    words = [override("log", str(logs[0])), "without=[linear_drag]"]
    log, _ = given_logs(compose(words, root=root)).read()
    whole, _ = given_logs(compose(words[:1], root=root)).read()
    kinds = [
        {type(e).__name__ for e in read_vehicle(one.meta).effects.values()} for one in (log, whole)
    ]
    assert kinds[1] - kinds[0] == {"DragLinear"}
    found = given_logs(compose([*words, "robot=boat"], root=root))
    assert found.robot is not None
    robot = found.read()[1]
    assert robot is not None
    kinds = [{type(e).__name__ for e in one.effects.values()} for one in (robot, found.robot)]
    assert kinds[1] - kinds[0] == {"DragLinear"}


def test_what_an_earlier_command_left_out_may_be_missing(logs: list[Path]) -> None:
    """A name on the command line must be held by the model; one noted in an answer need not."""
    config = compose([override("log", str(logs[0]))], root="verify")
    assert given_logs(config, noted=["no_such"]).read()[0].rows == 200
    config = compose([override("log", str(logs[0])), "without=[no_such]"], root="verify")
    with pytest.raises(ConfigError, match="without=no_such"):
        given_logs(config, noted=["linear_drag"]).read()


def test_printed_words_give_the_same_input_again(
    logs: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Log, robot and what is left out, typed in a shell, compose the same configuration."""
    monkeypatch.chdir(logs[0].parent)
    words = [override("log", [p.name for p in logs]), "robot=crazyflie", "without=[linear_drag]"]
    given = given_logs(compose(words, root="plan"))
    again = given_logs(compose(shlex.split(given.log_words + given.robot_words), root="add"))
    assert again.places == given.places == tuple(Path(p.name) for p in logs)
    assert again.without == given.without == ("linear_drag",)
    assert again.config.robot == given.config.robot


NAMES = [
    "a b",
    "a,b",
    "it's",
    "a\\",
    "b\\'c",
    "1e3",
    "null",
    "é",
    "a(b)",
    "x=y",
    "[q]",
    "~/x",
    " a ",
]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("many", [False, True])
def test_any_name_survives_shell_and_hydra(name: str, many: bool) -> None:
    """A value is read again as the text that it was, alone or in a list."""
    value: Any = [name, "z"] if many else name
    (word,) = shlex.split(typed("log", value))
    found: Any = OverridesParser.create().parse_override(word).value()
    text = [str(getattr(one, "text", one)) for one in (found if many else [found])]
    assert text == (value if many else [value])


def test_an_answer_tells_all_its_logs_and_what_was_left_out(tmp_path: Path) -> None:
    """Paths and checksums of several logs are read; entries of another kind are refused."""
    logs = [{"path": "/a", "sha256": "1"}, {"path": "/b", "sha256": "2"}]
    answer = {"verdict": "named", "effects": [{"name": "wind"}], "without": ["drag"]}
    place = tmp_path / "diagnosis.json"
    place.write_text(json.dumps({**answer, "log": {"logs": logs}}))
    found = read_answer(place).answer
    assert found.tables == {"/a": "1", "/b": "2"}
    assert found.without == ["drag"]
    for wrong in ({"log": {"logs": [3]}}, {"log": {"path": 3}}, {"without": [3]}, {"without": "x"}):
        place.write_text(json.dumps({**answer, **wrong}))
        with pytest.raises(ConfigError, match="is damaged"):
            read_answer(place)


def test_only_the_logs_that_were_diagnosed_are_added() -> None:
    """In any order and at any place; neither fewer nor different ones."""
    diagnosed = {"/a": "1", "/b": "2"}
    _refuse_other_logs(diagnosed, {"/moved/b": "2", "/a": "1"})
    _refuse_other_logs({}, {"/a": "1"})
    with pytest.raises(ConfigError, match="2 logs were diagnosed, 1 given"):
        _refuse_other_logs(diagnosed, {"/a": "1"})
    with pytest.raises(ConfigError, match="log=/c is not the log that was diagnosed"):
        _refuse_other_logs(diagnosed, {"/a": "1", "/c": "3"})


def test_a_robot_without_a_data_sheet_leads_to_one(tmp_path: Path) -> None:
    """A converted log has no metadata of its own, and the shipped Crazyflie no data sheet."""
    given = read_native(find_log("hidden_effect/flight_a"))
    place = tmp_path / "flight"
    write_native(replace(given, name="flight", meta={}), place)
    config = compose([override("log", str(place)), "robot=crazyflie"], root="diagnose")
    with pytest.raises(ConfigError, match=r"no data sheet.*\n.*seals new datasheet") as refusal:
        given_logs(config).read()
    assert len(str(refusal.value).splitlines()) == 2
