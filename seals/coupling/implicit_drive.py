"""Linearisation of joint drives in the acceleration of a step."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.backend import Dynamics
from seals.motion import JointDrive


class ImplicitDrive(NamedTuple):
    """Joint drive over a step as a function of the acceleration a: force - gain a.

    Args:
        drive: force with the motion that is known already, and limit.
        gain: [kg m^2 or kg], shape (1, J).
        armature: inertia of the drives [kg m^2 or kg], shape (J,).
    """

    drive: JointDrive
    gain: Floats
    armature: Floats


def drive_over(dynamics: Dynamics, step: float, last: Floats | None) -> ImplicitDrive | None:
    """Return the joint drive of a robot over a step, linear in the acceleration; None for none.

    Equation:
        Between contacts positions and velocities at the middle of the steps alternate (leapfrog):
        force - kp h^2 a / 2 - kd h (a - a_last), of second order and stable at any gain. After a
        start or a contact: the force at the end of the step, force - kp (h v + h^2 a) - kd h a.

    Args:
        dynamics: of the robot at the current time.
        step: h [s].
        last: acceleration of the joints in the last step while nothing touched, shape (J,); None
            after a start or a contact.
    """
    drive = dynamics.joint_drive
    if drive is None:
        return None
    joints = drive.force.shape[1]
    if last is None:
        rates = dynamics.moving.speed[:, dynamics.moving.speed.shape[1] - joints :]
        share, force = 1.0, drive.force - drive.stiffness * step * rates
    else:
        share, force = 0.5, drive.force + drive.damping * (step * last)
    gain = step * drive.damping + share * step * step * drive.stiffness + np.zeros(joints)
    armature = np.zeros(joints) if dynamics.armature is None else dynamics.armature
    late = JointDrive(force, drive.stiffness, drive.damping, drive.limit)
    return ImplicitDrive(late, gain, armature)
