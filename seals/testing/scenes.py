"""Scenes in which simulator and twin must agree: under water, through the surface, in air."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from seals import registry
from seals.arrays import Floats
from seals.backend import Configuration
from seals.config.environment import EnvironmentSettings
from seals.effects.effect import Effect, MediumKind
from seals.frames import quaternion_of_rpy
from seals.robot.model import RobotModel

HEIGHTS = {"submerged": -30.0, "surface": 0.2, "air": 60.0}
"""Start of the base origin [m]; neither the deep nor the high scene reaches the surface in 2 s."""

ENVIRONMENT = EnvironmentSettings(water_level=0.0)

ARM_SIZE = 0.2
"""Mass of a link of the arm against the free body [1]."""

LIMITS = {False: {0.001: 1e-3, 0.004: 5e-3}, True: {0.001: 5e-3, 0.004: 2e-2}}
"""Largest relative error by step [s], without and with moving links."""


class Case(NamedTuple):
    """One robot in one or more scenes, all under the same effects.

    Args:
        scenes: names of the scenes.
        arm: whether the robot has moving links.
    """

    scenes: tuple[str, ...]
    arm: bool


def cases_of(effect: Effect, hooks: tuple[str, ...]) -> tuple[Case, ...]:
    """Return the cases in which an effect can matter."""
    kind = getattr(effect, "medium", MediumKind.any)
    if hooks == ("joint_loads",):
        return (Case(("air",), True),)
    return {
        MediumKind.water: (Case(("surface",), False), Case(("surface",), True)),
        MediumKind.air: (Case(("air",), False), Case(("air",), True)),
        MediumKind.any: (Case(("surface", "air"), False), Case(("submerged",), True)),
    }[kind]


def companions(effect: Effect, *, size: float = 1.0) -> dict[str, Effect]:
    """Return weight, lift and light drags on all links, less those of the effect's phenomena.

    Args:
        effect: under test.
        size: mass of a link against a kilogramme [1].
    """
    options = {"medium": getattr(effect, "medium", MediumKind.any), "links": ["*"]}
    drag = {
        f"coefficient_{axis}": share * size
        for axis, share in zip("xyz", (0.5, 0.6, 0.7), strict=True)
    }
    spin = {name: 1e-2 * value for name, value in drag.items()}
    made: Mapping[str, Effect] = {
        "gravity": registry.get("effect", "gravity").load()(),
        "buoyancy": registry.get("effect", "buoyancy").load()(),
        "linear_drag": registry.get("effect", "linear_drag").load()(**drag, **options),
        "angular_drag": registry.get("effect", "angular_drag").load()(**spin, **options),
    }
    owned = set(effect.accounts_for)
    return {name: other for name, other in made.items() if not owned & set(other.accounts_for)}


def start_of(robot: RobotModel, scene: str, place: int) -> Configuration:
    """Return the initial state of a scene: tilted, moving, turning, joints swinging.

    Args:
        robot: the robot.
        scene: name of the scene.
        place: number of the scene in its case; scenes stand 20 m apart.
    """
    joints = robot.tree.joints
    return Configuration(
        position=np.array([20.0 * place, 0.0, HEIGHTS[scene]]),
        quaternion=quaternion_of_rpy(np.array([[0.2, 0.4, 0.1]]))[0],
        velocity=np.array([0.5, 0.2, -0.1]),
        spin=np.array([1.0, 0.5, -0.7]),
        joints=np.array([0.3, -0.4])[:joints],
        rates=np.array([1.0, -2.0])[:joints],
    )


def held_torque(robot: RobotModel) -> Floats:
    """Return the joint torques held throughout [N m], shape (1, J)."""
    return np.array([[0.004, -0.002]])[:, : robot.tree.joints]
