"""Joint drives as the engine's step can follow them: implicitly, with the robot's own inertia.

The engine knows a joint drive as a torque that it holds over a step. A servo on a light link is
stiffer than that: its torque must be the one that belongs to the motion of the step itself. The
motion is predicted with the inertia that the joints feel (the base free) and with every other
force, contacts and stops included, as it was in the last step.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.backend import Dynamics
from seals.motion import JointDrive
from seals.multibody.linear import solved
from seals.multibody.servo import driven, heavier
from seals.plugins.backends.pybullet.loading import Loaded
from seals.robot.model import RobotModel

STALE = 0.03
"""Motion of a joint after which the inertia is found anew [rad or m].

The inertia shapes the difference to the last step alone: a share of it does not matter.
"""


class Taken(NamedTuple):
    """A joint drive as it acts over a step whose acceleration is a: force - gain a.

    Args:
        drive: force with the motion that is known already, and limit.
        gain: [kg m^2 or kg], shape (1, J).
        armature: inertia of the drives [kg m^2 or kg], shape (J,).
    """

    drive: JointDrive
    gain: Floats
    armature: Floats


class Felt(NamedTuple):
    """What the joints did in the last step.

    Args:
        change: their acceleration [rad/s^2 or m/s^2], shape (J,).
        given: force handed to the engine [N m or N], shape (J,).
    """

    change: Floats
    given: Floats


class _Prepared(NamedTuple):
    """Inertia of the joints (J, J), gain (1, J), and the inertia with armature and gain on it."""

    inertia: Floats
    gain: Floats
    whole: Floats


class _Gain(NamedTuple):
    """Gain (1, J) and armature (J,) of a step, and what they were made of."""

    stiffness: Floats
    damping: Floats
    armature: Floats | None
    given: tuple[float, bool]
    gain: Floats
    turned: Floats


class JointServo:
    """Turns joint drives into torques that the engine holds over a step.

    Args:
        engine: the pybullet module.
        client: physics client.
        robot: the robot.
        loaded: the robot in the engine.
    """

    def __init__(self, engine: Any, client: int, robot: RobotModel, loaded: Loaded) -> None:
        """Keep the order of the joints."""
        self._p, self._client, self._body = engine, client, loaded.body
        self._order = loaded.order
        self._back = np.argsort(loaded.order)
        self._straight = loaded.order.tolist() == list(range(len(loaded.order)))
        self._lead = 0 if robot.tree.fixed_base else 6
        self.felt: Felt | None = None
        self._known: tuple[Floats, Floats] | None = None
        self._solved: _Prepared | None = None
        self._gain: _Gain | None = None

    def taken(self, dynamics: Dynamics, step: float, last: Floats | None) -> Taken | None:
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
        return Taken(late, known.gain, known.turned)

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
        turned = none if armature is None else armature
        self._gain = _Gain(drive.stiffness, drive.damping, armature, (step, late), gain, turned)
        return self._gain

    def snapshot(self) -> Any:
        """Return what the joints did, and the inertia in use; none of it is ever written to."""
        return self.felt, self._known

    def restore(self, kept: Any) -> None:
        """Put a snapshot back; None forgets everything."""
        self.felt, self._known = (None, None) if kept is None else kept

    def inertia(self, joints: Floats) -> Floats:
        """Return the inertia that the joints feel, the base free, shape (J, J).

        It is kept until a joint has moved by `STALE`.

        Args:
            joints: positions [rad or m], shape (J,).
        """
        if self._known is not None:
            pairs = zip(joints.tolist(), self._known[0].tolist(), strict=True)
            if max(abs(now - then) for now, then in pairs) <= STALE:
                return self._known[1]
        self._known = (joints, self._inertia(joints))
        return self._known[1]

    def _inertia(self, joints: Floats) -> Floats:
        table = self._p.calculateMassMatrix(
            self._body, joints[self._order].tolist(), physicsClientId=self._client
        )
        whole, lead = np.array(table), self._lead
        found: Floats = whole[lead:, lead:]
        if lead:
            across = whole[:lead, lead:]
            found = found - across.T @ solved(whole[:lead, :lead], across)
        return found if self._straight else found[self._back[:, None], self._back]

    def _prepared(self, inertia: Floats, acting: Taken) -> _Prepared:
        """What belongs to an inertia and a gain, kept as long as they are."""
        kept = self._solved
        if kept is None or kept.inertia is not inertia or kept.gain is not acting.gain:
            whole = inertia + np.diag(acting.armature + acting.gain[0])
            kept = self._solved = _Prepared(inertia, acting.gain, whole)
        return kept

    def forces(self, dynamics: Dynamics, acting: Taken, joints: Floats) -> Floats | None:
        """Return the forces to hand to the engine, shape (J,); None when the last step is unknown.

        Args:
            dynamics: of the robot at the current time.
            acting: the drives.
            joints: positions [rad or m], shape (J,).
        """
        if self.felt is None:
            return None
        known, drive = self._prepared(self.inertia(joints), acting), acting.drive
        outer = dynamics.joint_force[0]
        right = known.inertia @ self.felt.change - self.felt.given + outer
        change = solved(known.whole, right + drive.force[0])
        pull = drive.force[0] - acting.gain[0] * change
        if np.count_nonzero(np.abs(pull) > drive.limit):
            matrix = heavier(known.inertia[None], acting.armature[None])
            both = driven(matrix, right[None], drive, acting.gain)
            change, pull = both[0][0], both[1][0]
        given: Floats = outer + pull - acting.armature * change
        return given
