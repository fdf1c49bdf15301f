"""Servos that tilt rotors, as further columns of the allocation."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.control.fins import Fins
from seals.control.plant import ROTOR, Layout
from seals.errors import ConfigError
from seals.multibody.tree import poses_in_base
from seals.robot.model import RobotModel

FARTHEST = 0.6
"""Largest tilt that is commanded: the sine is within 6 % of the angle [rad]."""
ACROSS = 0.5
"""Least sine of the angle between hinge and thrust for a servo that tilts it [1]."""


def tilts_of(robot: RobotModel, layout: Layout, thrust: float) -> Fins:
    """Return the servos that tilt one rotor each, joints at zero.

    Equation:
        A thrust T along a, on a hinge h, turned by d: T (a + d h x a) for small d. The column of d
        is a force T h x a at the hub.

    Args:
        robot: the robot.
        layout: of its drives.
        thrust: at which the columns hold; others scale them [N].

    Raises:
        ConfigError: one joint tilts two rotors.
    """
    tree = robot.tree
    _, turns = poses_in_base(tree)
    joints, rows = [], []
    for drive, link in enumerate(layout.link):
        moving = np.flatnonzero(tree.moves[link]) if tree.joints else np.zeros(0, dtype=int)
        if layout.kind[drive] != ROTOR or not len(moving) or not layout.thrust_coefficient[drive]:
            continue
        joint = int(moving[0])
        hinge: Floats = turns[tree.child[joint]] @ tree.axis[joint]
        # h x a: where a tilt turns the thrust; its length is the sine between hinge and thrust
        across: Floats = np.cross(hinge, layout.axis[drive])
        size = float(np.linalg.norm(across))
        if size < ACROSS:
            continue
        if joint in joints:
            raise ConfigError(
                f"the joint '{robot.joints[joint]}' tilts two rotors.\n"
                "Allowed: one rotor for each tilting joint."
            )
        stop = min(abs(float(robot.lower[joint])), abs(float(robot.upper[joint])), FARTHEST)
        joints.append(joint)
        rows.append((layout.position[drive], across / size, thrust * size, stop))
    return Fins(
        joints=tuple(joints),
        position=np.reshape([row[0] for row in rows], (-1, 3)),
        axis=np.reshape([row[1] for row in rows], (-1, 3)),
        slope=np.array([row[2] for row in rows]),
        limit=np.array([row[3] for row in rows]),
    )


def tilted_drives(robot: RobotModel, layout: Layout, tilts: Fins) -> tuple[int, ...]:
    """Return the number of the drive that each servo tilts."""
    moves = robot.tree.moves
    return tuple(
        next(k for k, link in enumerate(layout.link) if moves[link][joint])
        for joint in tilts.joints
    )
