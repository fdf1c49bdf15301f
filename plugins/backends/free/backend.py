"""Backend ``free``: scene of robots without contacts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from seals.backend import RigidBody
from seals.environment.settings import EnvironmentSettings
from seals.field_roles import roles
from seals.plugins.backends.free.body import FreeBody
from seals.robot.model import RobotModel


@roles(data="passable")
@dataclass(kw_only=True)
class BackendFree:
    """Rigid bodies with joints and servos by the equations of SEALS, without contacts.

    Equation:
        (sum J^T (I + A) J) a = forces, see `seals.multibody.equations`; velocities half a step back
        (leapfrog): v(t + h/2) = v(t - h/2) + h a(t), x(t + h) = x(t) + h v(t + h/2), and
        v(t + h) = v(t + h/2) + h a(t) / 2 where forces need it.

    Args:
        passable: whether a robot may go through the ground, and joints beyond their limits;
            otherwise the run ends there in words.

    Assumptions:
        Nothing touches anything: no ground, no obstacles, no other robots, no joint stops.

    Valid range:
        Free flight and motion in water, particle water included. Joints that stay off their limits.

    Limitations:
        Gripping, landing and walking need contacts: take ``backend=pybullet`` or
        ``backend=mujoco`` for them.

    References:
        Featherstone 2008, Rigid Body Dynamics Algorithms, for the equations; Hairer, Lubich and
        Wanner 2003, doi:10.1017/S0962492902000144, for the leapfrog method.

    Example:
        >>> BackendFree().passable
        False
    """

    passable: bool = False

    def __post_init__(self) -> None:
        """Keep the scene closed until `open`."""
        self._bodies: list[FreeBody] = []

    def open(self, environment: EnvironmentSettings, step: float) -> None:
        """Start an empty scene."""
        self._environment, self.step = environment, step
        self._bodies = []

    def add(self, robot: RobotModel) -> RigidBody:
        """Add a robot to the scene."""
        ground = None if self.passable else self._environment
        body = FreeBody(robot, ground=ground)
        self._bodies.append(body)
        return body

    def advance(self) -> None:
        """Advance the scene by one step."""
        for body in self._bodies:
            body.advance(self.step)

    def snapshot(self) -> Any:
        """Return the states of all bodies; they are immutable."""
        return [body.snapshot() for body in self._bodies]

    def restore(self, snapshot: Any) -> None:
        """Restore the scene to a snapshot."""
        for body, kept in zip(self._bodies, snapshot, strict=True):
            body.restore(kept)

    def store(self, path: Path) -> Any:
        """Write an empty marker file; return the states, which need no file."""
        path.write_bytes(b"")
        return self.snapshot()

    def recall(self, path: Path, bodies: Any) -> Any:
        """Return a snapshot from the result of `store`."""
        return bodies

    def close(self) -> None:
        """Release the bodies."""
        self._bodies = []
