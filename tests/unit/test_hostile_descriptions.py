"""Descriptions by strangers: vehicles, motors, answers, models and robot files of odd kinds."""

from __future__ import annotations

import copy
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from seals.cli.main import two_lines
from seals.config.overlay import load_overlay, read_overlay
from seals.errors import ConfigError, LogError, SealsError
from seals.logs import Log
from seals.logs.check import refuse_if_bad
from seals.logs.motor_curve import motor_curve, with_rotor_speeds
from seals.logs.native import read_native
from seals.logs.shipped import shipped_logs
from seals.plugins.readers.nanobench import _PUBLIC, ReaderNanobench
from seals.robot.yaml_edit import with_entry, with_number
from seals.scaffold.datasheet import write_datasheet
from seals.sysid.candidates.activity import Moment
from seals.sysid.data.vehicle import read_vehicle
from seals.sysid.validation import answer
from seals.sysid.validation.answer import (
    ActiveSpan,
    Estimate,
    load_answer,
    log_digest,
    read_answer,
)
from seals.sysid.validation.application import _lies_in
from seals.untrusted_io import plain_json, plain_yaml

MOTORS: dict[str, Any] = {
    "text": "hello",
    "a list": [1, 2],
    "a number": 5,
    "key of a number": {1: 2},
    "key of nothing": {None: 2},
    "voltage as text": {"full_voltage": "abc"},
    "voltage as list": {"full_voltage": [1]},
    "voltage as empty list": {"full_voltage": []},
    "voltage below zero": {"full_voltage": -1.0},
    "endless voltage": {"full_voltage": float("inf")},
    "power as text": {"voltage_power": "abc"},
    "power that is none": {"voltage_power": float("nan")},
    "power as list": {"voltage_power": [1, 2]},
    "factor as list": {"thrust_factor": [0]},
    "factor as mapping": {"thrust_factor": {}},
    "order as text": {"order": "abcd"},
    "order of lists": {"order": [[1], [2], [3], [4]]},
    "order as number": {"order": 5},
    "order as mapping": {"order": {"a": 1}},
    "endless order": {"order": [float("inf"), 1, 2, 3]},
    "ragged points": {"points": [[0, 1], [1]]},
    "points as text": {"points": "abc"},
    "points that are none": {"points": [[0, float("nan")], [float("nan"), 1]]},
    "points as mapping": {"points": {"a": "b"}},
    "endless points": {"points": [[0, 0], [1, float("inf")]]},
    "empty points": {"points": [[], []]},
    "range as text": {"range": "ab"},
    "range as number": {"range": 3},
    "range that is none": {"range": [float("nan"), float("nan")]},
    "range of lists": {"range": [[1]]},
    "command as list": {"command": ["pwm"]},
    "command as mapping": {"command": {"a": 1}},
}


@pytest.mark.parametrize("name", MOTORS)
def test_odd_motor_curves_are_refused(name: str) -> None:
    """A data sheet of a stranger is checked before anything is computed with it."""
    with pytest.raises(LogError, match="motors"):
        motor_curve(MOTORS[name])


ROTORS: dict[str, Any] = {
    "text": "abcd",
    "numbers": [1, 2, 3, 4],
    "a number": 4,
    "a mapping": {"a": 1},
    "nothing in them": [{}] * 4,
    "speed as text": [{"max_speed": "a"}] * 4,
    "speed as list": [{"max_speed": [1]}] * 4,
    "speed below zero": [{"max_speed": -1.0}] * 4,
    "endless speed": [{"max_speed": float("inf")}] * 4,
}


def _commanded(**meta: Any) -> Log:
    columns = {f"motor_pwm_{k}": np.full(300, 1500.0) for k in (1, 2, 3, 4)}
    columns |= {"t": np.arange(300) / 100, "specific_force_z": np.full(300, 9.81)}
    return Log(name=meta.pop("title", "a"), columns=columns, meta=meta)


@pytest.mark.parametrize("name", ROTORS)
def test_odd_rotors_are_refused(name: str) -> None:
    """Rotors come from the metadata of the log where no robot is given."""
    with pytest.raises(LogError, match=r"vehicle\.rotors"):
        with_rotor_speeds(_commanded(), motor_curve({"command": "pwm"}), ROTORS[name])


