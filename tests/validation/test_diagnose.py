"""Diagnoses of logs from the independent generator: one small case of each kind of answer."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from seals.logs.native import read_native
from seals.sysid.diagnosis import Diagnosis, diagnose
from seals.sysid.report.sentence import sentence
from seals.sysid.validation.writing import models_of
from tests.validation.hidden import generate


def answered(folder: Path, *words: str) -> tuple[Diagnosis, dict[str, dict[str, float]]]:
    """Make one log and diagnose it; return the answer and the true parameters by effect."""
    assert generate.main([str(folder), "--count", "1", *words]) in (None, 0)
    case = next(p for p in sorted(folder.iterdir()) if p.is_dir())
    return diagnose(read_native(case)), truth_of(case)


def truth_of(case: Path) -> dict[str, dict[str, float]]:
    """True parameters of a log, by effect."""
    truth = yaml.safe_load((case / "truth.yaml").read_text(encoding="utf-8"))
    return {
        e["name"]: {k: v["value"] for k, v in e["parameters"].items()} for e in truth["effects"]
    }


def test_nothing_is_missing_in_a_sound_model(tmp_path: Path) -> None:
    """A quadrotor within its tolerances gets no name, and its misfit is at the floor."""
    found, _ = answered(tmp_path, "--level", "null", "--vehicle", "quad", "--seed", "5")
    assert found.answer.verdict.value == "nothing_missing"
    assert found.held_out["before"] == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_an_onset_is_named_with_its_time(tmp_path: Path) -> None:
    """Wind that does not blow all the time is found with its times, and added at its strength."""
    words = ("--level", "onset", "--vehicle", "quad", "--effect", "wind", "--seed", "5")
    found, truth = answered(tmp_path / "logs", *words, "--no-gain")
    case = next((tmp_path / "logs").iterdir())
    told = yaml.safe_load((case / "truth.yaml").read_text(encoding="utf-8"))["effects"][0]["active"]
    answer = found.to_dict()
    (effect,) = answer["effects"]
    (entry,) = effect["active"]
    assert (answer["verdict"], effect["name"], entry["log"]) == ("named", "wind", "log")
    for moment, true in zip((entry["start"], entry["end"]), told, strict=True):
        assert (moment is None) == (true is None)
        if true is not None:
            assert moment["value"] == pytest.approx(true, abs=0.05)
    size = max(abs(v) for v in truth["wind"].values())
    for name, value in truth["wind"].items():
        assert effect["parameters"][name]["value"] == pytest.approx(value, abs=0.1 * size)
    moments = [m for m in (entry["start"], entry["end"]) if m is not None]
    assert all(f"{m['value']:.2f} s" in sentence(found) for m in moments)
    added = models_of(found)["wind"]["effects"]["wind"]
    for name, value in truth["wind"].items():
        assert added[name] == pytest.approx(value, abs=0.1 * size)


@pytest.mark.thorough
def test_a_sensor_fault_is_not_taken_for_a_force(tmp_path: Path) -> None:
    """A turned inertial sensor is named as such."""
    words = ("--level", "clear", "--vehicle", "quad", "--effect", "sensor_misalignment")
    found, _ = answered(tmp_path, *words, "--seed", "3")
    assert [c.name for c in found.answer.claims] == ["sensor_misalignment"]


@pytest.mark.parametrize(
    ("level", "seed", "verdict"),
    [
        pytest.param("poor_excitation", 2, "cannot_tell", marks=pytest.mark.thorough),
        ("out_of_library", 4, "none_of_these"),
    ],
)
def test_what_a_log_cannot_tell_gets_no_name(
    level: str, seed: int, verdict: str, tmp_path: Path
) -> None:
    """A hover shows no drag, no effect describes a force outside the library: no clean bill."""
    found, _ = answered(tmp_path, "--level", level, "--vehicle", "quad", "--seed", str(seed))
    assert found.answer.verdict.value == verdict


@pytest.mark.slow
def test_a_magnet_is_not_taken_for_a_cable(tmp_path: Path) -> None:
    """A cable's law bends to a force that fades with the distance; a general law fits better."""
    words = ("--level", "out_of_library", "--vehicle", "drop", "--seed", "7103")
    found, _ = answered(tmp_path, *words)
    assert found.answer.verdict.value == "none_of_these"
    assert "central force" in found.answer.reasons[0]
