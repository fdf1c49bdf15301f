"""Armature (drive inertia) for a rigid-body engine that does not model it."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.backend import Dynamics, RigidBody
from seals.multibody.equations import Assembly
from seals.robot.model import RobotModel


class GearedBody:
    """Body whose joint torques are reduced by the part that accelerates the drives.

    Equation:
        (M + I) a = f is what the robot obeys, with I the drives' inertia on the joints; the engine
        solves M a = f - I a, with a from the full equations.

    Args:
        body: in the engine.
        robot: with the inertia of its drives.
    """

    def __init__(self, body: RigidBody, robot: RobotModel) -> None:
        """Keep the body; everything but `apply` is its own."""
        self._body, self.robot = body, robot
        self._inertia = np.asarray(robot.tree.drive_inertia, dtype=float)
        self._assembly = Assembly(robot.spatial_inertia[None], self._inertia)

    def apply(self, dynamics: Dynamics, step: float) -> None:
        """Apply the loads on the robot, less the torque that accelerates its drives."""
        d = dynamics
        change = self._assembly.accelerations(
            d.kinematics, d.moving, d.motion, d.found, d.joint_force
        )
        taken = self._inertia * change[:, -len(self._inertia) :]
        self._body.apply(d._replace(joint_force=d.joint_force - taken), step)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._body, name)
