"""Joint drives of legs that stand on something: motors of the engine, solved with its contacts.

A drive that is predicted with the contact forces of the last step lags behind them, on a leg of
a gram by many steps, and a body on lagging springs swings up. The engine's velocity motor is solved
together with the contacts of the step itself. Its largest force is the drive's, its speed the one
at which the drive's force would vanish: under load it is the drive's force, and a light leg that
nothing holds moves as the drive lets it, at any gain.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.backend import Dynamics
from seals.plugins.backends.pybullet.loading import Loaded

LEAP = 0.2
"""Time in the air for which the motors go on [s]: a leap, no free flight."""
_FORCE, _VELOCITY = 3, 11
"""Places of the motor's force in the engine's state of a joint, and of its limit in the joint's
data."""


class StandingMotors:
    """Velocity motors of all joints of one robot, switched on while its feet touch.

    Args:
        engine: the pybullet module.
        client: physics client.
        loaded: the robot in the engine.
        ordered: puts values of the joints into the engine's order.

    Attributes:
        running: whether the motors are on.
        forces: of the motors over the last step [N m or N], shape (J,).
    """

    def __init__(
        self, engine: Any, client: int, loaded: Loaded, ordered: Callable[[Floats], list[float]]
    ) -> None:
        """Keep the engine."""
        self._p, self._client, self._loaded = engine, client, loaded
        self._ordered, self._back = ordered, np.argsort(loaded.order).tolist()
        # where the URDF gives no velocity there is no limit
        table = [engine.getJointInfo(loaded.body, k, physicsClientId=client) for k in loaded.joints]
        stated = np.array([table[k][_VELOCITY] for k in self._back])
        self._fastest = np.where(stated > 0.0, stated, np.inf)
        self._none = np.zeros(len(loaded.joints))
        self.running, self.forces = False, self._none
        self._idle = 0.0

    def wanted(self, touching: bool, step: float) -> bool:
        """Return whether the motors shall act: while feet touch, and over short leaps.

        Args:
            touching: whether a foot touched something in the last step.
            step: h [s].
        """
        self._idle = 0.0 if touching else self._idle + step
        return touching or (self.running and self._idle < LEAP)

    def drive(self, dynamics: Dynamics, step: float) -> None:
        """Let the motors act over the next step as the joint drive wants it.

        Equation:
            f the drive's force; largest force of the motor min(|f|, limit), its speed
            v + f / (kd + h kp), not beyond the velocity that the URDF gives the joint.

        Args:
            dynamics: of the robot at the current time; with a joint drive.
            step: h [s].
        """
        drive = dynamics.joint_drive
        assert drive is not None
        rates = dynamics.moving.speed[0, -drive.force.shape[1] :]
        force = drive.force[0]
        slope = np.maximum(drive.damping + step * drive.stiffness, 1e-12)
        speed = np.ravel(rates + force / slope)
        speed = np.minimum(np.maximum(speed, -self._fastest), self._fastest)
        self._set(speed, np.ravel(np.minimum(np.abs(force), drive.limit)))
        self.running = True

    def hear(self, states: Any) -> None:
        """Take note of the engine's states of the joints after a step."""
        if self.running:
            self.forces = np.array([states[k][_FORCE] for k in self._back])

    def rest(self) -> None:
        """Switch the motors off."""
        if self.running:
            self._set(self._none, self._none)
            self.running, self.forces = False, self._none

    def snapshot(self) -> Any:
        """Return whether they run, and their forces."""
        return self.running, self.forces, self._idle

    def restore(self, kept: Any) -> None:
        """Put a snapshot back; what the engine holds is set before the next step."""
        # the engine may hold motors that ran when the snapshot was put back
        ran, (self.running, self.forces, self._idle) = self.running, kept
        if ran and not self.running:
            self._set(self._none, self._none)

    def _set(self, speed: Floats, force: Floats) -> None:
        self._p.setJointMotorControlArray(
            self._loaded.body,
            self._loaded.joints,
            self._p.VELOCITY_CONTROL,
            targetVelocities=self._ordered(speed),
            forces=self._ordered(force),
            physicsClientId=self._client,
        )
