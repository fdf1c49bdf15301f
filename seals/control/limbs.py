"""Joint targets from references for arms and grippers, and prediction of their motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control.plant import Plant
from seals.control.protocols import Reference
from seals.errors import ConfigError, refuse_unlisted
from seals.robot.limbs import standing
from seals.robot.model import RobotModel
from seals.state_records import state_record


def stowed(robot: RobotModel) -> Floats:
    """Return the rest posture: arms stowed, grippers open, legs in stance, others zero, (J,)."""
    out = standing(robot.legs, robot.tree.joints)
    for arm in robot.arms.values():
        out[list(arm.joints)] = arm.stowed
    for gripper in robot.grippers.values():
        out[list(gripper.joints)] = gripper.open
    return _within(out, robot)


def joint_targets(aim: Reference, last: Floats, robot: RobotModel) -> Floats:
    """Return the joint targets, within the joint limits, shape (J,), or (B, J) of a batch.

    Args:
        aim: of the guide; of a batch, values of all its robots.
        last: targets so far; parts that the aim does not name keep theirs.
        robot: the robot.

    Raises:
        ConfigError: the aim names an arm or gripper that the robot does not have, or gives another
            number of values.
    """
    if not aim.joints and not aim.grip:
        return last
    out = last.copy()
    for name, values in aim.joints.items():
        arm = _part("arm", name, robot.arms)
        count = np.shape(values)[-1]
        if count != len(arm.joints):
            raise ConfigError(
                f"aim.joints.{name} has {count} values.\n"
                f"Allowed: {len(arm.joints)}, one per joint of the arm."
            )
        out[..., list(arm.joints)] = values
    for name, grip in aim.grip.items():
        gripper = _part("gripper", name, robot.grippers)
        out[..., list(gripper.joints)] = gripper.at(grip)
    return _within(out, robot)


def _within(values: Floats, robot: RobotModel) -> Floats:
    return np.minimum(np.maximum(values, robot.lower), robot.upper)


def _part(kind: str, name: str, parts: Mapping[str, Any]) -> Any:
    refuse_unlisted(name, parts, f"the robot has no {kind} '{name}'")
    return parts[name]


@state_record
class Reckoned(NamedTuple):
    """Predicted motion of the joints under their servos.

    Args:
        position: [rad or m], shape (J,).
        rate: [rad/s or m/s], shape (J,).
    """

    position: Floats
    rate: Floats

    def next(self, targets: Floats, way: Floats, fastest: float, step: float) -> Reckoned:
        """Return the motion one period later: a first-order lag at no more than a speed.

        Args:
            targets: of the servos [rad or m], shape (J,).
            way: from `way_of`, for the same period [1/s], shape (J,).
            fastest: largest rate [rad/s or m/s].
            step: of the period [s].
        """
        rate = np.minimum(np.maximum((targets - self.position) * way, -fastest), fastest)
        return Reckoned(self.position + step * rate, rate)


def way_of(lag: Floats, step: float) -> Floats:
    """Return the mean joint rate over a period per unit of remaining motion [1/s].

    Args:
        lag: time constants [s], shape (J,).
        step: of the period [s].
    """
    return -np.expm1(-step / lag) / step


def servo_lag(plant: Plant, default: float) -> Floats:
    """Return the time lag of the joints, damping over stiffness [s], shape (J,).

    Args:
        plant: the robot.
        default: for joints without a servo [s].
    """
    joints = plant.robot.tree.joints
    for bound in plant.effects.joint_drives:
        servo = bound.hooks
        if hasattr(servo, "of_joints"):
            stiff = np.maximum(servo.of_joints("kp", joints), 1e-9)
            lag: Floats = np.clip(servo.of_joints("kd", joints) / stiff, 1e-3, 1.0)
            return lag
    return np.full(joints, default)
