"""Prediction of the joint forces that an engine holds over a step, implicit in the drives.

An engine knows a joint drive as a torque that it holds over a step. A servo on a light link is
stiffer than that: its torque must be the one that belongs to the motion of the step itself. The
motion is predicted with the inertia that the joints feel (the base free) and with every other
force, contacts and stops included, as it was in the last step.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.backend import Dynamics
from seals.coupling.engine import EngineBody
from seals.coupling.implicit_drive import ImplicitDrive
from seals.multibody.linear import solved
from seals.multibody.servo import driven, heavier
from seals.state_records import state_record

STALE = 0.03
"""Motion of a joint after which the inertia is found anew [rad or m].

The inertia shapes the difference to the last step alone: a share of it does not matter.
"""


@state_record
class JointResponse(NamedTuple):
    """Motion of the joints in the last step.

    Args:
        change: their acceleration [rad/s^2 or m/s^2], shape (J,).
        given: force handed to the engine [N m or N], shape (J,).
    """

    change: Floats
    given: Floats


class JointServo:
    """Conversion of joint drives to torques that are constant over a step.

    Args:
        engine: the robot in the engine.
        lead: coordinates before those of the joints: 6, or 0 for a fixed base.

    Attributes:
        response: of the joints in the last step; None when it is not known.
    """

    def __init__(self, engine: EngineBody, lead: int) -> None:
        self._engine, self._lead = engine, lead
        self.response: JointResponse | None = None
        self._known: tuple[Floats, Floats] | None = None

    def snapshot(self) -> Any:
        """Return the joints' response and the inertia in use, both immutable."""
        return self.response, self._known

    def restore(self, kept: Any) -> None:
        """Restore a snapshot; None clears the state."""
        self.response, self._known = (None, None) if kept is None else kept

    def inertia(self, joints: Floats) -> Floats:
        """Return the joint-space inertia with a free base, shape (J, J).

        It is kept until a joint has moved by `STALE`.

        Args:
            joints: positions [rad or m], shape (J,).
        """
        if self._known is not None:
            pairs = zip(joints.tolist(), self._known[0].tolist(), strict=True)
            if max(abs(now - then) for now, then in pairs) <= STALE:
                return self._known[1]
        whole, lead = self._engine.mass_matrix(joints), self._lead
        found = whole[lead:, lead:]
        if lead:
            across = whole[:lead, lead:]
            found = found - across.T @ solved(whole[:lead, :lead], across)
        self._known = joints, found
        return found

    def forces(self, dynamics: Dynamics, acting: ImplicitDrive, joints: Floats) -> Floats | None:
        """Return the forces to hand to the engine, shape (J,); None when the last step is unknown.

        Args:
            dynamics: of the robot at the current time.
            acting: the drives.
            joints: positions [rad or m], shape (J,).
        """
        if self.response is None:
            return None
        inertia, drive, outer = self.inertia(joints), acting.drive, dynamics.joint_force[0]
        right = inertia @ self.response.change - self.response.given + outer
        whole = inertia + np.diag(acting.armature + acting.gain[0])
        change = solved(whole, right + drive.force[0])
        pull = drive.force[0] - acting.gain[0] * change
        if np.count_nonzero(np.abs(pull) > drive.limit):
            matrix = heavier(inertia[None], acting.armature[None])
            both = driven(matrix, right[None], drive, acting.gain)
            change, pull = both[0][0], both[1][0]
        given: Floats = outer + pull - acting.armature * change
        return given
