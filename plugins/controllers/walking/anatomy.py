"""Geometry of three-joint legs: toes in the stance, inverse kinematics, Jacobian."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.errors import ConfigError
from seals.multibody.tree import poses_in_base
from seals.robot.limbs import Leg, standing
from seals.robot.model import RobotModel

SQUARE = 1e-3
"""Largest sine or cosine between axes that count as parallel or as square [1]."""
SPARE = 1e-3
"""Share of its length by which a leg is never quite stretched or folded [1]."""


class Anatomy(NamedTuple):
    """Geometry of all legs of a robot in body axes; axes and segments at zero joint values.

    In a leg's own plane the first coordinate runs outwards, square to the hip's axis, and the
    second along that axis. A leg of N is a row.

    Args:
        joints: indices of hip, lift and bend, shape (N, 3).
        toe: place of the toes in the stance [m], shape (N, 3).
        hip: point on the hips' axes [m], shape (N, 3).
        basis: rows outwards, across, and along the hip's axis, shape (N, 3, 3).
        aside: distance of the leg's plane from the hip's axis [m], shape (N,).
        knee: lift joint in the leg's plane, from the hip [m], shape (N, 2).
        length: of the two segments [m], shape (N, 2).
        rest: elevation of the two segments [rad], shape (N, 2).
        sense: whether positive hip, lift and bend turn towards ``across``, down and down: 1 or -1,
            shape (N, 3).
        fold: -1 where the second segment hangs down from the first, 1 where it rises, shape (N,).
        lower: joint limits [rad], shape (N, 3).
        upper: joint limits [rad], shape (N, 3).
        side: 0 for legs on the left, 1 for legs on the right, shape (N,).
        rank: place on its side, 0 in front, shape (N,).
    """

    joints: Floats
    toe: Floats
    hip: Floats
    basis: Floats
    aside: Floats
    knee: Floats
    length: Floats
    rest: Floats
    sense: Floats
    fold: Floats
    lower: Floats
    upper: Floats
    side: Floats
    rank: Floats

    def angles(self, toes: Array) -> Array:
        """Inverse kinematics: return the joint values for toe positions, as near as the legs reach.

        Args:
            toes: body axes about the body origin, outwards of the hips [m], shape (..., N, 3).

        Returns:
            Hip, lift and bend within the joint limits [rad], shape (..., N, 3).
        """
        xp = namespace(toes)
        inside = (self.basis @ (toes - self.hip)[..., None])[..., 0]
        out, across, along = (inside[..., k] for k in range(3))
        radius = xp.sqrt(xp.clip(out * out + across * across - self.aside**2, 1e-12, None))
        hip = xp.atan2(across, out) - xp.atan2(self.aside, radius)
        x, z = radius - self.knee[:, 0], along - self.knee[:, 1]
        first, second = self.length[:, 0], self.length[:, 1]
        longest, shortest = (first + second) * (1 - SPARE), abs(first - second) * (1 + SPARE)
        far = xp.minimum(xp.maximum(xp.sqrt(x * x + z * z), shortest), longest)
        cosine = (far * far - first**2 - second**2) / (2.0 * first * second)
        bend = xp.acos(xp.clip(cosine, -1.0, 1.0))
        lead = xp.atan2(second * xp.sin(bend), first + second * xp.cos(bend))
        thigh = xp.atan2(z, x) - self.fold * lead
        raised = thigh - self.rest[:, 0]
        folded = thigh + self.fold * bend - self.rest[:, 1] - raised
        values = self.sense * xp.stack((hip, -_wrapped(raised), -_wrapped(folded)), axis=-1)
        return xp.minimum(xp.maximum(values, self.lower), self.upper)

    def jacobian(self, values: Floats) -> Floats:
        """Return the velocity of each toe for a unit rate of each joint of its leg [m].

        Args:
            values: hip, lift and bend [rad], shape (N, 3).

        Returns:
            Body axes, shape (N, 3, 3): a column for each joint.
        """
        out, across, along = self.basis.transpose(1, 0, 2)
        turn = (np.cos(values[:, :1]), np.sin(values[:, :1]))
        out, across = turn[0] * out + turn[1] * across, turn[0] * across - turn[1] * out
        thigh = self.rest[:, 0] - self.sense[:, 1] * values[:, 1]
        shank = thigh + self.rest[:, 1] - self.rest[:, 0] - self.sense[:, 2] * values[:, 2]
        first, second = (
            length[:, None] * (np.cos(a)[:, None] * out + np.sin(a)[:, None] * along)
            for length, a in zip(self.length.T, (thigh, shank), strict=True)
        )
        knee = self.knee[:, :1] * out + self.knee[:, 1:] * along + self.aside[:, None] * across
        columns = (
            np.cross(along, knee + first + second),
            self.sense[:, 1:2] * np.cross(across, first + second),
            self.sense[:, 2:] * np.cross(across, second),
        )
        return np.stack(columns, axis=2)

    def outward(self) -> Floats:
        """Return the level directions in which the legs spread, body x and y, shape (N, 2).

        A leg whose hip turns about a level axis hangs down; it spreads to its side of the body.
        """
        out = self.basis[:, 0, :2]
        length = np.linalg.norm(out, axis=1, keepdims=True)
        aside = np.stack((np.zeros_like(self.side), 1.0 - 2.0 * self.side), axis=1)
        return np.where(length > SQUARE, out / np.maximum(length, SQUARE), aside)


def anatomy_of(robot: RobotModel) -> Anatomy:
    """Return the leg geometry of a robot.

    Raises:
        ConfigError: it has no legs, or one that is not a turning hip and two parallel hinges.
    """
    if not robot.legs:
        raise ConfigError(
            f"robot '{robot.name}' has no legs, so it cannot have a gait.\n"
            "Name them in its robot.yaml: legs: {NAME: {joints: [...], foot: LINK, toe: [x, y, z]}}"
        )
    stands = standing(robot.legs, robot.tree.joints)
    # the stance with every hip at zero shows which way legs fold that are straight at zero
    hips = stands.copy()
    hips[[leg.joints[0] for leg in robot.legs.values() if leg.joints]] = 0.0
    poses = [poses_in_base(robot.tree, values) for values in (0.0 * stands, hips, stands)]
    rows = [_row(robot, leg, *poses) for leg in robot.legs.values()]
    table = {key: np.array([row[key] for row in rows]) for key in rows[0]}
    side = (table["toe"][:, 1] < 0.0).astype(float)
    rank = [
        np.sum((side == side[k]) & (table["hip"][:, 0] > table["hip"][k, 0] + 1e-9))
        for k in range(len(rows))
    ]
    return Anatomy(**table, side=side, rank=np.array(rank, dtype=float))


Pose = tuple[Floats, Floats]
"""Origins of all links [m] and their rotation matrices, body axes."""


def _row(robot: RobotModel, leg: Leg, zero: Pose, folded: Pose, stands: Pose) -> dict[str, Floats]:
    """One leg in its own plane."""
    if len(leg.joints) != 3:
        raise ConfigError(
            f"robot '{robot.name}': leg '{leg.name}' has {len(leg.joints)} joints.\n"
            "A gait needs legs with three joints: a hip that swings fore and aft, and two hinges."
        )
    tree = robot.tree
    links = [tree.joint.index(j) for j in leg.joints]
    axes = [zero[1][k] @ tree.axis[j] for k, j in zip(links, leg.joints, strict=True)]
    tilt = max(abs(float(axes[0] @ axes[1])), float(np.linalg.norm(np.cross(axes[1], axes[2]))))
    if tilt > SQUARE:
        raise ConfigError(
            f"robot '{robot.name}': leg '{leg.name}' has the axes {np.round(axes, 3).tolist()}.\n"
            "A gait needs the second and the third axis parallel, and perpendicular to the first."
        )
    hip, toe = zero[0][links[0]], _toe(leg, folded)
    out = np.cross(axes[1], axes[0])
    out = out if out @ (toe - hip) > 0.0 else -out
    across = np.cross(axes[0], out)
    plane = np.array([out, axes[0]])
    thigh, shank = _segments(plane, zero, links, _toe(leg, zero))
    above, below = _segments(plane, folded, links, toe)
    bent = float(above[0] * below[1] - above[1] * below[0])
    return {
        "joints": np.array(leg.joints),
        "toe": _toe(leg, stands),
        "hip": hip,
        "basis": np.array([out, across, axes[0]]),
        "aside": np.array(across @ (toe - hip)),
        "knee": plane @ (zero[0][links[1]] - hip),
        "length": np.array([np.hypot(*thigh), np.hypot(*shank)]),
        "rest": np.array([np.arctan2(s[1], s[0]) for s in (thigh, shank)]),
        "sense": np.array([1.0, *(np.sign(axis @ across) for axis in axes[1:])]),
        "fold": np.array(1.0 if bent > 0.0 else -1.0),
        "lower": robot.lower[list(leg.joints)],
        "upper": robot.upper[list(leg.joints)],
    }


def _toe(leg: Leg, pose: Pose) -> Floats:
    place: Floats = pose[0][leg.foot] + pose[1][leg.foot] @ leg.toe
    return place


def _segments(plane: Floats, pose: Pose, links: list[int], toe: Floats) -> tuple[Floats, Floats]:
    """Thigh and shank in the plane of a leg whose hip is at zero [m], shape (2,) each."""
    knee, ankle = (pose[0][k] for k in links[1:])
    return plane @ (ankle - knee), plane @ (toe - ankle)


def _wrapped(angle: Array) -> Array:
    """Angles between -pi and pi [rad]."""
    return angle - 2.0 * math.pi * namespace(angle).floor(angle / (2.0 * math.pi) + 0.5)
