"""Generalised inertia and force of many robots by composite bodies, without a Jacobian.

Whatever hangs on a joint moves as one body: its mass, first moment and inertia about the base
origin are sums over the links, and so is the wrench on it (composite-rigid-body algorithm,
Featherstone, Rigid Body Dynamics Algorithms, 2008, section 6.2; in axes of the world throughout).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.multibody.kinematics import Kinematics, crossed, turned

_ROUNDING = 1e-12
"""Share of an inertia matrix by which its entries may miss those of a rigid body."""


class RigidInertias(NamedTuple):
    """Inertias of links about their origins, link axes; one column for all or one for each robot.

    Args:
        mass: [kg], shape (L, 1 or B).
        moment: mass times centre [kg m], shape (3, L, 1 or B).
        inertia: [kg m^2], shape (3, 3, L, 1 or B).
    """

    mass: Floats
    moment: Floats
    inertia: Floats

    @classmethod
    def of(cls, matrix: Floats) -> RigidInertias | None:
        """Return the terms of inertia matrices (1 or B, L, 6, 6); None where one is not rigid."""
        # rigid body about its origin: [[m 1, -m c x], [m c x, J]], linear first (Featherstone 2008,
        # chapter 2 has angular first); the three entries of m c stand below each other's crosses
        by_entry = np.ascontiguousarray(matrix.transpose(2, 3, 1, 0))
        mass, moment = by_entry[0, 0], np.stack([by_entry[5, 1], by_entry[3, 2], by_entry[4, 0]])
        own = cls(mass, moment, by_entry[3:, 3:])
        rigid = np.zeros_like(by_entry)
        for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
            rigid[k, k] = mass
            rigid[3 + j, i] = rigid[i, 3 + j] = moment[k]
            rigid[3 + i, j] = rigid[j, 3 + i] = -moment[k]
        rigid[3:, 3:] = 0.5 * (own.inertia + own.inertia.transpose(1, 0, 2, 3))
        # added mass differs from axis to axis, and is no rigid body's: it needs the Jacobian
        gap = np.abs(rigid - by_entry).max()
        return own if gap <= _ROUNDING * np.abs(by_entry).max() else None

    def less(self, other: RigidInertias) -> RigidInertias:
        """Return the difference, term by term."""
        return RigidInertias(
            self.mass - other.mass, self.moment - other.moment, self.inertia - other.inertia
        )


def generalised_inertia(many: Kinematics, links: RigidInertias) -> Floats:
    """Return the generalised inertia, shape (B, n, n)."""
    tree, arm = many.tree, many.arm
    lead = 0 if tree.fixed_base else 6
    mass = np.broadcast_to(links.mass, arm.shape[1:]).copy()
    bodies = np.concatenate((turned(many.turn, links.moment), _turned(many.turn, links.inertia)))
    # parallel axes, from the link's origin to the base's at -r: J_kk grows by
    # 2 (r_i h_i + r_j h_j) + m (r_i^2 + r_j^2), J_ij falls by r_i h_j + r_j h_i + m r_i r_j;
    # the moment h = m c is still that about the link's origin
    half = bodies[:3] + 0.5 * mass * arm
    bodies[:3] += mass * arm
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        bodies[3 + k] += 2.0 * (arm[i] * half[i] + arm[j] * half[j])
        bodies[6 + k] -= arm[i] * half[j] + arm[j] * half[i]
    _folded(tree.parent, mass[None])
    _folded(tree.parent, bodies)
    size = lead + tree.joints
    out = np.zeros((size, size, arm.shape[2]))
    if lead:
        _base(out, mass[0], bodies[:, 0])
    motion, momentum = _joints(many, mass[tree.children], bodies[:, tree.children])
    for j, link in enumerate(tree.child):
        if lead:
            out[:6, lead + j] = out[lead + j, :6] = momentum[:, j]
        # H_ij = s_i . I_j s_j, I_j of all that hangs on j, for joints i between it and the base;
        # zero for joints of different branches
        for i in np.flatnonzero(tree.moves[link]).tolist():
            entry = (motion[:, i] * momentum[:, j]).sum(axis=0)
            out[lead + i, lead + j] = out[lead + j, lead + i] = entry
    return np.ascontiguousarray(out.transpose(2, 0, 1))


def base_inertia(many: Kinematics, links: RigidInertias) -> Floats:
    """Return the generalised inertia of the base alone, a free one, shape (B, 6, 6)."""
    turn = many.turn[:, :, :1]
    bodies = np.concatenate(
        (turned(turn, links.moment[:, :1]), _turned(turn, links.inertia[:, :, :1]))
    )
    out = np.zeros((6, 6, bodies.shape[2]))
    _base(out, links.mass[0], bodies[:, 0])
    return np.ascontiguousarray(out.transpose(2, 0, 1))


def generalised_force(many: Kinematics, load: Floats) -> Floats:
    """Return the generalised force of wrenches on the links, shape (B, n).

    Args:
        many: poses.
        load: forces and torques about the link origins, link axes, shape (6, L, B).
    """
    tree = many.tree
    force, torque = turned(many.turn, load[:3]), turned(many.turn, load[3:])
    torque += crossed(many.arm, force)
    _folded(tree.parent, force)
    _folded(tree.parent, torque)
    pull, push = force[:, tree.children], torque[:, tree.children]
    # a . (T - s x F) for a hinge at s, a . F for a slide, F and T of all that hangs on it
    push -= crossed(many.anchors, pull)
    if tree.sliding:
        push += tree.slides * (pull - push)
    joints = (many.hinges * push).sum(axis=0)
    lead = [] if tree.fixed_base else [force[:, 0], torque[:, 0]]
    force_of_all: Floats = np.concatenate([*lead, joints]).T
    return force_of_all


def _turned(turn: Floats, inertia: Floats) -> Floats:
    """Inertias in axes of the world: xx, yy, zz, then yz, zx, xy, shape (6, L, B)."""
    half = np.empty_like(turn)
    for k in range(3):
        half[:, k] = turned(turn, inertia[:, k])
    out = np.empty((6, *turn.shape[2:]))
    for k, (a, b) in enumerate(((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1))):
        out[k] = (half[a] * turn[b]).sum(axis=0)
    return out


def _folded(parent: tuple[int, ...], values: Floats) -> None:
    """Add to every link the inertia of its children, in place; links along the second axis."""
    # from the tips inwards: parents come before their children in the order of links
    for link in reversed(range(1, len(parent))):
        values[:, parent[link]] += values[:, link]


def _base(out: Floats, mass: Floats, body: Floats) -> None:
    """Fill in the inertia of the whole robot about the base origin."""
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        out[k, k], out[3 + k, 3 + k] = mass, body[3 + k]
        out[3 + j, i] = out[i, 3 + j] = body[k]
        out[3 + i, j] = out[j, 3 + i] = -body[k]
        out[3 + i, 3 + j] = out[3 + j, 3 + i] = body[6 + k]


def _joints(many: Kinematics, mass: Floats, bodies: Floats) -> tuple[Floats, Floats]:
    """Twists at the base origin by unit rates of the joints, and the momenta of what they move.

    Args:
        many: poses.
        mass: of what hangs on each joint, shape (J, B).
        bodies: its moment and inertia, shape (9, J, B).
    """
    slides, spin = many.tree.slides, many.hinges
    # the point of the turning body at the base origin moves with a x (0 - s) = s x a
    linear = crossed(many.anchors, spin)
    if many.tree.sliding:
        linear, spin = linear + slides * (spin - linear), spin * (1.0 - slides)
    moment, own, mixed = bodies[:3], bodies[3:6], bodies[6:]
    # p = m v + w x h, L = h x v + J w, about the base origin
    force = mass * linear + crossed(spin, moment)
    torque = crossed(moment, linear) + own * spin
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        torque[i] += mixed[k] * spin[j]
        torque[j] += mixed[k] * spin[i]
    return np.concatenate((linear, spin)), np.concatenate((force, torque))
