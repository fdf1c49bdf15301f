"""Twins in single precision, on a processor and on an accelerator, go where double precision does.

Rotor speeds stay as they are, so that nothing but the laws is compared: a controller would answer
a difference with a command.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.arrays import as_like
from seals.batch import BatchDynamics
from seals.batch.holding import hold
from seals.config.compose import compose
from seals.control.plant import build_plant
from seals.frames import quaternion_of_rpy
from seals.learn.environments.build import build_learning
from seals.motion import Inputs
from seals.run.assembly import build_model
from seals.run.hover_trim import carrying_speeds

torch = pytest.importorskip("torch", reason="twins in single precision need torch")

COUNT = 16
STEP = 0.02
STEPS = 25
"""Half a second; `benchmarks/parity.py` flies a thousand for a whole one."""
ROUNDING = 1.2e-7
"""Between neighbours among numbers of single precision."""
DEVICES = [
    "cpu",
    pytest.param(
        "cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
    ),
]


def flown(height: float, thrust: float, like: Any) -> dict[str, np.ndarray]:
    """Return the states of manipulators half a second after they were thrown, turning."""
    settings, task = build_learning(
        compose(["env=reach", "backend=twin", "environment.tank_bottom=-50"], root="learn")
    )
    robot, effects = build_model(settings)
    plant = build_plant(robot, effects, settings.environment)
    speeds = np.atleast_2d(carrying_speeds(plant, task.posture))
    whole, held = hold(robot, effects, task.posture.tolist())
    twin = BatchDynamics(whole, held, settings.environment, settings.wave, batch=COUNT, like=like)
    rng = np.random.default_rng(0)
    state = twin.start(
        position=rng.uniform(-0.5, 0.5, (COUNT, 3)) + np.array([0.0, 0.0, height]),
        quaternion=quaternion_of_rpy(rng.uniform(-0.5, 0.5, (COUNT, 3))),
        velocity=rng.uniform(-1.0, 1.0, (COUNT, 3)),
        angular_velocity=rng.uniform(-2.0, 2.0, (COUNT, 3)),
    )
    drive = thrust * rng.uniform(0.8, 1.1, (COUNT, speeds.shape[1])) * speeds
    inputs = Inputs(STEP, twin.no_torque(), as_like(drive, like))
    time = as_like(np.zeros((COUNT, 1)), like)
    for _ in range(STEPS):
        state, _ = twin.advance(state, time, STEP, (inputs, inputs, inputs))
        time = time + STEP
    names = ("position", "quaternion", "velocity", "angular_velocity")
    parts = {name: torch.as_tensor(getattr(state, name)).cpu() for name in names}
    return {name: np.asarray(x, dtype=float) for name, x in parts.items()}


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize(("height", "thrust"), [(10.0, 1.0), (-10.0, 0.035)])
def test_single_precision_follows_double(height: float, thrust: float, device: str) -> None:
    """In one medium every part of the state agrees to 5e-5 of its size.

    Four roundings in each of the four evaluations of a step, all to the same side, come to that.
    """
    exact = flown(height, thrust, np.zeros(1))
    other = flown(height, thrust, torch.zeros(1, dtype=torch.float32, device=device))
    for name, rows in exact.items():
        size = np.linalg.norm(rows, axis=1)
        gap = np.linalg.norm(rows - other[name], axis=1) / size
        assert gap.max() < 4 * 4 * STEPS * ROUNDING
        # it did compute in single precision
        assert gap.max() > 0.1 * ROUNDING
    # thrown and turning, not at rest
    assert np.abs(exact["velocity"]).mean() > 0.02
