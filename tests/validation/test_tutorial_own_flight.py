"""The tutorial of a flight log is run as it is printed; what it names is what was hidden."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
from tests.docs.follow import follow  # noqa: E402
from tests.docs.pages import steps  # noqa: E402

PAGE = ROOT / "docs" / "tutorial_own_flight.md"
TRUTH = Path(__file__).parent / "own_flight_truth.yaml"


def test_file_to_name_takes_fewer_than_ten_commands() -> None:
    """The page holds no more commands than it promises."""
    assert len(steps(PAGE.read_text(encoding="utf-8"))) < 10


@pytest.mark.slow
def test_the_tutorial_runs_as_printed_and_names_what_was_hidden(tmp_path: Path) -> None:
    """From ULog to answer in an empty folder: rotor and size are those of the simulation."""
    follow(PAGE, tmp_path)
    (effect,) = json.loads((tmp_path / "answer" / "diagnosis.json").read_text())["effects"]
    (hidden,) = yaml.safe_load(TRUTH.read_text(encoding="utf-8"))["effects"]
    assert effect["name"] == hidden["name"]
    assert effect["parameters"]["rotor"]["value"] == hidden["parameters"]["rotor"]["value"]
    loss = effect["parameters"]["relative_loss"]
    assert loss["low90"] < hidden["parameters"]["relative_loss"]["value"] < loss["high90"]
