"""Diagnoses of falls into water from the independent generator, with and without pose."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from seals.logs.native import read_native
from seals.sysid.diagnosis import Diagnosis, diagnose
from tests.validation.hidden import generate

pytestmark = pytest.mark.slow


def answered(folder: Path, *words: str) -> tuple[Diagnosis, list[str]]:
    """Make one log and diagnose it; return the answer and the names of the true effects."""
    assert generate.main([str(folder), "--count", "1", *words]) in (None, 0)
    case = next(p for p in sorted(folder.iterdir()) if p.is_dir())
    truth = yaml.safe_load((case / "truth.yaml").read_text(encoding="utf-8"))
    return diagnose(read_native(case), processes=2), [e["name"] for e in truth["effects"]]


@pytest.mark.parametrize("effect", ["slamming", "added_mass"])
def test_an_accelerometer_alone_names_what_the_impact_shows(tmp_path: Path, effect: str) -> None:
    """Two effects that both brake an entry are held apart by whole runs without pose."""
    words = ("--level", "clear", "--vehicle", "drop_imu_only", "--effect", effect, "--seed", "6")
    found, true = answered(tmp_path, *words)
    answer = found.to_dict()
    assert {e["name"] for e in answer["effects"]} >= set(true)
    assert answer["effects"][0]["name"] == effect


def test_a_sound_drop_without_pose_gets_no_name(tmp_path: Path) -> None:
    """Drops within their tolerances lack nothing."""
    words = ("--level", "null", "--vehicle", "drop_imu_only", "--seed", "6")
    found, _ = answered(tmp_path, *words)
    assert found.answer.verdict.value == "nothing_missing"


def test_late_sensors_are_named_in_a_drop_with_pose(tmp_path: Path) -> None:
    """A delay longer than a row is named although the impact is shorter than a row."""
    words = ("--level", "clear", "--vehicle", "drop", "--effect", "sensor_delay", "--seed", "6")
    found, _ = answered(tmp_path, *words)
    assert [c.name for c in found.answer.claims] == ["sensor_delay"]
    fitted = found.to_dict()["effects"][0]["parameters"]["delay"]
    assert fitted["low90"] > 0.01


@pytest.mark.parametrize(("seed", "effect"), [(12702, "current"), (12709, "inertia")])
def test_what_a_fall_shows_is_not_lost_on_the_way(tmp_path: Path, seed: int, effect: str) -> None:
    """A current that the stated model's trajectory hides; a check along the simulated fall."""
    words = ("--level", "clear", "--vehicle", "drop", "--seed", str(seed))
    found, true = answered(tmp_path, *words)
    answer = found.to_dict()
    assert true == [effect]
    assert [e["name"] for e in answer["effects"]] == true
