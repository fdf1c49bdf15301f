"""Wrench that the drives must make for an acceleration, by the model of the robot."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.control.protocols import RobotState
from seals.frames import cross3


def model_wrench(
    s: RobotState, acceleration: Floats, turning: Floats, *, added: Floats, gravity: float
) -> Floats:
    """Return force and torque about the centre of gravity, body axes [N, N m], shape (6,).

    Equation:
        F = (m + s M_A) a + weight - buoyancy, T = (J + s J_A) w' + w x J w - buoyancy's torque, s
        the submersion.

    Args:
        s: the robot now.
        acceleration: a, body axes [m/s^2], shape (3,).
        turning: w', body axes [rad/s^2], shape (3,).
        added: added inertia of the submerged robot, from `seals.control.added`, shape (6, 6).
        gravity: [m/s^2].

    References:
        Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control, ch. 8.
    """
    carried, up = s.submersion * added, s.rotation[2]
    force = s.mass * acceleration + carried[:3, :3] @ acceleration
    force = force + (s.mass * gravity - s.buoyancy.force) * up
    swirl = cross3(s.angular_velocity, s.inertia @ s.angular_velocity)
    torque = (s.inertia + carried[3:, 3:]) @ turning + swirl
    torque = torque - cross3(s.buoyancy.centre - s.centre, s.buoyancy.force * up)
    return np.concatenate((force, torque))
