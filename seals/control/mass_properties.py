"""Mass properties and buoyancy of a robot at one instant, from the pose of its links."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Array, Floats, gathered, namespace, some
from seals.control.protocols import Buoyancy
from seals.environment.sample import Sample
from seals.frames import cross
from seals.multibody.kinematics import Kinematics, by_batch
from seals.multibody.tree import poses_in_base
from seals.robot.model import RobotModel


class MassNow(NamedTuple):
    """Mass properties of the whole robot at one instant, body axes; see `RobotState`."""

    mass: float
    centre: Floats
    inertia: Floats
    centre_map: Floats
    momentum_map: Floats


class MassPropertyEstimator:
    """Estimator of centre of gravity and inertia of a robot, and of their joint derivatives.

    Equation:
        With the transforms T_l of the links in body axes and their pseudo-inertias P_l (4x4: second
        moments S, first moments p, mass m), the sum of T P T^T over links holds mass, centre and
        second moments; the sum over the links beyond a joint with axis a through s gives
        dc/dq = a x (p - m s) / M and the momentum about the centre for a unit rate,
        (tr S - S) a - p x (a x s) - c x (a x (p - m s)).

    Args:
        robot: the robot.
    """

    def __init__(self, robot: RobotModel) -> None:
        tree = self._tree = robot.tree
        # rigid groups: the base, then the child link of every joint with all that is fixed to it
        self._group = np.array([0, *tree.child])
        self._pseudo = _grouped(robot, self._group.tolist())
        self._place = np.zeros((len(self._group), 4, 4))
        self._place[:, 3, 3] = 1.0
        self._sums = np.concatenate((np.ones((1, tree.links)), tree.moves.T))[:, self._group]
        self._slides = tree.slides
        self._sliding = bool(tree.slides.any())
        self._rigid = None if tree.joints else self.at(np.zeros(0))

    def at(self, joints: Floats) -> MassNow:
        """Return the mass properties at joint positions [rad or m]."""
        tree, group = self._tree, self._group
        origins, turns = poses_in_base(tree, joints)
        axes = (turns[group[1:]] @ tree.axis[:, :, None])[:, :, 0]
        return self._of(origins[group], turns[group], axes)

    def now(self, kinematics: Kinematics) -> MassNow:
        """Return the mass properties at one instant of one robot."""
        if self._rigid is not None:
            return self._rigid
        turns, origins = kinematics.rotations[0], kinematics.origins[0]
        turn = turns[0]
        arm = origins.take(self._group, axis=0) - origins[0]
        return self._of(
            arm @ turn, turn.T @ turns.take(self._group, axis=0), kinematics.axes[0] @ turn
        )

    def _of(self, origins: Array, turns: Array, axes: Array) -> MassNow:
        place = self._placed(origins, turns)
        # sums[0] is the whole robot, sums[1 + j] what lies beyond joint j
        parts = place @ self._pseudo @ place.transpose(0, 2, 1)
        sums = (self._sums @ parts.reshape(-1, 16)).reshape(-1, 4, 4)
        (a, b, c, x), (_, d, e, y), (_, _, f, z), (_, _, _, mass) = sums[0].tolist()
        # the second moments about the centre, then trace - S
        a, b, c, d = a - x * x / mass, b - x * y / mass, c - x * z / mass, d - y * y / mass
        e, f = e - y * z / mass, f - z * z / mass
        centre = gathered([x / mass, y / mass, z / mass], origins)
        inertia = gathered([[d + f, -b, -c], [-b, a + f, -e], [-c, -e, a + d]], origins)
        if not len(axes):
            return MassNow(mass, centre, inertia, np.zeros((3, 0)), np.zeros((3, 0)))
        push, spin = self._moved(sums[1:], axes, origins[1:], centre)
        return MassNow(mass, centre, inertia, push.T / mass, spin.T)

    def _placed(self, origins: Array, turns: Array) -> Array:
        """Transforms of the groups, shape (G, 4, 4)."""
        place = self._place
        if type(origins) is not np.ndarray:
            upper = np.concatenate((turns, origins[:, :, None]), axis=2)
            return np.concatenate((upper, namespace(origins).asarray(place[:, 3:])), axis=1)
        place[:, :3, 3], place[:, :3, :3] = origins, turns
        return place

    def _moved(
        self, beyond: Array, axes: Array, anchors: Array, centre: Array
    ) -> tuple[Array, Array]:
        """Return linear and angular momentum for a unit rate of every joint, shape (J, 3)."""
        first, mass = beyond[:, :3, 3], beyond[:, 3:, 3]
        count = len(axes)
        # a x (p - m s) is the momentum for a unit rate; v(r) = a x r - a x s, with the swing a x s
        levers = np.concatenate((first - mass * anchors, anchors))
        both = cross(np.concatenate((axes, axes)), levers)
        push, swing = both[:count], both[count:]
        trace = (beyond[:, 0, 0] + beyond[:, 1, 1] + beyond[:, 2, 2])[:, None]
        spin = trace * axes - (beyond[:, :3, :3] @ axes[:, :, None])[:, :, 0]
        if self._sliding:
            # a slide carries all alike along its axis, m a, and turns nothing
            slide = self._slides > 0.0
            push = np.where(slide, mass * axes, push)
            spin = np.where(slide, 0.0, spin)
            swing = np.where(slide, -axes, swing)
        # less c x push: the momentum about the centre of gravity; v @ about = c x v
        x, y, z = centre.tolist()
        about = gathered([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]], centre)
        return push, spin - cross(first, swing) - push @ about


def immersion(
    sample: Sample, volume: Array, gravity: float, places: Array, turns: Array
) -> tuple[Array, Buoyancy]:
    """Return submerged share of all hulls' volume [1], shape (B, 1), and their buoyancy.

    Args:
        sample: at the links, rows link by link.
        volume: displaced by every link when submerged [m^3], rows link by link or one.
        gravity: [m/s^2].
        places: origins of the links in the base [m], shape (1 or B, L, 3).
        turns: rotations of the links in the base, shape (1 or B, L, 3, 3).
    """
    xp, links = namespace(sample.submersion), turns.shape[1]
    none, share = sample.normal[:, 0:1] * 0.0, volume * sample.submersion
    if not some(share > 0.0):
        dry = by_batch(none, links)[:, 0]
        return dry, Buoyancy(dry, by_batch(sample.normal, links)[:, 0] * 0.0)
    # volume, wet volume, and mass of the displaced water [m^3, m^3, kg]
    rows = none + volume, none + share, none + share * sample.water_density
    whole, wet, weight = (by_batch(x, links) for x in rows)
    centres = by_batch(none + sample.buoyancy_centre, links)
    centres = xp.matmul(turns, centres[:, :, :, None])[:, :, :, 0] + places
    whole, wet, force = (xp.sum(x, axis=1) for x in (whole, wet, weight))
    centre = xp.sum(weight * centres, axis=1) / xp.maximum(force, force * 0.0 + 1e-9)
    # a robot without a hull has no volume
    return wet / xp.maximum(whole, whole * 0.0 + 1e-30), Buoyancy(force * gravity, centre)


def in_base(kinematics: Kinematics) -> tuple[Array, Array]:
    """Return origins (B, L, 3) and rotations (B, L, 3, 3) of the links of robots in the base."""
    origins, turn = kinematics.origins, kinematics.rotations[:, 0]
    back = namespace(turn).permute_dims(turn, (0, 2, 1))
    return (origins - origins[:, :1]) @ turn, back[:, None] @ kinematics.rotations


def _grouped(robot: RobotModel, group: list[int]) -> Floats:
    """Return the pseudo-inertias of rigid groups of links in the axes of their first link."""
    tree = robot.tree
    origins, turns = poses_in_base(tree)
    out = np.zeros((len(group), 4, 4))
    for link in range(tree.links):
        head = link
        while head not in group:
            head = tree.parent[head]
        turn = turns[head].T
        place = np.eye(4)
        place[:3, :3] = turn @ turns[link]
        place[:3, 3] = turn @ (origins[link] - origins[head])
        out[group.index(head)] += place @ _pseudo(robot, link) @ place.T
    return out


def _pseudo(robot: RobotModel, link: int) -> Floats:
    """Second moments about the link origin, first moments and mass, shape (4, 4)."""
    mass, centre, inertia = float(robot.mass[link]), robot.centre[link], robot.inertia[link]
    out = np.zeros((4, 4))
    # S = tr(I) / 2 - I about the centre of mass, then about the origin (Steiner)
    second = 0.5 * float(np.trace(inertia)) * np.eye(3) - inertia
    out[:3, :3] = second + mass * np.outer(centre, centre)
    out[:3, 3] = out[3, :3] = mass * centre
    out[3, 3] = mass
    return out
