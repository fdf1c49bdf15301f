"""A hexacopter dives to a waypoint and takes off again, in both engines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.run.build import run_settings
from seals.run.goals import goal_results
from seals.run.simulation import simulate
from seals.scaffold.robot import scaffold_robot
from seals.scaffold.takeover import shipped_urdfs

WORDS = (
    "water=fossen",
    "guide=waypoints",
    "guide.speed=0.5",
    "guide.delay=0.5",
    "guide.rest=5",
    "initial.position=[0,0,0.6]",
    "time.step=0.008",
    "time.duration=17",
)


STRAIGHT = "guide.places=[[0,0,-0.8],[0,0,0.8]]"
ASKEW = "guide.places=[[0.6,0.4,-0.8],[0,0,0.8]]"


def dived(*words: str, lowest: tuple[float, float, float]) -> None:
    """Assert that a dive reaches its place, stays upright and ends in the air."""
    record = simulate(run_settings([*WORDS, *words]))
    assert record.error is None
    log = record.log
    _, x, y, _ = log.channel("orientation").T
    lean = np.degrees(np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0)))
    under, out = goal_results(record)
    assert under.reached, str(under)
    assert out.reached, str(out)
    # at rest under water, not in passing
    place = log.channel("position")
    rest = (log.time > 9.0) & (log.time < 10.0)
    off = np.linalg.norm(place[rest] - lowest, axis=1).max()
    print(f"{words}: {off * 1e3:.1f} mm off at rest under water, lean {lean.max():.1f} deg")
    assert off < 0.05
    assert lean.max() < 25.0


@pytest.mark.thorough
@pytest.mark.parametrize("engine", [pytest.param("pybullet", marks=pytest.mark.slow), "mujoco"])
def test_a_hexacopter_dives_and_takes_off_again(engine: str) -> None:
    """At -0.8 m within 5 cm, attitude below 25 degrees throughout, out of the water at the end."""
    dived("robot=hexacopter", STRAIGHT, f"backend={engine}", lowest=(0.0, 0.0, -0.8))


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_an_own_hexacopter_dives_after_it_was_imported(engine: str, tmp_path: Path) -> None:
    """Taken over with `medium=both` it needs no further number, also for a place beside it."""
    file = shipped_urdfs()["own_robot/hexa"]
    robot = scaffold_robot("mine", file, parent=tmp_path, medium="both").folder
    words = (f"robot={robot}", "controller=cascade", f"backend={engine}")
    dived(*words, ASKEW, lowest=(0.6, 0.4, -0.8))
