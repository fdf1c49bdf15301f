"""The inertial unit of a body that turns: forces fixed to it are read where they are."""

from __future__ import annotations

import contextlib
import dataclasses
from typing import Any

import numpy as np
import pytest

from seals.api import make
from seals.backend import Backend
from seals.frames import matrix_of, quaternion_of_rpy
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
    with contextlib.closing(build_world(dataclasses.replace(settings, backend=backend))) as world:
        actor = world.actors["robot"]
        for _ in range(round(0.04 / step)):
            actor.command = np.array([[PUSH]])
            world.step()
        return actor.readings["imu"]["specific_force"]


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


ARM, RPY = [0.2, -0.1, 0.05], [0.3, -0.2, 0.5]


def off_the_arm(engine: str, compiled: str, step: float) -> tuple[float, float]:
    """Largest error of a turned accelerometer on an arm of a tumbling body, and largest reading.

    Against the second difference of the places of the mounting point, in the axes at its middle.
    """
    axes = matrix_of(quaternion_of_rpy(np.array([RPY])))[0]
    words = ["robot=torpedo", "water=none", "initial.position=[0,0,20]", f"time.step={step}"]
    words += ["initial.velocity=[1,0.5,-1]", "initial.angular_velocity=[8,-5,3]"]
    words += ["+sensor@sensors.imu=imu", f"sensors.imu.rate={1.0 / step}", f"backend={engine}"]
    words += [f"sensors.imu.position={ARM}", f"sensors.imu.rpy={RPY}"]
    sides = ("accelerometer", "gyroscope")
    words += [f"sensors.imu.{s}_{k}=0" for s in sides for k in ("noise", "walk", "step")]
    words += [f"backend.compiled={compiled}"] if engine != "free" else []
    with contextlib.closing(make(words)) as world:
        actor, places, turns, read = world.actors["robot"], [], [], []
        for k in range(round(0.4 / step) + 1):
            now = actor.body.read()
            turns.append(matrix_of(now.quaternion[None])[0])
            places.append(now.position + turns[-1] @ ARM)
            if k:
                reading: Any = actor.readings["imu"]
                read.append(reading["specific_force"])
            world.step()
        gravity = [0.0, 0.0, world.environment.gravity]
    expected = np.diff(places, 2, axis=0) / step**2 + gravity
    expected = np.einsum("kij,ki->kj", np.array(turns[1:-1]) @ axes, expected)
    return float(np.abs(np.array(read)[1:] - expected).max()), float(np.abs(expected).max())


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("engine", "compiled"),
    [("free", "false")] + [(e, c) for e in ("pybullet", "mujoco") for c in ("false", "true")],
)
def test_a_turned_unit_on_an_arm_reads_how_its_own_place_moves(engine: str, compiled: str) -> None:
    """To second order in the step, through the angular acceleration of a body that tumbles.

    With the centripetal part of the step's end beside the rest of its start, 0.38 m/s^2 were off.
    """
    if engine != "free":
        pytest.importorskip(engine)
    if compiled == "true":
        pytest.importorskip("llvmlite")
    (far, most), (near, _) = (off_the_arm(engine, compiled, h) for h in (0.004, 0.002))
    print(f"{engine}, compiled {compiled}: {far:.2e}, {near:.2e} of {most:.1f} m/s^2")
    # (w h)^2 / 12 of the largest part, w = 10 rad/s
    assert most > 10.0
    assert far < (10.0 * 0.004) ** 2 * most
    assert near < far / 3.5
