"""Stance of a new robot's legs: from its file, its pose at zero, or a bend of straight legs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.control.plant import rest_poses
from seals.multibody.tree import forward
from seals.robot.model import RobotModel

STRAIGHT = 0.4
"""Least sine of the angle between thigh and shank of legs that stand bent [1]."""
SHARE = 0.72
"""Distance of the toe from the lift joint in a chosen stance, by the length of the leg [1]."""
STEPS = 81
"""Values of each joint among which a stance is chosen."""

_ROUNDED = 1e-3
"""Distance beyond a limit that rounding explains [rad]."""

FROM_FILE = "that of a keyframe of the file"
ZERO = "the pose at zero"
CHOSEN = "chosen: straight legs are bent until 0.72 of their length is left"


def stances_of(
    robot: RobotModel, legs: Mapping[str, Mapping[str, Any]], stated: Mapping[str, float]
) -> tuple[dict[str, list[float]], str]:
    """Return joint values of legs that stand, empty for zeros, by leg; and where they are from.

    Args:
        robot: as read from the URDF.
        legs: entries of ``legs:``.
        stated: joint values of a pose that the file holds, by joint.
    """
    found = {name: _leg(robot, leg) for name, leg in legs.items()}
    walking = [j for chain, *_ in found.values() for j in chain]
    lower, upper, unknown = robot.lower - _ROUNDED, robot.upper + _ROUNDED, np.nan
    if all(lower[j] <= stated.get(robot.joints[j], unknown) <= upper[j] for j in walking):
        values = {
            name: [round(stated[robot.joints[j]], 4) + 0.0 for j in chain]
            for name, (chain, *_) in found.items()
        }
        source = FROM_FILE if any(map(any, values.values())) else ZERO
    elif all(_stands(robot, *leg) for leg in found.values()):
        values, source = {name: [0.0] * 3 for name in legs}, ZERO
    else:
        values = {name: _bent(robot, *leg) for name, leg in found.items()}
        source = CHOSEN
    return {n: v if any(v) else [] for n, v in values.items()}, source


def _leg(robot: RobotModel, leg: Mapping[str, Any]) -> tuple[list[int], int, Floats]:
    """Joints, last link and toe of a leg."""
    chain = [robot.joints.index(name) for name in leg["joints"]]
    return chain, robot.links.index(leg["foot"]), np.array(leg["toe"], dtype=float)


def _places(
    robot: RobotModel, chain: list[int], foot: int, toe: Floats, values: Floats
) -> tuple[Floats, ...]:
    """Places of lift joint, bend joint and toe for rows of joint values [m], (N, 3) each."""
    joints = np.zeros((len(values), robot.tree.joints))
    joints[:, chain] = values
    still = np.zeros((len(values), 3)), np.broadcast_to(np.eye(3), (len(values), 3, 3))
    origins, turns = forward(robot.tree, *still, joints)
    lift, bend = (origins[:, robot.tree.child[j]] for j in chain[1:])
    return lift, bend, origins[:, foot] + turns[:, foot] @ toe


def _stands(robot: RobotModel, chain: list[int], foot: int, toe: Floats) -> bool:
    """Return whether a leg at zero is within its limits and bent about its last joint's axis."""
    if np.any(robot.lower[chain] > 0.0) or np.any(robot.upper[chain] < 0.0):
        return False
    lift, bend, end = (p[0] for p in _places(robot, chain, foot, toe, np.zeros((1, 3))))
    joint = chain[-1]
    hinge = rest_poses(robot)[1][robot.tree.child[joint]] @ robot.tree.axis[joint]
    hinge = hinge / np.linalg.norm(hinge)
    # links beside each other along the axis make no bend
    thigh, shank = (way - (way @ hinge) * hinge for way in (bend - lift, end - bend))
    size = float(np.linalg.norm(thigh) * np.linalg.norm(shank))
    return bool(np.linalg.norm(np.cross(thigh, shank)) > STRAIGHT * size)


def _bent(robot: RobotModel, chain: list[int], foot: int, toe: Floats) -> list[float]:
    """Joint values with the toe below the lift joint, or below and outside of a leg that spreads.

    Of two bends within the limits that do the same, the knee goes backwards.
    """
    lower, upper = (np.clip(limit[chain], -np.pi, np.pi) for limit in (robot.lower, robot.upper))
    hip = float(np.clip(0.0, lower[0], upper[0]))
    grid = [np.linspace(low, high, STEPS) for low, high in zip(lower[1:], upper[1:], strict=True)]
    pairs = np.stack([g.ravel() for g in np.meshgrid(*grid)], axis=1)
    values = np.column_stack((np.full(len(pairs), hip), pairs))
    lift, bend, end = _places(robot, chain, foot, toe, values)
    thigh, shank = bend - lift, end - bend
    length = float(np.linalg.norm(thigh[0]) + np.linalg.norm(shank[0]))
    # a hip about a level axis swings a leg that hangs, one about an upright axis a leg that spreads
    axis = robot.tree.axis[chain[0]]
    way = lift[0, :2] / max(float(np.hypot(*lift[0, :2])), 1e-9)
    spreads = 0.7 if abs(float(axis[2])) > 0.7 * float(np.linalg.norm(axis)) else 0.0
    aim = SHARE * np.array([spreads * way[0], spreads * way[1], -np.sqrt(1.0 - spreads**2)])
    off = np.linalg.norm((end - lift) / length - aim, axis=1)
    return [round(float(x), 3) + 0.0 for x in values[np.argmin(off + 0.02 * bend[:, 0] / length)]]
