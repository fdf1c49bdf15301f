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


def drive_over(
    dynamics: Dynamics, step: float, last: Floats | None
) -> tuple[Dynamics, ImplicitDrive | None]:
    """Return the dynamics, and the joint drive over a step, linear in the acceleration, or None.

    Equation:
        Between contacts positions and velocities at the middle of the steps alternate (leapfrog):
        force - kp h^2 a / 2 - kd h (a - a_last), of second order and stable at any gain. After a
        start or a contact: the force at the end of the step, force - kp (h v + h^2 a) - kd h a.

        A resistance of the joints, -r v in the joint force, likewise and beside the limits of the
        drives: -r v - r h (a - a_last), or -r (v + h a). The part with a is an armature r h.

    Args:
        dynamics: of the robot at the current time.
        step: h [s].
        last: acceleration of the joints in the last step while nothing touched, shape (J,); None
            after a start or a contact.
    """
    drive, resistance = dynamics.joint_drive, dynamics.found.resistance
    if drive is None and resistance is None and dynamics.armature is None:
        return dynamics, None
    if drive is None:
        none = dynamics.joint_force * 0.0
        drive = JointDrive(none, none, none, none)
    joints = drive.force.shape[1]
    if last is None:
        rates = dynamics.moving.speed[:, dynamics.moving.speed.shape[1] - joints :]
        share, force = 1.0, drive.force - drive.stiffness * step * rates
    else:
        share, force = 0.5, drive.force + drive.damping * (step * last)
    gain = step * drive.damping + share * step * step * drive.stiffness + np.zeros(joints)
    armature = np.zeros(joints) if dynamics.armature is None else dynamics.armature
    if resistance is not None:
        armature = step * resistance[0] + armature
        if last is not None:
            resisted = dynamics.joint_force + resistance * (step * last)
            dynamics = dynamics._replace(joint_force=resisted)
    late = JointDrive(force, drive.stiffness, drive.damping, drive.limit)
    return dynamics, ImplicitDrive(late, gain, armature)
