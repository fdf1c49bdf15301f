"""Equations of motion of one free rigid body, in body axes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Array, as_like, column_of, columns, deciding, namespace, unasked
from seals.batch.state import Posture, Rates, TwinState
from seals.effects.evaluation import Evaluation, Evaluator
from seals.environment.settings import EnvironmentSettings
from seals.frames import cross, matrix_of, quaternion_rate, rotate
from seals.motion import Body, Inputs, Joints, Motion
from seals.multibody.linear import solve_symmetric
from seals.multibody.spatial import added_terms, kirchhoff
from seals.robot.model import RobotModel


class RigidBody:
    """Newton-Euler equations of a free body with added inertia (Kirchhoff), about the base origin.

    Args:
        robot: a robot of one link.
        evaluator: of its effects.
        bodies: constant properties of its link.
        environment: gravity.
        change: of the rigid inertia about the origin, shape (1 or B, 6, 6); None for none.
    """

    links = 1

    def __init__(
        self,
        robot: RobotModel,
        evaluator: Evaluator,
        bodies: Body,
        environment: EnvironmentSettings,
        change: Array | None = None,
    ) -> None:
        self.evaluator, self.bodies, self.gravity = evaluator, bodies, environment.gravity
        self._inertia = as_like(robot.spatial_inertia[:1], bodies.mass)
        if change is not None:
            self._inertia = self._inertia + change
        self._used = set(pattern(self._inertia))

    def posture(self, state: TwinState, time: Any) -> Posture:
        """Return poses and velocities at a state."""
        rotation = matrix_of(state.quaternion)
        motion = Motion(
            time=column_of(time, self.bodies.mass),
            position=state.position,
            rotation=rotation,
            up=rotation[:, 2, :],
            velocity=state.velocity,
            angular_velocity=state.angular_velocity,
            body=self.bodies,
        )
        return Posture(rotation, motion)

    def rates(
        self,
        state: TwinState,
        time: Any,
        inputs: Inputs,
        memory: Mapping[str, Array],
        posture: Posture | None = None,
    ) -> tuple[Rates, dict[str, Array]]:
        """Return the time derivative of the state and the new memory."""
        rates, found = self.evaluated(state, time, inputs, memory, posture)
        return rates, found.memory

    def evaluated(
        self,
        state: TwinState,
        time: Any,
        inputs: Inputs,
        memory: Mapping[str, Array],
        posture: Posture | None = None,
    ) -> tuple[Rates, Evaluation]:
        """Return the time derivative of the state and the effects behind it."""
        posture = self.posture(state, time) if posture is None else posture
        rotation = posture.base
        motion = posture.motion._replace(body=self.bodies)
        found = self.evaluator.evaluate(
            motion, Joints(state.joints, state.joint_velocity), inputs, memory, posture.sample
        )
        force, torque = self._right_side(motion, found)
        linear, angular = self._accelerations(found, force, torque)
        felt = (
            linear
            + cross(state.angular_velocity, state.velocity)
            + rotation[:, 2, :] * self.gravity
        )
        rates = Rates(
            position=rotate(rotation, state.velocity),
            quaternion=quaternion_rate(state.quaternion, state.angular_velocity),
            velocity=linear,
            angular_velocity=angular,
            joints=state.joint_velocity,
            joint_velocity=state.joint_velocity,
            specific_force=felt,
        )
        return rates, found

    def _right_side(self, motion: Motion, found: Evaluation) -> tuple[Array, Array]:
        """Effects' wrenches less the velocity-dependent terms of body and added inertia."""
        force, torque = kirchhoff(self._inertia, motion.velocity, motion.angular_velocity)
        force, torque = -force, -torque
        for _, _, wrench in found.loads:
            if wrench.force is not None:
                force = force + wrench.force
            if wrench.torque is not None:
                torque = torque + wrench.torque
        for _, _, added, medium in found.inertias:
            more = added_terms(added, medium, motion)
            force, torque = force - more[0], torque - more[1]
        return force, torque

    def inertia_with(self, found: Evaluation) -> Array:
        """Inertia of the body with the added ones, shape (B, 6, 6)."""
        batch = found.sample.normal.shape[0] // self.links
        total = self._inertia + namespace(self._inertia).zeros((batch, 1, 1))
        for weight, matrix in self._added(found):
            total = total + weight[:, :, None] * matrix
        return total

    def _added(self, found: Evaluation) -> list[tuple[Array, Array]]:
        """Weights (B, 1) and matrices about the origin of all added inertias."""
        return [(added.weight, added.matrix) for _, _, added, _ in found.inertias]

    def _accelerations(self, found: Evaluation, force: Array, torque: Array) -> tuple[Array, Array]:
        """Solve (M + sum s M_A) (v', w') = (force, torque)."""
        matrix = [
            [self._inertia[:, i, j] if (i, j) in self._used else None for j in range(i + 1)]
            for i in range(6)
        ]
        for weight, more in self._added(found):
            for i, j in self._filled(more):
                before, part = matrix[i][j], weight[:, 0] * more[:, i, j]
                matrix[i][j] = part if before is None else before + part
        right = [force[:, k] for k in range(3)] + [torque[:, k] for k in range(3)]
        x = solve_symmetric(matrix, right)
        return columns(*x[:3]), columns(*x[3:])

    def _filled(self, matrix: Array) -> list[tuple[int, int]]:
        """Entries of an added inertia that are nonzero anywhere; on an accelerator, all of them."""
        return FULL if unasked(matrix) else pattern(matrix)


FULL = [(i, j) for i in range(6) for j in range(i + 1)]
"""All entries of the lower triangle."""


def pattern(matrix: Array) -> list[tuple[int, int]]:
    """Return the diagonal and all other nonzero entries of the lower triangle in the batch.

    All of them where a law is followed (`seals.arrays.undecided`).
    """
    if not deciding():
        return FULL
    xp = namespace(matrix)
    table = np.asarray(xp.any(matrix != 0.0, axis=0).tolist(), dtype=bool)
    return [(i, j) for i in range(6) for j in range(i + 1) if i == j or table[i, j]]