@pytest.mark.parametrize("kind", ["evil", ["a"], {"a": 1}, "\x1b[2J"])
def test_an_odd_kind_of_commands_is_refused(kind: Any) -> None:
    """What the log says of its commands need not be a kind at all."""
    with pytest.raises(LogError, match="motor_command"):
        with_rotor_speeds(_commanded(motor_command=kind), motor_curve(None), [{"max_speed": 9}] * 4)


def test_a_battery_without_a_voltage_is_refused() -> None:
    """Motors whose speed depends on it need a sample of it at least."""
    log = _commanded().with_columns({"battery_voltage": np.full(300, np.nan)})
    curve = motor_curve({"command": "pwm", "full_voltage": 16.0})
    with pytest.raises(LogError, match="every battery_voltage in the log is missing"):
        with_rotor_speeds(log, curve, [{"max_speed": 900.0}] * 4)


VOLTAGES = ["16 V", [16.0], True, 0, -3.0, 1e30, 10**40]


@pytest.mark.parametrize("value", VOLTAGES, ids=repr)
def test_a_full_voltage_is_a_voltage(value: Any, meta: dict[str, Any]) -> None:
    """The laws of batteries divide by it, and compare it."""
    bent = copy.deepcopy(meta)
    bent["vehicle"]["battery"] = {"full_voltage": 16.4}
    assert read_vehicle(bent).full_voltage == 16.4
    bent["vehicle"]["battery"] = {"full_voltage": value}
    with pytest.raises(LogError, match=r"battery\.full_voltage=.* is not allowed"):
        read_vehicle(bent)


@pytest.mark.parametrize("sign", ["\n", "\r", "\x85", "\u2028", "\x0c", "\x1b", "\0"])
@pytest.mark.parametrize("where", ["flight", "robot"])
def test_a_name_writes_no_entry_of_a_data_sheet(where: str, sign: str, tmp_path: Path) -> None:
    """A folder may be called anything; a new line in its name stays within the comment."""
    title = f"a{sign}motors: {{command: dshot}}{sign}"
    names = {"flight": ("b", title), "robot": (title, "b")}[where]
    sheet = tmp_path / "datasheet.yaml"
    write_datasheet(
        _commanded(title=names[1]), {"name": names[0], "mass": 1.0}, sheet, replace=False
    )
    assert "motors" not in yaml.safe_load(sheet.read_text())


@pytest.mark.parametrize("text", ["pwm}\nevil: {a: 1", "pwm, order: [4, 3, 2, 1]", "!!python/x"])
def test_a_motor_curve_writes_no_other_entry(text: str, tmp_path: Path) -> None:
    """What a flight states of its motors is checked before it goes into the data sheet."""
    sheet = tmp_path / "datasheet.yaml"
    with pytest.raises(LogError, match=r"motors\.command"):
        write_datasheet(
            _commanded(motors={"command": text}), {"name": "b", "mass": 1.0}, sheet, replace=False
        )
    assert not sheet.exists()


SECTIONS: dict[str, Any] = {
    "vehicle": ["abc", [1], 5],
    "environment": ["abc", [1], 5],
    "sensors": ["abc", [1]],
    "tolerance": [[1], "abc"],
    "disturbance": [[[1]], "abc", 5],
    "battery": ["abc", [1]],
    "simulated": ["abc", 5],
    "baseline": ["abc", 5, [1], [[1]], ["gravity"], [{}], [{"name": 5}]],
    "initial_state": ["abc", 5, [1]],
}


@pytest.mark.parametrize(
    ("key", "value"), [(key, value) for key, values in SECTIONS.items() for value in values]
)
def test_sections_of_another_kind_are_refused(key: str, value: Any) -> None:
    """Readers of a log's metadata count on lists and mappings."""
    with pytest.raises(LogError, match=f"{key}: meta.yaml says"):
        refuse_if_bad(_commanded(**{key: value}))


@pytest.mark.parametrize("value", ["strong", [1, 2], {}, True], ids=repr)
def test_gusts_are_numbers(value: Any) -> None:
    """Several logs are joined by the strongest of them, before a vehicle is made."""
    with pytest.raises(LogError, match=r"disturbance\.force_sigma: meta.yaml says"):
        refuse_if_bad(_commanded(disturbance={"force_sigma": value}))


@pytest.fixture(scope="module")
def meta() -> dict[str, Any]:
    """Metadata of a sound flight."""
    return read_native(shipped_logs()["hidden_effect/flight_a"]).meta


