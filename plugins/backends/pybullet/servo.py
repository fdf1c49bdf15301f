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
from seals.dynamics.servo import driven, heavier
from seals.motion import JointDrive
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


def taken(dynamics: Dynamics, step: float, last: Floats | None) -> Taken | None:
    """Return the joint drive of a step; None where there is none.

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
    none = np.zeros(drive.force.shape[1])
    armature = none if dynamics.armature is None else dynamics.armature
    if last is None:
        rates = dynamics.moving.speed[:, -len(none) :]
        force = drive.force - drive.stiffness * step * rates
        gain = step * drive.damping + step * step * drive.stiffness
    else:
        force = drive.force + drive.damping * step * last
        gain = step * drive.damping + 0.5 * step * step * drive.stiffness
    return Taken(drive._replace(force=force), gain + none, armature)


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
        self._lead = 0 if robot.tree.fixed_base else 6
        self.felt: Felt | None = None
        self._known: tuple[Floats, Floats] | None = None
        self._solved: tuple[Floats, Floats, Floats, Floats] | None = None

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
        if self._known is None or np.abs(joints - self._known[0]).max() > STALE:
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
            found = found - across.T @ np.linalg.solve(whole[:lead, :lead], across)
        return found[self._back[:, None], self._back]

    def _inverse(self, inertia: Floats, matrix: Floats, gain: Floats) -> Floats:
        """Inverse of the matrix with the gain on it, kept as long as the inertia and the gain."""
        kept = self._solved
        if kept is None or kept[0] is not inertia or kept[1].tolist() != gain.tolist():
            inverse = np.linalg.inv(heavier(matrix[None], gain)[0])
            kept = self._solved = (inertia, gain.copy(), matrix, inverse)
        return kept[3]

    def forces(self, dynamics: Dynamics, acting: Taken, joints: Floats) -> Floats | None:
        """Return the forces to hand to the engine, shape (J,); None when the last step is unknown.

        Args:
            dynamics: of the robot at the current time.
            acting: the drives.
            joints: positions [rad or m], shape (J,).
        """
        if self.felt is None:
            return None
        inertia = self.inertia(joints)
        others = inertia @ self.felt.change - self.felt.given
        right = others[None] + dynamics.joint_force
        matrix = inertia[None]
        if dynamics.armature is not None:
            matrix = heavier(matrix, acting.armature[None])
        inverse = self._inverse(inertia, matrix[0], acting.gain)
        change, pull = driven(matrix, right, acting.drive, acting.gain, inverse)
        given: Floats = (dynamics.joint_force + pull - acting.armature * change)[0]
        return given
