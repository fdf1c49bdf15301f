"""Robots of other projects drive along a course by a shipped controller, without code."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.validation import published_robots
from tests.validation.outside_robots import COURSES, VEHICLES, Course, driven

CHEAP = ("quadrotor", "tricopter", "published round_buoy")
ALL = {**COURSES, **{f"published {k}": c for k, c in published_robots.COURSES.items()}}
NAMES = [name if name in CHEAP else pytest.param(name, marks=pytest.mark.slow) for name in ALL]


@pytest.mark.parametrize("name", NAMES)
def test_a_robot_of_another_project_keeps_its_course(name: str, tmp_path: Path) -> None:
    """Taken over, without a failed check, within the bound of its course."""
    course: Course = ALL[name]
    if not (VEHICLES / course.file).is_file():
        pytest.skip(f"the package with {Path(course.file).name} is not installed")
    if course.dialect == "xacro":
        pytest.importorskip("xacro", reason="xacro is not installed")
    found = driven(name.rsplit(maxsplit=1)[-1], course, tmp_path)
    print(f"{name}: {found.error:.4f} m, lean {np.degrees(found.lean):.1f} deg")
    assert found.failures == []
    assert found.error < course.bound
