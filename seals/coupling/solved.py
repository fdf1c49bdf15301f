"""Loads for an engine that solves added inertia and joint drives together with contacts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.backend import Dynamics, LinksAt
from seals.coupling.engine import (
    CompiledSolving,
    Contacts,
    ImplicitDrive,
    SolvingEngineBody,
    generalised,
    generalised_inertia,
)
from seals.frames import cross_last, skew_last
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
    foretells = False
    """The engine solves for the accelerations that loads depend on."""

    def __init__(self, engine: SolvingEngineBody, robot: RobotModel) -> None:
        self._engine: Any = engine
        self._centred = not np.any(engine.reference)
        self._added = Assembly(np.zeros((1, len(robot.links), 6, 6)))
        self._outer = np.zeros(robot.tree.joints)
        self._given: Floats | None = self._outer

    def forget(self) -> None:
        """Forget the last step."""
        self._given = np.zeros_like(self._outer)

    def joint_forces(self) -> Floats:
        """Return the forces on the joints over the last step [N m or N], shape (J,)."""
        if self._given is None:
            self._given = self._outer + self._engine.drive_forces()
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
        """Pass wrenches, inertia, joint forces and drives on, see `PredictedForces.apply`."""
        d = dynamics
        wrench, _, inertia = self._loads(d)
        engine.apply_wrenches(wrench, d.kinematics.origins[0], d.kinematics.rotations[0])
        engine.add_inertia(inertia)
        self._outer = d.joint_force[0]
        if joints.size:
            engine.apply_joint_forces(self._outer)
            engine.drive_joints(acting)

    def _loads(self, dynamics: Dynamics) -> tuple[Array, Array | None, Array | None]:
        """Wrenches (L, 6); where inertia is added also the Jacobian, and added inertia (n, n)."""
        d, jacobian, inertia = dynamics, None, None
        wrench = d.wrench[0]
        if not all(weightless(added) for _, _, added, _ in d.found.inertias):
            matrices = self._added.total_inertia(d.found, 1)[0]
            terms = self._added.velocity_terms(d.motion, d.found)[0]
            jacobian, bias = self._about_reference(d)
            wrench = wrench - terms - namespace(bias).matmul(matrices, bias[:, :, None])[:, :, 0]
            inertia = generalised_inertia(matrices, jacobian)
        return wrench, jacobian, inertia

    def compile(self, *, inertial: bool) -> None:
        """Do nothing: one law for all robots."""

    def compiled_form(self, step: float, *, driven: bool, contacts: Contacts) -> str:
        """Return how the loads of the next step are computed: with drives or without."""
        return "driven" if driven else "plain"

    def compiled_arguments(self, contacts: Contacts) -> tuple[Floats, ...]:
        """Return nothing: all is known."""
        return ()

    def compiled_law(
        self, form: str, dynamics: Dynamics, step: float, acting: ImplicitDrive | None
    ) -> list[Array]:
        """Return joint forces (J,), and what the engine's `compiled_law` returns; pure."""
        wrench, jacobian, inertia = self._loads(dynamics)
        if jacobian is None:
            jacobian = self._about_reference(dynamics)[0]
        force, outer = generalised(jacobian, wrench), dynamics.joint_force[0]
        rotation = dynamics.kinematics.rotations[0, 0]
        return [outer, *self._engine.compiled_law(rotation, force, outer, inertia, acting)]

    def give(self, form: str, results: list[Floats], links: LinksAt) -> bool:
        """Pass results of `compiled_law` to the engine, and return true."""
        self._outer, *own = results
        self._engine.give(own)
        return True

    def steps_alone(self) -> bool:
        """Return whether the engine can be stepped by a program, see `CompiledSolving`."""
        return isinstance(self._engine, CompiledSolving) and self._engine.steps_alone()

    def write_step(
        self,
        program: Any,
        loads: Sequence[tuple[Any, int]],
        origin: Any,
        beside: Sequence[tuple[Any, Sequence[tuple[Any, int]]]],
        *,
        touching: bool,
    ) -> tuple[Any, int] | None:
        """Write a step of the engine, see `CompiledSolving`."""
        found: tuple[Any, int] | None = self._engine.write_step(
            program, loads, beside, touching=touching
        )
        return found

    def note(self, forces: Floats, kick: Floats, step: float) -> None:
        """Note the forces on the joints over the last step, see `joint_forces`."""
        self._given = forces

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
        xp = namespace(bias)
        lever = skew_last(d.kinematics.rotations[0, 0] @ self._engine.reference)
        spin = d.moving.speed[0, 3:6]
        # w x (w x r) = -w x (r x w)
        turning = cross_last(spin, lever @ spin)
        linear, angular = jacobian[:, :, :3], jacobian[:, :, 3:6]
        parts = (linear, angular + linear @ lever, jacobian[:, :, 6:])
        return xp.concat(parts, axis=2), bias + linear @ turning

    def measure(self) -> None:
        """Note that there was a step: its drive forces are found when they are asked for."""
        self._given = None if self._outer.size else self._outer

    def moved(self, kick: Floats, step: float) -> None:
        """Do nothing: no prediction from the last step is needed."""

    def snapshot(self) -> Any:
        """Return the state outside the engine."""
        return self.joint_forces()

    def restore(self, kept: Any) -> None:
        """Restore a snapshot."""
        self._given = kept
