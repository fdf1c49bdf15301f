"""A hexacopter dives to a waypoint and takes off again, in both engines."""

from __future__ import annotations

import numpy as np
import pytest

from seals.config.compose import compose
from seals.run.build import build_run
from seals.run.goals import goal_results
from seals.run.simulation import simulate

WORDS = (
    "robot=hexacopter",
    "water=fossen",
    "controller=cascade",
    "controller.tilt=[0.4,0.3]",
    "guide=waypoints",
    "guide.places=[[0,0,-0.8],[0,0,0.8]]",
    "guide.speed=0.5",
    "guide.delay=0.5",
    "guide.rest=5",
    "initial.position=[0,0,0.6]",
    "time.step=0.008",
    "time.duration=17",
)


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_a_hexacopter_dives_and_takes_off_again(engine: str) -> None:
    """At -0.8 m within 5 cm, attitude below 25 degrees throughout, out of the water at the end."""
    record = simulate(build_run(compose([*WORDS, f"backend={engine}"])))
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
    assert np.linalg.norm(place[rest] - [0.0, 0.0, -0.8], axis=1).max() < 0.05
    assert lean.max() < 25.0