BENT: dict[str, tuple[tuple[Any, ...], Any]] = {
    "gravity as number": (("environment", "gravity"), 9.81),
    "density as list": (("environment", "air_density"), [1.2]),
    "level as text": (("environment", "water_level"), "deep"),
    "unknown law": (("baseline", 0, "name"), "__class__"),
    "unknown parameter": (("baseline", -1, "parameters"), {"__init__": 1}),
    "parameter as text": (("baseline", -1, "parameters"), {"a": "b"}),
    "parameters as list": (("baseline", -1, "parameters"), [1]),
    "odd medium": (("baseline", -1, "medium"), [1]),
    "imu as text": (("sensors", "imu"), "abc"),
    "place as text": (("sensors", "imu", "position"), "here"),
    "turn of three": (("sensors", "imu", "orientation"), [1, 0, 0]),
    "gust as text": (("disturbance", "force_sigma"), "strong"),
    "gust as list": (("disturbance", "force_sigma"), [1, 2]),
    "time as mapping": (("disturbance", "correlation_time"), {}),
}


@pytest.mark.parametrize("name", BENT)
def test_an_odd_description_of_a_vehicle_is_refused(name: str, meta: dict[str, Any]) -> None:
    """Every entry of the metadata may be of another kind: it ends in words."""
    (*above, key), value = BENT[name]
    bent = copy.deepcopy(meta)
    node: Any = bent
    for part in above:
        node = node[part]
    node[key] = value
    with pytest.raises(SealsError):
        read_vehicle(bent)


MOMENT = {"value": 9.0, "low90": 8.9, "high90": 9.1}
EFFECT = {"name": "payload", "parameters": {"mass": {"value": 0.3}}}
ANSWERS: dict[str, Any] = {
    "effects as mapping": {"effects": {"a": 1}},
    "effect as text": {"effects": ["payload"]},
    "name as number": {"effects": [{"name": 5}]},
    "medium as list": {"effects": [{**EFFECT, "medium": [1]}]},
    "link as list": {"effects": [{**EFFECT, "link": ["base"]}]},
    "variant as list": {"effects": [{**EFFECT, "variant": [1]}]},
    "parameters as list": {"effects": [{"name": "payload", "parameters": [1]}]},
    "parameter as number": {"effects": [{"name": "payload", "parameters": {"mass": 0.3}}]},
    "value as list": {"effects": [{"name": "a", "parameters": {"mass": {"value": [1]}}}]},
    "value left out": {"effects": [{"name": "a", "parameters": {"mass": {}}}]},
    "end as text": {"effects": [{"name": "a", "parameters": {"b": {"value": 1, "low90": "x"}}}]},
    "spans as number": {"effects": [{**EFFECT, "active": 0}]},
    "span as text": {"effects": [{**EFFECT, "active": ["a"]}]},
    "span without log": {"effects": [{**EFFECT, "active": [{"start": None, "end": None}]}]},
    "span without end": {"effects": [{**EFFECT, "active": [{"log": "a", "start": MOMENT}]}]},
    "moment as number": {"effects": [{**EFFECT, "active": [{"log": "a", "start": 1, "end": 2}]}]},
    "endless moment": {
        "effects": [
            {**EFFECT, "active": [{"log": "a", "end": {**MOMENT, "value": 1e999}, "start": None}]}
        ]
    },
    "confidence as text": {"effects": [{**EFFECT, "confidence": "sure"}]},
    "nuisance as list": {"effects": [{**EFFECT, "nuisance": [1.0]}]},
    "nuisance as text": {"effects": [{**EFFECT, "nuisance": {"position_x": "far"}}]},
    "nuisance beyond everything": {"effects": [{**EFFECT, "nuisance": {"position_x": 1e99}}]},
    "hundreds of effects": {"effects": [EFFECT] * 33},
    "log as list": {"log": ["a"]},
    "nominal as list": {"nominal": [1]},
    "nominal of text": {"nominal": {"mass": "a"}},
    "nominal value as text": {"nominal": {"mass": {"value": "a"}}},
    "open question as text": {"ambiguous_with": ["payload"]},
    "formula as text": {"formula": "x"},
    "formula of nothing": {"formula": {"text": "x"}},
    "formula with text": {"formula": {"effect": {"name": "a", "parameters": {"b": "c"}}}},
}


