"""Scenes in which simulator and batch dynamics must agree: in water, at the surface, in air."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals import registry
from seals.backend import Configuration
from seals.effects.binding import EffectSet
from seals.effects.effect import Effect, MediumKind
from seals.environment.settings import EnvironmentSettings
from seals.frames import quaternion_of_rpy
from seals.motion import Inputs
from seals.robot.model import RobotModel
from seals.testing.calling import DRIVEN, QUIET

HEIGHTS = {"submerged": -30.0, "surface": 0.2, "air": 60.0}
"""Start of the base origin [m]; neither the deep nor the high scene reaches the surface in 2 s."""

ENVIRONMENT = EnvironmentSettings(water_level=0.0)

ARM_SIZE = 0.2
"""Mass of a link of the arm against the free body [1]."""

LIMITS = {False: {0.001: 1e-3, 0.004: 5e-3}, True: {0.001: 5e-3, 0.004: 2e-2}}
"""Largest relative error by step [s], without and with moving links."""


ROTORS: dict[str, Any] = {
    "position": [[0.12, 0.1, 0.03], [-0.12, 0.1, 0.03], [-0.12, -0.1, 0.03], [0.12, -0.1, 0.03]],
    "direction": [1.0, -1.0, 1.0, -1.0],
    "thrust_coefficient": [1e-5],
    "torque_coefficient": [1.5e-7],
    "radius": [0.12],
    "max_speed": [1000.0],
}
"""Four rotors that carry a body of 1 kg at half of their speed."""

THRUSTERS: dict[str, Any] = {
    "position": ROTORS["position"],
    "axis": [[0.0, 0.0, 1.0]],
    "max_force": [5.0],
}
"""Four thrusters that carry it at half of their force."""

DRIVES = {"rotors": ROTORS, "thrusters": THRUSTERS}

SHARES = (0.5, 0.49, 0.505, 0.495)
"""Held drives against their limits [1]: near hover, and the body turns."""


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
    kind = effect.medium or MediumKind.any
    if set(hooks) <= set(QUIET):
        return ()
    if "drives" in hooks or set(hooks) & set(DRIVEN):
        return (Case(("air",) if kind is MediumKind.air else ("surface", "air"), False),)
    if set(hooks) <= {"joint_loads", "joint_drive", "joint_resistance"}:
        return (Case(("surface",) if kind is MediumKind.water else ("air",), True),)
    return {
        MediumKind.water: (Case(("surface",), False), Case(("surface",), True)),
        MediumKind.air: (Case(("air",), False), Case(("air",), True)),
        MediumKind.any: (Case(("surface", "air"), False), Case(("submerged",), True)),
    }[kind]


def companions(effect: Effect, *, size: float = 1.0) -> dict[str, Effect]:
    """Return weight, buoyancy and light drag on all links, without the effect's own phenomena.

    Effects that change what actuators do get rotors, or what their class attribute ``actuator``
    names; those that state the gains of a servo get such a servo.

    Args:
        effect: under test.
        size: mass of a link against a kilogramme [1].
    """
    options = {"medium": effect.medium or MediumKind.any, "links": ["*"]}
    drag = {
        f"coefficient_{axis}": share * size
        for axis, share in zip("xyz", (0.5, 0.6, 0.7), strict=True)
    }
    spin = {name: 1e-2 * value for name, value in drag.items()}
    made: dict[str, Effect] = {
        "gravity": registry.get("effect", "gravity").load()(),
        "buoyancy": registry.get("effect", "buoyancy").load()(),
        "linear_drag": registry.get("effect", "linear_drag").load()(**drag, **options),
        "angular_drag": registry.get("effect", "angular_drag").load()(**spin, **options),
    }
    if any(hasattr(effect, hook) for hook in DRIVEN):
        made[effect.actuator] = registry.get("actuator", effect.actuator).load()(
            **DRIVES[effect.actuator]
        )
    if all(hasattr(effect, gain) for gain in ("kp", "kd")):
        gains = {gain: getattr(effect, gain) for gain in ("kp", "kd")}
        made["servos"] = registry.get("actuator", "servos").load()(**gains)
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
        angular_velocity=np.array([1.0, 0.5, -0.7]),
        joints=np.array([0.3, -0.4])[:joints],
        joint_velocity=np.array([1.0, -2.0])[:joints],
    )


def held_inputs(robot: RobotModel, effects: EffectSet) -> Inputs:
    """Return the constant inputs of a scene: joint torques and commands, drives, voltage.

    Args:
        robot: the robot.
        effects: bound effects; every actuator runs near half of its limits, one drive a little
            faster than the next.
    """
    joints = robot.tree.joints
    actuators: list[Any] = [b.effect for b in effects.actuators]
    count = max((a.first + a.count for a in actuators), default=0)
    drive = np.zeros((1, count))
    for a in actuators:
        drive[0, a.first : a.first + a.count] = a.limit * np.resize(SHARES, a.count)
    return Inputs(
        step=0.0,
        joint_torque=np.array([[0.004, -0.002]])[:, :joints],
        drive=drive if count else None,
        voltage=np.array([[15.0]]),
        joint_command=np.array([[0.9, -0.6]])[:, :joints],
    )
