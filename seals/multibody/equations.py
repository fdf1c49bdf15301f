"""Projected Newton-Euler equations: generalised accelerations from the effects on all links.

Terms of many robots that outlast one evaluation at known poses are kept (`KeptTerms`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.frames import FEW
from seals.motion import AddedInertia, Medium, Motion, Wrench
from seals.multibody.composite import (
    RigidInertias,
    base_inertia,
    generalised_force,
    generalised_inertia,
)
from seals.multibody.kinematics import Kinematics, LinkVelocities, by_batch, crossed, take_motion
from seals.multibody.linear import ChangedLead, Factors, LeadFactors
from seals.multibody.servo import heavier
from seals.multibody.spatial import added_terms, kirchhoff


@dataclass(frozen=True, kw_only=True)
class KeptTerms:
    """Terms that depend on poses, velocities and rigid inertias alone, not on the loads.

    A fit evaluates a robot at the same poses with one set of parameters after another, and most of
    these change no inertia, or that of the base alone.

    Args:
        inertia: of the links about their origins, link axes, shape (1, L, 6, 6).
        rigid: the same in rigid-body form.
        armature: of the joint drives, shape (J,); None for none.
        matrix: generalised inertia, shape (B, n, n).
        moving: velocities of the links at which the loads hold.
        load: forces and torques of inertia on the links, link axes, shape (6, L, B).
    """

    inertia: Floats
    rigid: RigidInertias
    armature: Floats | None
    matrix: Floats
    moving: Any
    load: Floats

    @cached_property
    def factors(self) -> Factors:
        """Factors of the generalised inertia."""
        return Factors(self.matrix)

    @cached_property
    def _lead(self) -> LeadFactors | None:
        """Factors that stay when the base changes; None where the joints' inertia is indefinite."""
        try:
            return LeadFactors(self.matrix, 6)
        except np.linalg.LinAlgError:
            return None

    def factors_of(self, matrix: Floats, change: Floats) -> Factors | ChangedLead:
        """Return the factors of a generalised inertia that differs by that of the base alone.

        Args:
            matrix: shape (B, n, n).
            change: of its leading block, shape (B, 6, 6).
        """
        return Factors(matrix) if self._lead is None else self._lead.changed(change)

    def differing(self, inertia: Floats, armature: Floats | None) -> list[int] | None:
        """Return the links whose inertia differs; None where other terms do, too."""
        drives = np.zeros(0) if armature is None else armature
        own = np.zeros(0) if self.armature is None else self.armature
        if inertia.shape != self.inertia.shape or not np.array_equal(drives, own):
            return None
        return [int(k) for k in np.flatnonzero((inertia != self.inertia).any(axis=(0, 2, 3)))]


class _LinkLoads(Protocol):
    """Interface of evaluated effects: loads and added inertias of the links, by effect."""

    @property
    def loads(self) -> Sequence[tuple[Any, Any, Wrench]]:
        """Effect, rows and wrench about the link origins, link axes [N, N m]."""

    @property
    def inertias(self) -> Sequence[tuple[Any, Any, AddedInertia, Medium]]:
        """Effect, rows, added inertia and the medium relative to which it acts."""


