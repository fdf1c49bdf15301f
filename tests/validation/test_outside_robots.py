"""Robots of other projects drive along a course by a shipped controller, without code."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from outside_robots import COURSES, VEHICLES, driven

CHEAP = ("quadrotor", "tricopter")
NAMES = [name if name in CHEAP else pytest.param(name, marks=pytest.mark.slow) for name in COURSES]


@pytest.mark.parametrize("name", NAMES)
def test_a_robot_of_another_project_keeps_its_course(name: str, tmp_path: Path) -> None:
    """Taken over, without a failed check, within the bound of its course."""
    if not (VEHICLES / COURSES[name].file).is_file():
        pytest.skip("pybullet_data is not installed")
    if COURSES[name].dialect == "xacro":
        pytest.importorskip("xacro", reason="xacro is not installed")
    found = driven(name, tmp_path)
    print(f"{name}: {found.error:.4f} m, lean {np.degrees(found.lean):.1f} deg")
    assert found.failures == []
    assert found.error < COURSES[name].bound