@pytest.mark.parametrize("name", ANSWERS)
def test_an_odd_answer_is_refused(name: str, tmp_path: Path) -> None:
    """``add``, ``verify``, ``train`` and ``plan`` take answers of a diagnosis."""
    content = {"verdict": "named", "effects": [EFFECT], **ANSWERS[name]}
    (tmp_path / "diagnosis.json").write_text(json.dumps(content))
    for read in (read_answer, load_answer):
        with pytest.raises(ConfigError, match="is damaged"):
            read(tmp_path)


@pytest.mark.parametrize("verdict", [["named"], "perhaps", "named", "ambiguous"])
def test_a_verdict_without_an_effect_is_no_answer(verdict: Any, tmp_path: Path) -> None:
    """``add`` would write a model of nothing, and say that it holds an effect."""
    effects = [] if verdict in ("named", "ambiguous") else [EFFECT]
    (tmp_path / "diagnosis.json").write_text(json.dumps({"verdict": verdict, "effects": effects}))
    with pytest.raises(ConfigError, match="is damaged: verdict"):
        read_answer(tmp_path)


def test_a_sound_answer_is_read(tmp_path: Path) -> None:
    """Times of activity, undetermined values and numbers of rotors are sound."""
    spans = [{"log": "a", "start": MOMENT, "end": None}, {"log": "b", "start": None, "end": None}]
    parameters = {"mass": {"value": 0.3, "low90": None}, "rotor": {"value": 2}}
    effect = {"name": "payload", "link": 0, "parameters": parameters, "active": spans}
    content = {
        "verdict": "named",
        "effects": [effect],
        "nominal": {"mass": {"value": 1, "sd": None}},
    }
    (tmp_path / "diagnosis.json").write_text(json.dumps(content))
    (found,) = read_answer(tmp_path).effects
    assert (found.name, found.link) == ("payload", 0)
    assert found.parameters["mass"] == Estimate(value=0.3, low90=None)
    assert found.parameters["rotor"].value == 2
    assert found.active[0] == ActiveSpan(log="a", start=Moment(**MOMENT), end=None)
    assert found.active[1] == ActiveSpan(log="b", start=None, end=None)
    assert load_answer(tmp_path)[1].nominal == {"mass": {"value": 1, "sd": None}}


def test_what_nobody_reads_is_passed_over(tmp_path: Path) -> None:
    """Keys of a later version, and null for what has a default."""
    spans = [{"log": "a", "start": {**MOMENT, "x": 1}, "end": None}]
    for active, wanted in ((None, 0), (spans, 1)):
        content = {"verdict": "named", "effects": [{**EFFECT, "active": active}], "later": {}}
        (tmp_path / "diagnosis.json").write_text(json.dumps(content))
        assert len(read_answer(tmp_path).effects[0].active) == wanted


DRAG = {"effect": "quadratic_drag", "medium": "water"}
MODELS: dict[str, Any] = {
    "links as number": {"changes": {"a": {"effect": "payload", "links": 2.5}}},
    "links as text": {"changes": {"a": {"effect": "payload", "links": "base"}}},
    "links as mapping": {"changes": {"a": {"effect": "payload", "links": {"a": 1}}}},
    "medium as list": {"changes": {"a": {"effect": "payload", "medium": ["air"]}}},
    "medium as mapping": {"changes": {"a": {"effect": "payload", "medium": {}}}},
    "change as text": {"changes": {"a": "payload"}},
    "change of text": {"changes": {"a": {"effect": "payload", "mass": "heavy"}}},
    "speeds as number": {"speeds": 2.5},
    "speeds as text": {"speeds": "fast"},
    "speeds of lists": {"speeds": [[1.0]]},
    "class in an effect": {"effects": {"a": {**DRAG, "_target_": "os.system"}}},
    "arguments in an effect": {"effects": {"a": {**DRAG, "_args_": ["true"]}}},
    "list in an effect": {"effects": {"a": {**DRAG, "coefficient_x": [1, 2]}}},
    "wave of another kind": {"wave": {"wave": "airy", "amplitude": {"a": 1}}},
    "nominal of lists": {"nominal": {"mass": {"value": [1]}}},
    "key of another file": {"file": "/etc/passwd"},
    "name of another file": {"name": "../../a"},
}


@pytest.mark.parametrize("name", MODELS)
def test_an_odd_model_is_refused(name: str, tmp_path: Path) -> None:
    """``run``, ``verify`` and ``train`` take models of a diagnosis."""
    (tmp_path / "a.yaml").write_text(yaml.safe_dump(MODELS[name]))
    with pytest.raises(ConfigError):
        read_overlay(load_overlay(tmp_path / "a.yaml"))