class Assembly:
    """Assembly and solution of the generalised equations from link inertias and wrenches.

    Equation:
        (sum J^T (I + A) J) a = sum J^T (wrench - (I + A) b - Kirchhoff terms) + joint forces, with
        b the rate of the link twists at zero generalised acceleration.

    Args:
        inertia: of the links about their origins, link axes, shape (1 or B, L, 6, 6).
        armature: inertia of the drives about their joints [kg m^2 or kg], shape (J,); None for
            none.
    """

    def __init__(self, inertia: Array, armature: Array | None = None) -> None:
        self.inertia, self.armature = inertia, armature
        self.links = inertia.shape[1]
        self._kept: tuple[Kinematics, Array] | None = None
        self._changed: tuple[Floats, KeptTerms, Floats] | None = None

    def accelerations(
        self,
        kinematics: Kinematics,
        moving: LinkVelocities,
        motion: Motion,
        found: _LinkLoads,
        joint_force: Array,
    ) -> Array:
        """Return the generalised acceleration, shape (B, n).

        Args:
            kinematics: of the links.
            moving: velocities of the links.
            motion: of the links, rows link by link.
            found: outputs of the effects.
            joint_force: generalised force on the joints [N m or N], shape (B, J).
        """
        matrix, right = self.equations(kinematics, moving, motion, found, joint_force)
        return namespace(right).linalg.solve(matrix, right[:, :, None])[:, :, 0]

    def equations(
        self,
        kinematics: Kinematics,
        moving: LinkVelocities,
        motion: Motion,
        found: _LinkLoads,
        joint_force: Array,
    ) -> tuple[Array, Array]:
        """Return generalised inertia (B, n, n) and force (B, n), see `accelerations`."""
        added = any(not weightless(i[2]) for i in found.inertias)
        # composite bodies serve rigid inertias alone: added ones differ from axis to axis
        if kinematics.many and not added and self._rigid is not None:
            return self._composed(kinematics, moving, found, joint_force)
        xp = namespace(moving.speed)
        force = self.wrenches(motion, found) - self.velocity_terms(motion, found)
        total = self.total_inertia(found, moving.speed.shape[0])
        force = force - xp.matmul(total, kinematics.bias(moving)[:, :, :, None])[:, :, :, 0]
        return self.system(kinematics, total, force, joint_force)

    def factors(self, kinematics: Kinematics | None, matrix: Floats) -> Factors | ChangedLead:
        """Return the factors of a generalised inertia of `equations`, of many robots."""
        kept = None if kinematics is None else kinematics.kept
        if kept is not None and kept.matrix is matrix:
            return kept.factors
        if self._changed is not None and self._changed[0] is matrix:
            return self._changed[1].factors_of(matrix, self._changed[2])
        return Factors(matrix)

    @cached_property
    def _rigid(self) -> RigidInertias | None:
        """Return the inertias in rigid-body form; None if they are not rigid."""
        return RigidInertias.of(self.inertia)

    def _composed(
        self, kinematics: Kinematics, moving: LinkVelocities, found: _LinkLoads, joint_force: Floats
    ) -> tuple[Floats, Floats]:
        """Return the same for many robots without added inertia, by composite bodies."""
        matrix, load = self._inertial(kinematics, moving)
        rows = load.reshape(6, -1)
        for _, chosen, wrench in found.loads:
            at = slice(None) if chosen is None else chosen
            if wrench.force is not None:
                rows[:3, at] += wrench.force.T
            if wrench.torque is not None:
                rows[3:, at] += wrench.torque.T
        right = generalised_force(kinematics, load)
        joints = joint_force.shape[1]
        right[:, right.shape[1] - joints :] += joint_force
        return matrix, right

    def _inertial(self, kinematics: Kinematics, moving: LinkVelocities) -> tuple[Floats, Floats]:
        """Generalised inertia, and the loads of inertia on the links, shape (6, L, B), to keep.

        What the first inertias at these poses gave serves all others that differ at the base alone.
        """
        rigid, kept = self._rigid, kinematics.kept
        assert rigid is not None
        differing = None if kept is None else kept.differing(self.inertia, self.armature)
        if (
            kept is None
            or differing is None
            or (differing and (differing != [0] or kinematics.tree.fixed_base))
        ):
            matrix = self._composite(kinematics)
            load = self._load(kinematics, moving, slice(None))
            if kept is None and len(self.inertia) == 1:
                kinematics.kept = KeptTerms(
                    inertia=self.inertia,
                    rigid=rigid,
                    armature=self.armature,
                    matrix=matrix,
                    moving=moving,
                    load=load.copy(),
                )
            return matrix, load
        matrix = kept.matrix
        if differing:
            matrix, change = matrix.copy(), base_inertia(kinematics, rigid.less(kept.rigid))
            matrix[:, :6, :6] += change
            self._changed = matrix, kept, change
        if kept.moving is not moving:
            return matrix, self._load(kinematics, moving, slice(None))
        load = kept.load.copy()
        if differing:
            load[:, :1] = self._load(kinematics, moving, slice(0, 1))
        return matrix, load

    def _composite(self, kinematics: Kinematics) -> Floats:
        """Generalised inertia of composite bodies, drives included, kept while poses stay."""
        if self._kept is None or self._kept[0] is not kinematics:
            assert self._rigid is not None
            matrix = generalised_inertia(kinematics, self._rigid)
            if self.armature is not None:
                matrix = heavier(matrix, self.armature[None])
            self._kept = kinematics, matrix
        return self._kept[1]

    def _load(self, kinematics: Kinematics, moving: LinkVelocities, links: slice) -> Floats:
        """Forces and torques of inertia on some links, link axes, shape (6, l, B)."""
        twist = moving.twists.T[:, links]
        # -(I b) - (w x p, w x L + v x p), with (p, L) = I (v, w): Newton-Euler in link axes
        load = -self._times(kinematics.bias(moving).T[:, links], links)
        momentum = self._times(twist, links)
        load[:3] -= crossed(twist[3:], momentum[:3])
        load[3:] -= crossed(twist[3:], momentum[3:]) + crossed(twist[:3], momentum[:3])
        return load

    def _times(self, twists: Floats, links: slice) -> Floats:
        """Products of the inertias of some links with their twists, both (6, l, B)."""
        inertia = self.inertia[:, links]
        if len(inertia) == 1:
            by_link: Floats = np.matmul(inertia[0], twists.transpose(1, 0, 2))
            return np.ascontiguousarray(by_link.transpose(1, 0, 2))
        rows = np.ascontiguousarray(twists.T)[:, :, :, None]
        return np.ascontiguousarray(np.matmul(inertia, rows)[:, :, :, 0].T)

    def system(
        self, kinematics: Kinematics, total: Array, force: Array, joint_force: Array
    ) -> tuple[Array, Array]:
        """Return generalised inertia (B, n, n) and force (B, n) under wrenches on the links."""
        xp = namespace(force)
        jacobian = kinematics.jacobian
        batch, links, _, size = jacobian.shape
        # the sum over links is part of the product when their rows stand below each other
        rows = (batch, 6 * links, size)
        across = xp.permute_dims(xp.reshape(jacobian, rows), (0, 2, 1))
        # without added inertia the matrix is that of the poses
        kept = self._kept if total is self.inertia else None
        if kept is not None and kept[0] is kinematics:
            matrix = kept[1]
        else:
            # M = sum J^T (I + A) J over the links
            matrix = xp.matmul(across, xp.reshape(xp.matmul(total, jacobian), rows))
            if self.armature is not None:
                matrix = heavier(matrix, self.armature[None])
            self._kept = (kinematics, matrix) if total is self.inertia and batch > 1 else None
        right = xp.matmul(across, xp.reshape(force, (batch, 6 * links, 1)))[:, :, 0]
        if joint_force.shape[1]:
            lead = right.shape[1] - joint_force.shape[1]
            # joints come last in the generalised force
            right = xp.concat((right[:, :lead], right[:, lead:] + joint_force), axis=1)
        return matrix, right

    def total_inertia(self, found: _LinkLoads, batch: int) -> Array:
        """Link inertias with the added ones, shape (1 or B, L, 6, 6)."""
        total = self.inertia
        for _, rows, added, _ in found.inertias:
            if weightless(added):
                continue
            matrix = added.weight[:, :, None] * added.matrix
            total = total + by_batch(self._everywhere(matrix, rows, batch), self.links)
        return total

    def wrenches(self, motion: Motion, found: _LinkLoads) -> Array:
        """Sum of the effects' wrenches, shape (B, L, 6)."""
        xp = namespace(motion.velocity)
        batch = motion.velocity.shape[0] // self.links
        zero = xp.zeros_like(motion.velocity)
        force, torque = zero, zero
        for _, rows, wrench in found.loads:
            if wrench.force is not None:
                force = force + self._everywhere(wrench.force, rows, batch)
            if wrench.torque is not None:
                torque = torque + self._everywhere(wrench.torque, rows, batch)
        return by_batch(xp.concat((force, torque), axis=1), self.links)

    def velocity_terms(self, motion: Motion, found: _LinkLoads) -> Array:
        """Kirchhoff terms of bodies and added inertias, shape (B, L, 6)."""
        xp = namespace(motion.velocity)
        batch = motion.velocity.shape[0] // self.links
        inertia = self.inertia[0]
        # one matrix for each link serves all of its rows, where there are many on NumPy
        alike = self.inertia.shape[0] == 1 and type(inertia) is np.ndarray and batch >= FEW
        if not alike and (batch > 1 or self.inertia.shape[0] > 1):
            each = xp.permute_dims(self.inertia, (1, 0, 2, 3))
            each = xp.broadcast_to(each, (self.links, batch, 6, 6))
            inertia = xp.reshape(each, (self.links * batch, 6, 6))
        force, torque = kirchhoff(inertia, motion.velocity, motion.angular_velocity)
        for _, rows, added, medium in found.inertias:
            if weightless(added):
                continue
            more = added_terms(added, medium, take_motion(motion, rows))
            force = force + self._everywhere(more[0], rows, batch)
            torque = torque + self._everywhere(more[1], rows, batch)
        return by_batch(xp.concat((force, torque), axis=1), self.links)

    def _everywhere(self, values: Array, rows: Any, batch: int) -> Array:
        """Expand values on some rows to all rows, zero elsewhere."""
        xp = namespace(values)
        count = self.links * batch
        if rows is None:
            return (
                values
                if values.shape[0] == count
                else values + xp.zeros((count, *values.shape[1:]), dtype=values.dtype)
            )
        return scatter(values, rows, count)


def weightless(added: AddedInertia) -> bool:
    """Return whether an added inertia is zero everywhere; False for arrays not of NumPy."""
    return type(added.weight) is np.ndarray and not added.weight.any()


def scatter(values: Array, rows: Any, count: int) -> Array:
    """Place values on ``rows`` (a slice or an index array) of ``count`` rows of zeros.

    Nothing is written in place beside NumPy, so that every array library can follow.
    """
    if type(values) is np.ndarray:
        out = np.zeros((count, *values.shape[1:]))
        out[rows] = values
        return out
    xp = namespace(values)
    index = np.arange(count)[rows]
    source, inside = np.zeros(count, dtype=np.int64), np.zeros(count)
    # rows outside take some row, and are multiplied by zero
    source[index] = np.arange(len(index)) if values.shape[0] > 1 else 0
    inside[index] = 1.0
    shape = (count, *(1 for _ in values.shape[1:]))
    device = getattr(values, "device", None)
    picked = xp.take(values, xp.asarray(source, device=device), axis=0)
    return picked * xp.asarray(inside.reshape(shape), dtype=values.dtype, device=device)
