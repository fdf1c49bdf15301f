"""The inertial unit of a body that turns: forces fixed to it are read where they are."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from seals.backend import Backend
from seals.plugins.actuators.thrusters import Thrusters
from seals.plugins.backends.free import BackendFree
from seals.plugins.backends.pybullet import BackendPybullet
from seals.plugins.sensors.imu import SensorImu
from seals.run import build_world

SPIN = 5.0
PUSH = 9.81


def read(bench: Any, backend: Backend, step: float) -> np.ndarray:
    """Last specific force of a sphere of 1 kg that turns about x and is pushed along its own z."""
    quiet = {"noise": 0.0, "walk": 0.0, "step": 0.0}
    errors = {f"{side}_{k}": v for side in ("accelerometer", "gyroscope") for k, v in quiet.items()}
    settings = bench.settings(
        bench.body(1.0, [0.01, 0.01, 0.01]),
        {"push": Thrusters(position=[[0.0, 0.0, 0.0]], time_constant=[0.0])},
        step=step,
        duration=0.04,
        sensors={"imu": SensorImu(rate=1.0 / step, **errors)},
        position=[0.0, 0.0, 100.0],
        angular_velocity=[SPIN, 0.0, 0.0],
    )
    world = build_world(dataclasses.replace(settings, backend=backend))
    try:
        actor = world.actors["robot"]
        for _ in range(round(0.04 / step)):
            actor.command = np.array([[PUSH]])
            world.step()
        force: np.ndarray = actor.readings["imu"]["specific_force"]
        return force
    finally:
        world.close()


@pytest.mark.parametrize("backend", [BackendPybullet(), BackendFree(passable=True)])
def test_a_force_fixed_to_a_turning_body_is_read_along_its_axis(
    bench: Any, backend: Backend
) -> None:
    """(0, 0, 9.81) to second order in the step, though the body turns 1.1 degrees in each.

    Read in the axes of the step's end it would lean by half of that, 0.1 m/s^2. The mean over a
    step that is found from two forces is off by 5/12 of their second difference, (w h)^2 here.
    """
    far, near = read(bench, backend, 0.004), read(bench, backend, 0.002)
    off = np.linalg.norm(far - [0.0, 0.0, PUSH])
    assert off < 0.5 * PUSH * (SPIN * 0.004) ** 2
    # a quarter of it with half the step
    assert np.linalg.norm(near - [0.0, 0.0, PUSH]) == pytest.approx(off / 4.0, rel=0.05)
