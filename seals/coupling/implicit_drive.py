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


class _Gain(NamedTuple):
    """Gain (1, J) and armature (J,) of a step, with the arrays that they were computed from."""

    stiffness: Floats
    damping: Floats
    armature: Floats | None
    given: tuple[float, bool]
    gain: Floats
    inertia: Floats


class ImplicitDrives:
    """Linearisation of the joint drives of one robot over a step.

    Args:
        lead: coordinates before those of the joints: 6, or 0 for a fixed base.
    """

    def __init__(self, lead: int) -> None:
        self._lead = lead
        self._gain: _Gain | None = None

    def over_step(
        self, dynamics: Dynamics, step: float, last: Floats | None
    ) -> ImplicitDrive | None:
        """Return the joint drive of a step; None where there is none.

        Equation:
            Between contacts positions and velocities at the middle of the steps alternate
            (leapfrog): force - kp h^2 a / 2 - kd h (a - a_last), of second order and stable at any
            gain. After a start or a contact: the force at the end of the step,
            force - kp (h v + h^2 a) - kd h a.

        Args:
            dynamics: of the robot at the current time.
            step: h [s].
            last: acceleration of the joints in the last step while nothing touched, shape (J,);
                None after a start or a contact.
        """
        drive = dynamics.joint_drive
        if drive is None:
            return None
        if last is None:
            rates = dynamics.moving.speed[:, self._lead :]
            force = drive.force - drive.stiffness * step * rates
        else:
            force = drive.force + drive.damping * (step * last)
        known = self._gains(drive, dynamics.armature, step, late=last is None)
        late = JointDrive(force, drive.stiffness, drive.damping, drive.limit)
        return ImplicitDrive(late, known.gain, known.inertia)

    def _gains(
        self, drive: JointDrive, armature: Floats | None, step: float, *, late: bool
    ) -> _Gain:
        """Gain of a step; kept as long as slopes and armature are the very same arrays."""
        kept = self._gain
        if (
            kept is not None
            and kept.damping is drive.damping
            and kept.stiffness is drive.stiffness
            and kept.armature is armature
            and kept.given == (step, late)
        ):
            return kept
        none = np.zeros(drive.force.shape[1])
        share = 1.0 if late else 0.5
        gain = step * drive.damping + share * step * step * drive.stiffness + none
        inertia = none if armature is None else armature
        self._gain = _Gain(drive.stiffness, drive.damping, armature, (step, late), gain, inertia)
        return self._gain
