"""Inputs, outputs and state of the stages of a mission."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control import RobotState
from seals.control.tracking import Place
from seals.multibody.tree import poses_in_base
from seals.robot.limbs import Arm, Gripper
from seals.robot.model import RobotModel
from seals.state_records import state_record


class Outcome(enum.Enum):
    """Transition of a stage: continue, next stage, or retry."""

    stay = "stay"
    onward = "onward"
    again = "again"
    """Back to the first stage that reaches for the object."""


@state_record
class MissionState(NamedTuple):
    """State of a mission between calls; immutable.

    Args:
        number: of the present stage, from 0.
        since: start of the stage [s].
        origin: place wanted when the stage began, world [m], shape (3,).
        place: wanted now, world [m], shape (3,).
        yaw: wanted now [rad].
        yaw_origin: wanted when the stage began [rad].
        arm: angles wanted now [rad or m], shape (k,).
        arm_origin: angles wanted when the stage began, shape (k,).
        grip: wanted now, 0 open to 1 closed [1].
        grip_origin: wanted when the stage began [1].
        target: where the object is, world [m], shape (3,); None before it has been seen.
        good: since when the condition to go on holds [s]; infinity while it does not.
        tries: how often the object has been reached for.
        outcome: True when done, False when given up.
    """

    number: int
    since: float
    origin: Floats
    place: Floats
    yaw: float
    yaw_origin: float
    arm: Floats
    arm_origin: Floats
    grip: float
    grip_origin: float
    target: Floats | None
    good: float
    tries: int
    outcome: bool | None


class Scene(NamedTuple):
    """Inputs of a stage at one instant.

    Args:
        now: the situation.
        kept: memory of the mission.
        hand: arm and gripper of the robot.
        pads: force on every pad by name [N].
    """

    now: RobotState
    kept: MissionState
    hand: Hand
    pads: Mapping[str, float]

    @property
    def elapsed(self) -> float:
        """Time since the stage began [s]."""
        return self.now.time - self.kept.since

    def pressed(self, force: float) -> int:
        """Return the number of contact pads with at least ``force`` [N]."""
        return sum(1 for value in self.pads.values() if value >= force)


class Move(NamedTuple):
    """Reference of a stage at one instant.

    Args:
        place: of the body origin.
        arm: angles [rad or m], shape (k,).
        grip: 0 open to 1 closed [1].
        fine: whether the condition to go on holds; a stage goes on when it has held for a while.
        verdict: stay, or what comes next regardless of ``fine``.
    """

    place: Place
    arm: Floats
    grip: float
    fine: bool
    verdict: Outcome = Outcome.stay


class Hand:
    """Arm and gripper that a mission uses, with the grasp point.

    Args:
        robot: with at least one arm and one gripper, or none at all.
        arm: name; empty for the first.
        gripper: name; empty for the first.
    """

    def __init__(self, robot: RobotModel, arm: Arm | None, gripper: Gripper | None) -> None:
        self.robot, self.arm, self.gripper = robot, arm, gripper
        self.stowed = np.zeros(0) if arm is None else np.asarray(arm.stowed, dtype=float)
        self._grasp = np.zeros(3)
        if arm is not None and gripper is not None and gripper.tips:
            origins, turns = poses_in_base(robot.tree)
            middle = origins[list(gripper.tips)].mean(axis=0)
            self._grasp = (middle - origins[arm.tool]) @ turns[arm.tool]

    def offset(self, joints: Floats) -> Floats:
        """Return the grasp point, body axes about the body origin [m], shape (3,)."""
        if self.arm is None:
            return np.zeros(3)
        origins, turns = poses_in_base(self.robot.tree, joints)
        held: Floats = origins[self.arm.tool] + turns[self.arm.tool] @ self._grasp
        return held

    def body_for(self, held: Floats, yaw: float, joints: Floats) -> Floats:
        """Return the position of the level body with the hand at a point, world [m], shape (3,)."""
        x, y, z = self.offset(joints)
        c, s = math.cos(yaw), math.sin(yaw)
        place: Floats = held - np.array([c * x - s * y, s * x + c * y, z])
        return place
