"""Joint drives of standing legs as engine motors, solved together with contacts.

A drive that is predicted with the contact forces of the last step lags behind them, on a leg of
a gram by many steps, and a body on lagging springs swings up. An engine's velocity motor is solved
together with the contacts of the step itself. Its largest force is the drive's, its speed the one
at which the drive's force would vanish: under load it is the drive's force, and a light leg that
nothing holds moves as the drive lets it, at any gain.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.backend import Dynamics
from seals.coupling.engine import EngineBody

LEAP = 0.2
"""Time in the air for which the motors go on [s]: a leap, no free flight."""


class StandingMotors:
    """Velocity motors of all joints of one robot, active while its feet are in contact.

    Args:
        engine: the robot in the engine.
        joints: number of joints.

    Attributes:
        running: whether the motors are on.
        forces: of the motors over the last step [N m or N], shape (J,).
    """

    def __init__(self, engine: EngineBody, joints: int) -> None:
        self._engine = engine
        self._none = np.zeros(joints)
        self.running, self.forces = False, self._none
        self._idle = 0.0

    def wanted(self, touching: bool, step: float) -> bool:
        """Return whether the motors are active: with feet in contact, and in short flight phases.

        Args:
            touching: whether a foot touched something in the last step.
            step: h [s].
        """
        self._idle = 0.0 if touching else self._idle + step
        return touching or (self.running and self._idle < LEAP)

    def drive(self, dynamics: Dynamics, step: float) -> None:
        """Set the motors of the next step from the joint drive.

        Equation:
            f the drive's force; largest force of the motor min(|f|, limit), its speed
            v + f / (kd + h kp), not beyond the largest speed of the joint.

        Args:
            dynamics: of the robot at the current time; with a joint drive.
            step: h [s].
        """
        self.set(*self.targets(dynamics, step))

    def targets(self, dynamics: Dynamics, step: float) -> tuple[Array, Array]:
        """Return speeds [rad/s or m/s] and largest forces [N m or N], shape (J,); pure."""
        drive = dynamics.joint_drive
        assert drive is not None
        xp = namespace(drive.force)
        rates = dynamics.moving.speed[0, -drive.force.shape[1] :]
        force, fastest = drive.force[0], self._engine.joint_speed_limit
        slope = xp.maximum(drive.damping + step * drive.stiffness, 1e-12)
        speed = (rates + force / slope).reshape(-1)
        speed = xp.minimum(xp.maximum(speed, -fastest), fastest)
        return speed, xp.minimum(xp.abs(force), drive.limit).reshape(-1)

    def set(self, speed: Floats, force: Floats) -> None:
        """Set the motors of the next step, see `targets`."""
        self._engine.set_motors(speed, force)
        self.running = True

    def measure(self) -> None:
        """Record the motor forces after a step."""
        if self.running:
            self.forces = self._engine.motor_forces()

    def rest(self) -> None:
        """Switch the motors off."""
        if self.running:
            self._engine.set_motors(self._none, self._none)
            self.running, self.forces = False, self._none

    def snapshot(self) -> Any:
        """Return whether the motors are active, and their forces."""
        return self.running, self.forces, self._idle

    def restore(self, kept: Any) -> None:
        """Restore a snapshot; the engine's motors are set before the next step."""
        # the engine may hold motors that ran when the snapshot was put back
        ran, (self.running, self.forces, self._idle) = self.running, kept
        if ran and not self.running:
            self._engine.set_motors(self._none, self._none)
