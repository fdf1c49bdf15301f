"""The tutorial of one's own robot is run as it is printed, in an empty folder."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from seals.logs.native import read_native

ROOT = Path(__file__).parents[2]
from tests.docs.follow import follow  # noqa: E402
from tests.docs.pages import blocks  # noqa: E402

PAGE = ROOT / "docs" / "tutorial_own_robot.md"
LONGEST = 600.0
"""Seconds that the whole page may take."""


@pytest.mark.thorough
def test_the_tutorial_runs_as_printed(tmp_path: Path) -> None:
    """Every command ends and prints as promised; the robot hovers, floats and takes off again."""
    page = [block for block in blocks(PAGE.read_text(encoding="utf-8")) if block.when != "never"]
    verbs = [step.command.split()[1] for block in page for step in block.steps]
    assert verbs == ["new", "check", "check", "run", "run", "teleop"]
    start = time.perf_counter()
    follow(PAGE, tmp_path)
    assert time.perf_counter() - start < LONGEST
    assert not list((tmp_path / "my_hexa").rglob("*.py"))
    _hovers(tmp_path / "hover")
    _floats(tmp_path / "drop")
    _lands_and_leaves(tmp_path / "flight")


def _hovers(folder: Path) -> None:
    """Within 2 cm of its place from the third second on, within a millimetre at the end."""
    log = read_native(folder)
    error = np.abs(log.channel("position") - [0.0, 0.0, 1.0])
    assert error[log.time > 3.0].max() < 0.02
    assert error[-1].max() < 0.003
    # the sag of the start is a hand's breadth at most
    assert error[:, 2].max() < 0.15


def _floats(folder: Path) -> None:
    """Upright, and the mean of the last seconds lies at the draught that the check foretold."""
    log = read_native(folder)
    rest = log.channel("position")[log.time > 3.0, 2].mean()
    # the skids reach 0.1 m below the origin
    assert rest == pytest.approx(0.1 - 0.1177, abs=0.003)
    assert log.channel("orientation")[-1, 0] > 0.999


def _lands_and_leaves(folder: Path) -> None:
    """It lies on the water in between, and is up again at the end."""
    log = read_native(folder)
    height = log.channel("position")[:, 2]
    afloat = height[(log.time > 7.5) & (log.time < 9.0)]
    assert np.abs(afloat + 0.018).max() < 0.03
    assert height[-1] > 1.2
