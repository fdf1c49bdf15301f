"""The tutorial of one's own animal is run as it is printed, in an empty folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.logs.native import read_native

ROOT = Path(__file__).parents[2]
from tests.docs.follow import follow  # noqa: E402
from tests.docs.pages import steps  # noqa: E402

PAGE = ROOT / "docs" / "tutorial_own_animal.md"


@pytest.mark.thorough
def test_the_tutorial_runs_as_printed(tmp_path: Path) -> None:
    """Every command prints as promised; the beetle walks, finds its target, and runs away."""
    page = steps(PAGE.read_text(encoding="utf-8"))
    assert [s.command.split()[1] for s in page] == ["new", "check", "run", "run", "run"]
    follow(PAGE, tmp_path)
    assert not list((tmp_path / "my_beetle").rglob("*.py"))
    walk = read_native(tmp_path / "walk")
    place = walk.channel("position")
    late = walk.time > 2.0
    speed = (place[-1, 0] - place[late][0, 0]) / (walk.time[-1] - walk.time[late][0])
    assert 0.17 < speed < 0.23
    found = read_native(tmp_path / "seek")
    assert np.hypot(*(found.channel("position")[-1, :2] - [0.4, 0.3])) < 0.03
    assert found.time[-1] < 7.0
    fled = read_native(tmp_path / "flee")
    assert 0.7 < fled.columns["object_beetle_position_x"][-1] < 1.0
