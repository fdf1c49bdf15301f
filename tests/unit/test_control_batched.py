"""Controllers over a batch: one robot is a row of it; what has no form is refused in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from seals.arrays import Floats
from seals.control import Reference, RobotState
from seals.control.limbs import stowed
from seals.control.mass_properties import MassPropertyEstimator
from seals.control.plant import ROTOR, Plant, build_plant
from seals.control.protocols import Buoyancy
from seals.errors import ConfigError
from seals.frames import exponential, matrix_of
from seals.run.assembly import build_model
from seals.run.build import run_settings


def test_a_gain_on_the_rate_is_refused() -> None:
    """What has no batched form is said, with the allowed value."""
    words = ["robot=aam", "water=fossen", "controller=cascade", "guide=hover"]
    settings = run_settings([*words, "controller.rate_gain=[0.1,0.1]"])
    robot, effects = build_model(settings)
    plant = build_plant(robot, effects, settings.environment)
    with pytest.raises(ConfigError, match="no batched form"):
        settings.controller.batched(plant, stowed(robot), np.zeros(1))


def _flights(plant: Plant, rng: np.random.Generator) -> tuple[list[RobotState], list[Reference]]:
    """Three robots in different states, arms bent, and what they are to do."""
    states, aims, layout = [], [], plant.layout
    for k in range(3):
        joints = stowed(plant.robot) + 0.02 * k
        mass = MassPropertyEstimator(plant.robot).at(joints)
        lean, spin, velocity, place = rng.uniform(-0.02, 0.02, (4, 3))
        wet = 0.4 * k
        states.append(
            RobotState(
                time=0.0,
                step=0.01,
                position=place,
                rotation=matrix_of(exponential(lean[None]))[0],
                velocity=velocity,
                angular_velocity=spin,
                joints=joints,
                joint_velocity=rng.uniform(-0.1, 0.1, len(joints)),
                **mass._asdict(),
                submersion=wet,
                buoyancy=Buoyancy(9.0 * wet, np.array([0.0, 0.0, 0.02 * wet])),
                depth=0.0,
                gain=np.ones(layout.drives),
                limit=layout.limit,
                low=layout.low * np.array([float(kind != ROTOR) for kind in layout.kind]),
            )
        )
        fast, push = rng.uniform(-0.5, 0.5, (2, 3))
        arms = {n: 0.1 * k + np.zeros(len(a.joints)) for n, a in plant.robot.arms.items()}
        aims.append(
            Reference(fast, push, yaw=0.1 * k, yaw_rate=0.05 * k, joints=arms, position=place)
        )
    return states, aims


def _stacked(rows: Sequence[Any], names: tuple[str, ...]) -> dict[str, Floats]:
    """Numbers of the rows as arrays with a first axis of the batch."""
    parts = {name: np.stack([np.asarray(getattr(r, name)) for r in rows]) for name in names}
    return {name: x[:, None] if x.ndim == 1 else x for name, x in parts.items()}


@pytest.mark.parametrize(("robot", "controller"), [("aam", "cascade"), ("auv", "station")])
def test_rows_of_a_batch_are_robots_of_their_own(robot: str, controller: str) -> None:
    """Three calls with moving joints: commands over the batch are those of every robot alone."""
    words = [f"robot={robot}", "water=fossen", f"controller={controller}", "guide=hover"]
    settings = run_settings(words)
    model, effects = build_model(settings)
    plant = build_plant(model, effects, settings.environment)
    law, batch = settings.controller, settings.controller.batched(plant, None, np.zeros(1))
    law.bind(plant)
    alone, together = [law.start() for _ in range(3)], batch.start(3)
    states, aims = _flights(plant, np.random.default_rng(0))
    for _ in range(3):
        own = []
        for k, (state, aim) in enumerate(zip(states, aims, strict=True)):
            order, alone[k] = law.command(state, aim, alone[k])
            own.append(order.drive)
        names = ("position", "rotation", "velocity", "angular_velocity", "joints", "gain", "limit")
        names += ("joint_velocity", "centre", "inertia", "centre_map", "momentum_map", "low")
        buoyancy = _stacked([s.buoyancy for s in states], ("force", "centre"))
        situation = states[0]._replace(
            **_stacked(states, (*names, "submersion")), buoyancy=Buoyancy(**buoyancy)
        )
        arms = {n: np.stack([a.joints[n] for a in aims]) for n in plant.robot.arms}
        aim = Reference(
            **_stacked(aims, ("velocity", "acceleration", "yaw", "yaw_rate", "position")),
            joints=arms,
        )
        found, together = batch.command(situation, aim, together)
        assert np.ptp(found, axis=0).min() > 1e-3
        np.testing.assert_allclose(found, np.stack(own), rtol=1e-9, atol=1e-9)
