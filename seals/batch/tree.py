"""Equations of motion of a robot with joints or a fixed base."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Array, Floats, as_like, column_of, namespace
from seals.batch.state import Posture, Rates, TwinState
from seals.effects.evaluation import Evaluation, Evaluator
from seals.effects.joint_inertia import armature_of
from seals.environment.settings import EnvironmentSettings
from seals.frames import MANY, cross, matrix_of, quaternion_rate, rotate, unrotate
from seals.motion import Body, Inputs, Joints
from seals.multibody.equations import Assembly
from seals.multibody.kinematics import Kinematics, by_batch, link_motion
from seals.multibody.linear import ChangedLead, Factors
from seals.multibody.servo import driven, resisted
from seals.multibody.tree import forward
from seals.robot.model import RobotModel


def solved(matrix: Array, right: Array) -> Array:
    """Solve for each twin of a batch; NaN for one whose state has diverged, as in a fit.

    Args:
        matrix: generalised inertia, shape (B, N, N).
        right: shape (B, N).

    Example:
        >>> solved(np.stack([np.eye(2), np.zeros((2, 2))]), np.ones((2, 2))).tolist()
        [[1.0, 1.0], [nan, nan]]
    """
    try:
        return namespace(right).linalg.solve(matrix, right[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:
        found = np.full(np.shape(right), np.nan)
        for k in range(len(found)):
            with contextlib.suppress(np.linalg.LinAlgError):
                found[k] = np.linalg.solve(matrix[k], right[k])
        return found


class TreeBody:
    """Projected Newton-Euler equations of a tree of links with added inertia.

    Args:
        robot: the robot.
        evaluator: of its effects.
        bodies: constant properties of its links, rows link by link.
        environment: gravity.
        change: of the rigid inertias about the origins, rows link by link, shape (L B, 6, 6); None
            for none.
    """

    def __init__(
        self,
        robot: RobotModel,
        evaluator: Evaluator,
        bodies: Body,
        environment: EnvironmentSettings,
        change: Array | None = None,
    ) -> None:
        self.robot, self.evaluator, self.bodies = robot, evaluator, bodies
        self.gravity, self.tree = environment.gravity, robot.tree
        inertia = as_like(robot.spatial_inertia, bodies.mass)[None]
        if change is not None:
            inertia = inertia + by_batch(change, len(robot.links))
        drives = armature_of(evaluator.effects, robot)
        armature = None if drives is None else as_like(drives, bodies.mass)
        self.assembly = Assembly(inertia, armature)
        self._factors: tuple[Floats, Factors | ChangedLead] | None = None

    def rates(
        self,
        state: TwinState,
        time: Any,
        inputs: Inputs,
        memory: Mapping[str, Array],
        posture: Posture | None = None,
    ) -> tuple[Rates, dict[str, Array]]:
        """Return the time derivative of the state and the new memory."""
        posture = self.posture(state, time) if posture is None else posture
        found, (matrix, right) = self.system(state, posture, inputs, memory, explicit=True)
        if type(matrix) is np.ndarray and len(matrix) >= MANY:
            change = self.factors(posture, matrix).solve(right)
        else:
            change = solved(matrix, right)
        return self.state_rates(state, posture.base, change), found.memory

    def factors(self, posture: Posture, matrix: Floats) -> Factors | ChangedLead:
        """Return the factors of the generalised inertia of a batch, kept while it stays."""
        if self._factors is None or self._factors[0] is not matrix:
            self._factors = matrix, self.assembly.factors(posture.kinematics, matrix)
        return self._factors[1]

    def stage(
        self,
        state: TwinState,
        time: Any,
        inputs: Inputs,
        memory: Mapping[str, Array],
        *,
        ahead: Any,
        before: Rates | None = None,
        posture: Posture | None = None,
    ) -> tuple[Rates, dict[str, Array]]:
        """Return a stage of `seals.batch.state.rosenbrock`, implicit in the joint drives.

        Equation:
            (1 - ahead A) k = F - 2 before, with A the slopes of the drives in joint position and
            rate: q' part k = F + ahead k', and the rest as in `seals.multibody.servo.driven`.

        Args:
            state: at which F is taken.
            time: [s].
            inputs: from outside the physics.
            memory: of the effects.
            ahead: gamma h [s], a number or an array (B, 1).
            before: first stage, None for none.
            posture: at the state, where it is known.
        """
        posture = self.posture(state, time) if posture is None else posture
        found, (matrix, right) = self.system(state, posture, inputs, memory, explicit=False)
        if found.resistance is not None:
            known = None if before is None else 2.0 * before.joint_velocity
            matrix, right = resisted(matrix, right, found.resistance, ahead, known)
        drive = found.joint_drive
        if drive is None:
            change = namespace(matrix).linalg.solve(matrix, right[:, :, None])[:, :, 0]
            return self._staged(state, posture, change, ahead, before), found.memory
        gain = ahead * drive.damping + ahead * ahead * drive.stiffness + state.joint_velocity * 0.0
        rate = (
            state.joint_velocity if before is None else state.joint_velocity - 2.0 * before.joints
        )
        force = drive.force - ahead * drive.stiffness * rate
        if before is not None:
            force = force + 2.0 * gain * before.joint_velocity
        change, _ = driven(matrix, right, drive._replace(force=force), gain)
        return self._staged(state, posture, change, ahead, before), found.memory

    def _staged(
        self, state: TwinState, posture: Posture, change: Array, ahead: Any, before: Rates | None
    ) -> Rates:
        """Return k of a stage from its generalised acceleration."""
        k = self.state_rates(state, posture.base, change)
        if before is not None:
            k = Rates(*(a - 2.0 * b for a, b in zip(k, before, strict=True)))
        return k._replace(joints=k.joints + ahead * k.joint_velocity)

    def posture(self, state: TwinState, time: Any) -> Posture:
        """Return poses and velocities of all links at a state."""
        base = matrix_of(state.quaternion)
        kinematics = Kinematics(self.tree, *forward(self.tree, state.position, base, state.joints))
        return self._moving(base, kinematics, state, time)

    def _moving(self, base: Array, kinematics: Kinematics, state: TwinState, time: Any) -> Posture:
        """Velocities of all links at known poses."""
        world = rotate(base, state.velocity)
        spin = rotate(base, state.angular_velocity)
        lead = [] if self.tree.fixed_base else [world, spin]
        speed = namespace(state.position).concat([*lead, state.joint_velocity], axis=1)
        moving = kinematics.move(speed)
        motion = link_motion(kinematics, moving, column_of(time, self.bodies.mass), self.bodies)
        return Posture(base, motion, None, kinematics, moving)

    def system(
        self,
        state: TwinState,
        posture: Posture,
        inputs: Inputs,
        memory: Mapping[str, Array],
        *,
        explicit: bool,
    ) -> tuple[Evaluation, tuple[Array, Array]]:
        """Effects, and the equations of motion, with joint drives if explicit."""
        kinematics, moving = posture.kinematics, posture.moving
        assert kinematics is not None
        assert moving is not None
        motion = posture.motion._replace(body=self.bodies)
        joints = Joints(state.joints, state.joint_velocity)
        found = self.evaluator.evaluate(motion, joints, inputs, memory, posture.sample)
        still = namespace(joints.velocity).zeros_like(joints.velocity)
        joint_force = found.joint_force(still + inputs.joint_torque, driven=explicit)
        equations = self.assembly.equations(kinematics, moving, motion, found, joint_force)
        return found, equations

    def moved(self, posture: Posture, state: TwinState, time: Any) -> Posture:
        """Return the posture of a state that differs from a known one in velocities alone."""
        assert posture.kinematics is not None
        return self._moving(posture.base, posture.kinematics, state, time)

    def state_rates(self, state: TwinState, base: Array, change: Array) -> Rates:
        """Convert generalised accelerations (world) to the state derivative (base axes)."""
        up = base[:, 2, :]
        if self.tree.fixed_base:
            still = state.velocity * 0.0
            linear, angular, joints = still, still, change
        else:
            linear, angular = unrotate(base, change[:, 0:3]), unrotate(base, change[:, 3:6])
            joints = change[:, 6:]
        return Rates(
            position=rotate(base, state.velocity),
            quaternion=quaternion_rate(state.quaternion, state.angular_velocity),
            velocity=linear - cross(state.angular_velocity, state.velocity),
            angular_velocity=angular,
            joints=state.joint_velocity,
            joint_velocity=joints,
            specific_force=linear + up * self.gravity,
        )
