"""Models in the answer of a diagnosis, which ``seals add`` copies."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from seals.cli.main import main
from seals.config.overlay import load_overlay, read_overlay
from seals.errors import ConfigError
from seals.field_roles import Role
from seals.logs.shipped import shipped_logs
from seals.schema import read
from seals.sysid.candidates.catalogue import candidate_set_of
from seals.sysid.data.robot_description import describe_robot
from seals.sysid.data.vehicle import read_vehicle
from seals.sysid.experiment_design.application import _known
from seals.sysid.validation.answer import Answer, log_digest, read_answer
from seals.sysid.validation.writing import overlay_of

WIND = {"effect": "wind", "medium": "air", "velocity_x": 2.5}
LOAD = {"effect": "payload", "mass": 0.1}
MODELS: dict[str, Any] = {
    "wind,payload": {
        "effects": {"wind": WIND, "payload": LOAD},
        "intervals": {"wind": {"velocity_x": [2.0, 3.0]}, "payload": {"mass": [0.05, 0.15]}},
        "nominal": {"mass.mass": {"value": 0.01, "sd": 0.002, "alone": 0.03}},
        "speeds": [0.5, 1.0, 0.2],
        "provenance": {"vehicle": "quad", "log": "another"},
    },
    "wind": {"effects": {"wind": WIND}},
    "payload": {"effects": {"payload": LOAD}},
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def answered(**more: Any) -> None:
    """Write an answer of two effects in a shipped log."""
    log = shipped_logs()["hidden_effect/flight_a"]
    content = {
        "verdict": "named",
        "effects": [{"name": "wind", "confidence": 0.9}, {"name": "payload", "confidence": 0.8}],
        "log": {"path": str(log), "sha256": log_digest(log)},
        "models": MODELS,
        **more,
    }
    Path("diagnosis.json").write_text(json.dumps(content), encoding="utf-8")


def test_a_model_is_the_one_of_the_answer(folder: Path) -> None:
    """Its entries are copied; where they come from is the file's to say, not the answer's."""
    answered()
    assert main(["add", "diagnosis=diagnosis.json", "name=both"]) == 0
    written = yaml.safe_load(Path("models/both.yaml").read_text(encoding="utf-8"))
    own = {k: v for k, v in MODELS["wind,payload"].items() if k != "provenance"}
    assert {k: written[k] for k in own} == own
    assert written["provenance"]["vehicle"] == "quad"
    assert written["provenance"]["log"] == str(shipped_logs()["hidden_effect/flight_a"])
    assert written["provenance"]["confidence"] == {"wind": 0.9, "payload": 0.8}
    assert read_overlay(load_overlay(Path("models/both.yaml"))).effects["wind"].velocity_x == 2.5


def test_one_of_several_effects_is_chosen(folder: Path) -> None:
    """A claim or a rival alone has a model of its own."""
    answered()
    assert main(["add", "diagnosis=diagnosis.json", "name=load", "choose=payload"]) == 0
    assert set(load_overlay(Path("models/load.yaml"))["effects"]) == {"payload"}


def test_entries_beside_those_of_another_model_keep_both(folder: Path) -> None:
    """A name that is taken is changed in both places; the same effect twice is refused."""
    answered()
    base = {"effects": {"wind": {"effect": "payload", "links": ["arm"], "mass": 0.2}}}
    content = overlay_of(read_answer(folder, choose="wind"), base, source={})
    assert content["effects"] == {**base["effects"], "wind_2": WIND}
    assert "intervals" not in content
    content = overlay_of(read_answer(folder), base, source={})
    assert set(content["intervals"]) == {"wind_2", "payload"}
    twice = {"name": "old", "effects": {"gust": {"effect": "wind", "medium": "air"}}}
    with pytest.raises(ConfigError, match="adds wind already"):
        overlay_of(read_answer(folder), twice, source={})


@pytest.mark.parametrize("more", [{"models": None}, {"models": {}}, {"healthy": {}, "models": {}}])
def test_an_answer_without_models_says_what_to_do(
    folder: Path, more: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    """That of an earlier version, or of a comparison with healthy flights."""
    answered(**more)
    assert main(["add", "diagnosis=diagnosis.json", "name=both"]) == 2
    told = capsys.readouterr().err
    assert "contains no model of wind,payload: an earlier version wrote it" in told
    assert "seals diagnose log=FOLDER" in told
    assert not Path("models").exists()


ODD: dict[str, tuple[Any, str]] = {
    "list": ([WIND], "models=[{"),
    "model of text": ({"wind,payload": "wind"}, "models.wind,payload=wind is"),
    "entry of text": ({"wind,payload": {"effects": {"wind": "wind"}}}, "effects.wind=wind is"),
    "wave of text": ({"wind,payload": {"wave": "airy"}}, "wave=airy is"),
    "interval of text": ({"wind,payload": {"intervals": {"a": {"b": ["c"]}}}}, "finite number"),
    "many entries": (
        {"wind,payload": {"effects": {f"a{k}": LOAD for k in range(1025)}}},
        "1,025 entries",
    ),
    "class": (
        {"wind,payload": {"effects": {"a": {**WIND, "_target_": "os.system"}}}},
        "'_target_' is not a parameter",
    ),
    "reference": ({"wind,payload": {"effects": {"a": {"effect": "${oc.env:HOME}"}}}}, "reference"),
    "unknown parameter": ({"wind,payload": {"effects": {"a": {**WIND, "x": 1.0}}}}, "'x' is not"),
    "value of text": ({"wind,payload": {"effects": {"a": {**WIND, "velocity_x": "x"}}}}, "'x'"),
    "nominal of text": ({"wind,payload": {"nominal": {"mass.mass": {"value": "a"}}}}, "finite"),
}


@pytest.mark.parametrize("how", ODD)
def test_an_odd_model_is_not_written(
    folder: Path, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """What a stranger's answer offers is checked as a stranger's model is."""
    models, words = ODD[how]
    answered(models=models)
    assert main(["add", "diagnosis=diagnosis.json", "name=both"]) == 2
    told = capsys.readouterr().err
    assert words in told
    assert "Traceback" not in told
    assert not Path("models").exists()


def test_an_answer_sets_no_path(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A model under ``models/`` counts as one's own, so an answer may hold data only."""
    answered()
    paths = {"velocity_x": Role.read}
    monkeypatch.setattr("seals.sysid.validation.application.roles_of", lambda kind: paths)
    assert main(["add", "diagnosis=diagnosis.json", "name=both", "choose=wind"]) == 2
    assert "the diagnosis sets velocity_x of Wind, which is not data" in capsys.readouterr().err
    assert not Path("models").exists()


