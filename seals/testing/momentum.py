"""Momentum of a robot from the poses that a backend reports."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.backend import LinkPoses
from seals.multibody.kinematics import Kinematics
from seals.robot.model import RobotModel


def momentum_of(robot: RobotModel, poses: LinkPoses) -> tuple[Floats, Floats]:
    """Return linear and angular momentum about the centre of mass, world axes [kg m/s, kg m^2/s].

    Args:
        robot: the robot.
        poses: of its links.
    """
    kinematics = Kinematics(robot.tree, poses.origins, poses.rotations)
    twists = np.matmul(kinematics.jacobian[0], poses.speed[0])
    own = np.einsum("lij,lj->li", robot.spatial_inertia, twists)
    turn, origin = poses.rotations[0], poses.origins[0]
    linear = np.einsum("lij,lj->li", turn, own[:, :3])
    angular = np.einsum("lij,lj->li", turn, own[:, 3:])
    centres = origin + np.einsum("lij,lj->li", turn, robot.centre)
    middle = (robot.mass[:, None] * centres).sum(axis=0) / robot.mass.sum()
    total: Floats = linear.sum(axis=0)
    return total, (angular + np.cross(origin - middle, linear)).sum(axis=0)
