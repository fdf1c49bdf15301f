"""Loads for an engine that solves added inertia and joint drives together with contacts."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.backend import Dynamics
from seals.coupling.contacts import Contacts
from seals.coupling.engine import SolvingEngineBody
from seals.coupling.implicit_drive import ImplicitDrive
from seals.multibody.equations import Assembly, weightless
from seals.robot.model import RobotModel


class SolvedForces:
    """Loads of one robot: added inertia as generalised inertia, joint drives with gain and limit.

    Equation:
        (M + J^T A J) a = J^T (wrench - A b - velocity terms of A) + what the engine knows, with A
        the added inertia of the links, J their Jacobian and b their twists' rate at a = 0.

    Args:
        engine: the robot in the engine.
        robot: its model.
    """

    running = False
    """No motors of the engine act."""

    def __init__(self, engine: SolvingEngineBody, robot: RobotModel) -> None:
        """Start at rest."""
        self._engine = engine
        self._centred = not np.any(engine.reference)
        self._added = Assembly(np.zeros((1, len(robot.links), 6, 6)))
        self._outer = np.zeros(robot.tree.joints)
        self._given = self._outer

    def forget(self) -> None:
        """Forget the last step."""
        self._given = np.zeros_like(self._outer)

    def joint_forces(self) -> Floats:
        """Return the forces on the joints over the last step [N m or N], shape (J,)."""
        return self._given

    def apply(
        self,
        engine: Any,
        dynamics: Dynamics,
        step: float,
        *,
        acting: ImplicitDrive | None,
        contacts: Contacts,
        joints: Floats,
    ) -> None:
        """Pass wrenches, inertia, joint forces and drives of the next step to the engine.

        Args:
            engine: the robot in the engine.
            dynamics: of the robot at the current time.
            step: h [s].
            acting: the joint drives over the step; None for none.
            contacts: of the last step.
            joints: positions [rad or m], shape (J,).
        """
        d, inertia = dynamics, None
        wrench: Floats = d.wrench[0]
        if not all(weightless(added) for _, _, added, _ in d.found.inertias):
            matrices = self._added.total_inertia(d.found, 1)[0]
            terms = self._added.velocity_terms(d.motion, d.found)[0]
            jacobian, bias = self._about_reference(d)
            wrench = wrench - terms - np.matmul(matrices, bias[:, :, None])[:, :, 0]
            inertia = _generalised(matrices, jacobian)
        engine.apply_wrenches(wrench, d.kinematics.origins[0], d.kinematics.rotations[0])
        engine.add_inertia(inertia)
        self._outer = d.joint_force[0]
        if joints.size:
            engine.apply_joint_forces(self._outer)
            engine.drive_joints(acting)

    def _about_reference(self, dynamics: Dynamics) -> tuple[Floats, Floats]:
        """Jacobian (L, 6, n) and bias (L, 6) of the twists for the engine's velocity.

        Equation:
            With r from the base origin to the engine's point, v_o = v + r x w, so that at zero
            acceleration of the engine's velocity the base origin has -w x (w x r).
        """
        d = dynamics
        jacobian, bias = d.kinematics.jacobian[0], d.kinematics.bias(d.moving)[0]
        if self._centred:
            return jacobian, bias
        a, b, c = (d.kinematics.rotations[0, 0] @ self._engine.reference).tolist()
        lever = np.array([[0.0, -c, b], [c, 0.0, -a], [-b, a, 0.0]])
        spin = d.moving.speed[0, 3:6]
        # w x (w x r) = -w x (r x w)
        x, y, z = spin.tolist()
        u, v, w = (lever @ spin).tolist()
        turning = np.array([y * w - z * v, z * u - x * w, x * v - y * u])
        moved = jacobian.copy()
        moved[:, :, 3:6] += jacobian[:, :, :3] @ lever
        return moved, bias + jacobian[:, :, :3] @ turning

    def measure(self) -> None:
        """Record the drive forces after a step."""
        self._given = self._outer
        if self._outer.size:
            self._given = self._outer + self._engine.drive_forces()

    def moved(self, change: Floats) -> None:
        """Do nothing: no prediction from the last step is needed."""

    def snapshot(self) -> Any:
        """Return the state outside the engine."""
        return self._given

    def restore(self, kept: Any) -> None:
        """Restore a snapshot."""
        self._given = kept


def _generalised(matrices: Floats, jacobian: Floats) -> Floats:
    """Sum of J^T A J over the links: A (L, 6, 6), J (L, 6, n), result (n, n)."""
    size = jacobian.shape[2]
    rows = np.matmul(matrices, jacobian).reshape(-1, size)
    total: Floats = jacobian.reshape(-1, size).T @ rows
    return total