def test_an_effect_that_is_none_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its name would stand in the comment at the head of the file, line breaks included."""
    answered(effects=[{"name": "wind\nwithdrawn: no"}], models={"wind\nwithdrawn: no": {}})
    assert main(["add", "diagnosis=diagnosis.json", "name=both"]) == 2
    assert "is not a candidate for this vehicle" in capsys.readouterr().err


def test_what_was_left_out_stays_out(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The models are those beside the stated model of the diagnosis, and of no other."""
    answered(without=["linear_drag"])
    assert main(["add", "diagnosis=diagnosis.json", "name=both", "without=[wind]"]) == 2
    assert "the diagnosis left out ['linear_drag']" in capsys.readouterr().err
    assert main(["add", "diagnosis=diagnosis.json", "name=both"]) == 0
    content = load_overlay(Path("models/both.yaml"))
    assert content["provenance"]["without"] == ["linear_drag"]


@pytest.mark.parametrize("damaged", [3, {"position_x": "far"}, {"position_x": None}])
def test_damaged_numbers_are_refused(damaged: Any) -> None:
    """Nuisance parameters as those of the effect itself are."""
    effect = {"name": "payload", "parameters": {"mass": {"value": 0.31}}, "nuisance": damaged}
    with pytest.raises(ConfigError, match=r"effects\[0\]\.nuisance"):
        read(Answer, {"verdict": "named", "effects": [effect]}, where="")


@pytest.mark.parametrize("value", [0.4, "much"])
def test_a_size_in_words_is_none(value: Any) -> None:
    """``plan`` supposes a size of its own where an answer tells none."""
    meta = {"environment": {"gravity": [0.0, 0.0, -9.81], "water_level": None}}
    vehicle = read_vehicle(meta, describe_robot("hexacopter"))
    candidates = candidate_set_of(vehicle, speeds=np.ones(3))
    told = {"relative_loss": {"value": value}, "rotor": {"value": 2.0}}
    effect = {"name": "weak_rotor", "parameters": told}
    found = _known(candidates, read(Answer, {"effects": [effect]}, where=""), ["weak_rotor"])
    assert found == ({"weak_rotor": {"weak_rotor_2.relative_loss": 0.4}} if value == 0.4 else {})
