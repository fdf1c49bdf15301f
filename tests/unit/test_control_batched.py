"""The cascade over a batch gives the commands of the cascade for one robot."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.config.compose import compose
from seals.control import Buoyancy, Reference, RobotState
from seals.control.allocation import Saturation
from seals.control.batched import BatchAllocation, View
from seals.control.limbs import stowed
from seals.control.mass_properties import MassPropertyEstimator
from seals.control.plant import build_plant
from seals.errors import ConfigError
from seals.frames import matrix_of, quaternion_of_rpy
from seals.run.assembly import build_model
from seals.run.build import build_run


@pytest.fixture(scope="module", params=["aam", "hexacopter"])
def parts(request: pytest.FixtureRequest) -> Any:
    """Settings, plant and joints of a robot with rotors."""
    words = [f"robot={request.param}", "water=fossen", "controller=cascade", "guide=hover"]
    settings = build_run(compose(words))
    robot, effects = build_model(settings)
    joints = stowed(robot)
    return settings.controller, build_plant(robot, effects, settings.environment), joints


def _situation(plant: Any, joints: Any, rng: np.random.Generator, wet: float) -> RobotState:
    rpy = rng.normal(size=(1, 3)) * [0.3, 0.3, 0.5]
    at, n = MassPropertyEstimator(plant.robot).at(joints), plant.layout.drives
    gain = np.full(n, 1.0 + wet * 500.0)
    return RobotState(
        time=0.0,
        step=0.008,
        position=np.zeros(3),
        rotation=matrix_of(quaternion_of_rpy(rpy))[0],
        velocity=rng.normal(size=3),
        angular_velocity=rng.normal(size=3) * 0.5,
        joints=joints,
        joint_velocity=np.zeros_like(joints),
        mass=at.mass,
        centre=at.centre,
        inertia=at.inertia,
        centre_map=at.centre_map,
        momentum_map=at.momentum_map,
        submersion=wet,
        buoyancy=Buoyancy(wet * 0.9 * at.mass * 9.81, rng.normal(size=3) * 0.02),
        depth=0.0,
        gain=gain,
        limit=plant.layout.limit / np.sqrt(gain),
        low=-0.5 * wet * plant.layout.limit / np.sqrt(gain),
    )


@pytest.mark.parametrize("hurry", [0.3, 6.0])
@pytest.mark.parametrize("saturation", ["priority", "paper"])
def test_commands_agree(parts: Any, hurry: float, saturation: str) -> None:
    """Twenty calls in a row agree to 1e-3 of 940 rad/s, within the rotors' limits and at them.

    Speeds are roots: a square that is off by rounding moves a rotor near rest by that much.
    """
    controller, plant, joints = parts
    controller.saturation = type(controller.saturation)(saturation)
    controller.bind(plant)
    batch = controller.batched(plant, joints, np.zeros(1))
    rng = np.random.default_rng(3)
    count, calls = 8, 20
    own, shared = [controller.start() for _ in range(count)], batch.start(count)
    limited = 0
    for _ in range(calls):
        seen = [_situation(plant, joints, rng, wet) for wet in np.linspace(0.0, 1.0, count)]
        wanted = hurry * rng.normal(size=(count, 3))
        single = []
        for k, s in enumerate(seen):
            order, own[k] = controller.command(s, _aim(plant, joints, wanted[k]), own[k])
            single.append(order.drive)
            limited += int(np.any(order.drive >= 0.999 * s.limit))
        drives, shared = batch.command(_view(seen), wanted, np.zeros((count, 1)), shared)
        np.testing.assert_allclose(drives, np.array(single), atol=1e-3)
    assert limited > 0 or hurry < 1.0


def _aim(plant: Any, joints: Any, velocity: Any) -> Reference:
    """A wanted velocity, arms where they are."""
    arms = {name: joints[list(arm.joints)] for name, arm in plant.robot.arms.items()}
    return Reference(velocity=velocity, joints=arms)


def _view(seen: list[RobotState]) -> View:
    def column(name: str) -> Any:
        return np.array([np.atleast_1d(getattr(s, name)) for s in seen])

    return View(
        step=seen[0].step,
        rotation=np.array([s.rotation for s in seen]),
        velocity=column("velocity"),
        angular_velocity=column("angular_velocity"),
        submersion=column("submersion"),
        buoyancy=np.array([[s.buoyancy.force] for s in seen]),
        buoyancy_centre=np.array([s.buoyancy.centre for s in seen]),
        gain=column("gain"),
        limit=column("limit"),
        low=column("low"),
    )


def test_one_view_stands_for_many_wrenches(parts: Any) -> None:
    """Limits of one row hold for every wrench: the same commands as with a row each."""
    _, plant, joints = parts
    rng = np.random.default_rng(5)
    view = _view([_situation(plant, joints, rng, 0.0)])
    allocation = BatchAllocation(
        plant,
        MassPropertyEstimator(plant.robot).at(joints).centre,
        np.zeros(1),
        saturation=Saturation.priority,
        weights=np.ones(4),
    )
    wrench = rng.normal(size=(12, 4)) * [200.0, 5.0, 5.0, 5.0]
    each = View(*(np.repeat(x, 12, axis=0) if np.ndim(x) else x for x in view))
    found = allocation.commands(wrench, view)
    np.testing.assert_allclose(found, allocation.commands(wrench, each), atol=1e-9)
    assert np.any(found >= 0.999 * view.limit)


def test_a_gain_on_the_rate_is_refused(parts: Any) -> None:
    """What has no form over a batch is said, with the allowed value."""
    controller, plant, joints = parts
    before = controller.rate_gain
    controller.rate_gain = (0.1, 0.1)
    try:
        with pytest.raises(ConfigError, match="no form over a batch"):
            controller.batched(plant, joints, np.zeros(1))
    finally:
        controller.rate_gain = before
