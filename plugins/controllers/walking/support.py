"""Forces of the feet that carry a walking robot and hold it level, as offsets of its servos."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control import Plant, RobotState
from seals.plugins.controllers.walking.anatomy import Anatomy

LIGHT = 0.1
"""Weight of a leg that is about to leave the ground against one that stands [1]."""
RAMP = 0.15
"""Share of the stance over which a leg takes up its load, and gives it up [1]."""
SLACK = 1e-6
"""Regularisation of the distribution of loads: moments that no foot can give are left out [m^2]."""


class Support(NamedTuple):
    """Quantities of a robot for the distribution of loads.

    Args:
        legs: geometry of the legs.
        stiffness: of the servos of the legs [N m/rad], shape (N, 3).
        gravity: [m/s^2].
        share: of the weight that is fed forward [1].
        level: bandwidth at which the body is held level, 0 for not at all [rad/s].
    """

    legs: Anatomy
    stiffness: Floats
    gravity: float
    share: float
    level: float

    def offsets(self, s: RobotState, toes: Floats, stance: Floats) -> Floats:
        """Return offsets of the joint values with which the feet carry the body [rad].

        Equation:
            least sum_i f_i^2 / w_i with sum f_i = m g and sum r_i x f_i = M about the centre of
            gravity, M = -I (k^2 e + 1.4 k w), e the tilt; offset of a joint = -J^T f / stiffness.

        Args:
            s: situation of the robot.
            toes: wanted places, body axes [m], shape (N, 3).
            stance: share of its stance that each leg has done, 1 and more in the air [1],
                shape (N,).

        Returns:
            Shape (N, 3).
        """
        up = s.rotation[2]
        tilt = np.array([up[1], -up[0], 0.0])
        rate = s.angular_velocity * np.array([1.0, 1.0, 0.0])
        moment = -s.inertia @ (self.level * (self.level * tilt + 1.4 * rate))
        load = np.array([s.mass * self.gravity, moment[0], moment[1]])
        ends = np.minimum(stance, 1.0 - stance) / RAMP
        weight = np.where(stance < 1.0, np.clip(ends, LIGHT, 1.0), 0.0)
        arm = toes - s.centre
        rows = np.stack((np.ones(len(toes)), arm[:, 1], -arm[:, 0]))
        spread = (rows * weight) @ rows.T + SLACK * np.diag([0.0, 1.0, 1.0])
        lift = weight * (rows.T @ np.linalg.lstsq(spread, load, rcond=None)[0])
        force = self.share * np.maximum(lift, 0.0)[:, None] * up
        torque = np.einsum("nij,ni->nj", self.legs.jacobian(self.legs.angles(toes)), force)
        offsets: Floats = -torque / self.stiffness
        return offsets


def leg_stiffness(plant: Plant, columns: Floats) -> Floats | None:
    """Return the stiffness of the servos of the legs [N m/rad], or None without servos.

    Args:
        plant: the robot.
        columns: joints of the legs, shape (N, 3).
    """
    joints = plant.robot.tree.joints
    for bound in plant.effects.joint_drives:
        if hasattr(bound.hooks, "of_joints"):
            found: Floats = np.maximum(bound.hooks.of_joints("kp", joints), 1e-6)[columns]
            return found
    return None