def test_a_model_marks_no_file_but_its_own(tmp_path: Path) -> None:
    """The folder of a configuration may claim that its model lies in a file of yours."""
    own, yours = tmp_path / "own.yaml", tmp_path / "yours.txt"
    own.write_text(yaml.safe_dump({"effects": {"drag": DRAG}}))
    yours.write_text("dear diary\n")
    model = load_overlay(own)
    assert _lies_in(str(own), model)
    for claimed in (yours, tmp_path / "absent.yaml", tmp_path, Path("/dev/zero")):
        assert not _lies_in(str(claimed), {**model, "file": str(claimed)})
    other = tmp_path / "other.yaml"
    other.write_text(yaml.safe_dump({"effects": {"drag": {**DRAG, "coefficient_x": 2.0}}}))
    assert not _lies_in(str(other), {**model, "file": str(other)})


def test_a_table_of_holes_has_no_checksum(tmp_path: Path) -> None:
    """The log that an answer names may lie anywhere, and declare any size."""
    with (tmp_path / "log.csv").open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(LogError, match="the limit is"):
        log_digest(tmp_path)
    assert answer.TABLES[1] == "log.csv"


EDITS: dict[str, str] = {
    "mapping": "effects: {hull: {mass: {a: 1}}}",
    "text": "effects: {hull: {mass: heavy}}",
    "nothing": "effects: {hull: {mass: }}",
    "truth": "effects: {hull: {mass: true}}",
    "list of lists": "effects: {hull: {mass: [[1]]}}",
    "alias": "other: &a 2.0\neffects: {hull: {mass: *a}}",
    "anchor": "effects: {hull: {mass: &a 2.0}}\nother: *a",
    "whole anchor": "other: &h {mass: 2.0}\neffects: {hull: *h}",
}


@pytest.mark.parametrize("name", EDITS)
def test_a_number_that_cannot_be_replaced_is_left_to_the_user(name: str) -> None:
    """A calibration replaces numbers alone, and only where they stand once."""
    with pytest.raises(ConfigError, match="by hand"):
        with_number(EDITS[name] + "\n", ["effects", "hull", "mass"], lambda x: 2.0 * x)


@pytest.mark.parametrize(("old", "new"), [("0x10", "32"), ("1_000", "2000"), ("1e-5", "2e-05")])
def test_every_way_to_write_a_number_is_understood(old: str, new: str) -> None:
    """YAML knows more of them than Python's float."""
    text = with_number(f"a: {{b: {old}}}  # c\n", ["a", "b"], lambda x: 2.0 * x)
    assert text == f"a: {{b: {new}}}  # c\n"


@pytest.mark.parametrize("text", ["effects:\n", "effects: 5\n", "effects: [1]\n"])
def test_no_entry_is_added_to_what_is_no_mapping(text: str) -> None:
    """It would make another file of the robot's."""
    with pytest.raises(ConfigError, match="by hand"):
        with_entry(text, ["effects", "bias"], "1.0")


def test_a_flight_without_rows_is_refused(tmp_path: Path) -> None:
    """A table may hold its head alone."""
    (tmp_path / "a.csv").write_text(",".join(_PUBLIC) + "\n")
    with pytest.raises(LogError, match=r"no rows|as a table"):
        ReaderNanobench(path=str(tmp_path / "a.csv")).read()


@pytest.mark.parametrize("text", ["9" * 251, "-" + "9" * 260, "0x" + "f" * 249, "1" + ":59" * 100])
def test_no_whole_number_is_too_large_for_a_float(text: str) -> None:
    """Whole numbers of YAML have no largest; what computes with them has."""
    with pytest.raises(yaml.YAMLError, match="number of"):
        plain_yaml(f"a: {text}")
    assert float(plain_yaml("a: 0x" + "f" * 248)["a"]) > 1e290
    with pytest.raises(ValueError, match="309 digits"):
        plain_json("[" + "9" * 309 + "]")


def test_a_message_steers_no_terminal() -> None:
    """Messages quote names of strangers, which may hold commands of a terminal."""
    said = two_lines(
        LogError("log '\x1b]0;owned\x07\x1b[2J\r\u202ea' is bad.\nGive\x9b2J another.")
    )
    assert not re.search(r"[^\n -~]", said)
    assert said.count("\n") == 1
