"""The benchmark over the robots that ship: its cases, its words, and one case as a whole."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from benchmarks.shipped import case, scored
from benchmarks.shipped_runs import LENGTH, MASS, SCENES, hidden, truth
from seals.registry import plugins

BOX = next(scene for scene in SCENES if scene.name == "box_water")


def _answer(*names: str, verdict: str = "named", **values: float) -> dict[str, Any]:
    parameters = {k: {"value": v} for k, v in values.items()}
    return {"verdict": verdict, "effects": [{"name": n, "parameters": parameters} for n in names]}


def test_every_robot_and_animal_has_its_runs() -> None:
    """What ships is in the table, with five effects to hide where it moves freely."""
    shipped = {*plugins("robot"), *plugins("animal")}
    assert shipped == {scene.robot for scene in SCENES} == set(MASS) == set(LENGTH)


def test_an_effect_that_the_robot_states_is_taken_out_of_its_log() -> None:
    """Others are added, with values, and hidden by their instance."""
    assert hidden(BOX, "quadratic_drag") == ["hide=[water_drag]"]
    words = hidden(BOX, "current")
    assert words[:2] == ["+effect@effects.hidden=current", "hide=[hidden]"]
    assert "effects.hidden.velocity_x=0.25" in words


def test_words_and_errors_of_answers() -> None:
    """A further name is wrong; the error is that of the vector of parameters."""
    true = truth(BOX, "current")
    near = scored(BOX, "current", _answer("current", **{k: 1.1 * v for k, v in true.items()}))
    assert near["word"] == "right"
    assert near["off"] == pytest.approx(0.1)
    assert scored(BOX, "current", _answer("current", "added_mass", **true))["word"] == "wrong"
    assert scored(BOX, "none", _answer(verdict="nothing_missing"))["word"] == "right"
    assert scored(BOX, "none", _answer("current"))["word"] == "wrong"


@pytest.mark.slow
# size and place of a payload multiply: a screen that is linear about zero does not see them
@pytest.mark.parametrize("effect", ["current", "payload"])
def test_an_effect_on_a_floating_box_is_found_and_verified(effect: str, tmp_path: Path) -> None:
    """Simulated, diagnosed, added, and verified on another run."""
    row = case(BOX, effect, tmp_path / "case", seconds=5.0)
    assert row["word"] == "right", row
    assert row["off"] < 0.1
    assert row["verified"], row
