"""Legs of a new robot: detected joint chains, servo gains, initial gait, stance.

The stance is that of its file, its pose at zero, or a bend of straight legs.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import RobotError
from seals.multibody.tree import forward, poses_in_base
from seals.robot.model import RobotModel
from seals.scaffold.shapes import LinkHull

FEWEST = 4
"""Chains of three joints that count as legs."""
SAG = 0.07
"""Turn of a leg's joint under its share of the weight, every second leg standing [rad]."""
DAMPED, DAMPED_ON_FOUR = 0.0025, 0.015
"""Damping of a leg's servo by its stiffness, of light legs and of four that carry a trunk [s]."""
NEAR_END = 0.7
"""Distance of a foot's frame from the knee by that of the shape's end where it is a toe [1]."""
SLENDER = 2.0
"""Longest edge by the next one of a shape that has an end [1]."""
SHORTEST = 1e-3
"""Distance of a toe from the last joint below which a leg has none [m]."""
RESERVE = 4.0
"""Torque limit against the torque that carries [1]."""


class _Stance(NamedTuple):
    """Size of the stance of a robot.

    Args:
        reach: mean distance of the toes from their first joints over the ground [m].
        height: of the base origin above the toes [m].
    """

    reach: float
    height: float

    @property
    def span(self) -> float:
        """Reach, at least half of the height: legs that hang down bend when they walk [m].

        Example:
            >>> _Stance(reach=0.0, height=0.3).span
            0.15
        """
        return max(self.reach, 0.5 * self.height)


def legs_of(robot: RobotModel, chains: Sequence[Sequence[int]]) -> dict[str, dict[str, Any]]:
    """Return entries of ``legs:``; empty when the joint chains are not legs.

    Args:
        robot: as read from the URDF.
        chains: joints from the base on, of every limb that does not fork.
    """
    found = [chain for chain in chains if len(chain) == 3]
    if len(found) < FEWEST or len(found) < len(chains):
        return {}
    out: dict[str, dict[str, Any]] = {}
    for number, chain in enumerate(found, start=1):
        names = [robot.joints[j] for j in chain]
        name = _shared(names) or f"leg_{number}"
        foot, toe = _toe(robot, chain[-1])
        name = name if name not in out else f"leg_{number}"
        values = [round(float(x), 5) + 0.0 for x in toe]
        out[name] = {"joints": names, "foot": robot.links[foot], "toe": values}
    return out


def with_feet(
    legs: Mapping[str, Mapping[str, Any]], hulls: Mapping[str, LinkHull], robot: RobotModel
) -> dict[str, dict[str, Any]]:
    """Return legs with their toes: spheres of feet, frames of feet, or the ends of last links.

    A foot's frame counts where it lies beyond the shape of the last link, at least `NEAR_END` of
    it: sensors are mounted nearer to the knee.

    Args:
        legs: entries of ``legs:``.
        hulls: of the links.
        robot: as read from the URDF.

    Raises:
        RobotError: nothing tells where a leg stands.
    """
    out = {}
    origins, _ = poses_in_base(robot.tree)
    for name, leg in legs.items():
        last = robot.tree.child[robot.joints.index(leg["joints"][-1])]
        foot, toe = robot.links.index(leg["foot"]), np.array(leg["toe"], dtype=float)
        shapes = hulls[leg["foot"]].shapes if leg["foot"] in hulls else []
        balls = [s.get("position", [0.0, 0.0, 0.0]) for s in shapes if s["type"] == "sphere"]
        shank = robot.links[last]
        end = _end_of(hulls[shank]) if shank in hulls else np.zeros(3)
        reach = float(np.linalg.norm(origins[foot] - origins[last]))
        if balls:
            toe = np.array(max(balls, key=np.linalg.norm))
        elif end.any() and reach < NEAR_END * float(np.linalg.norm(end)):
            foot, toe = last, end
        if float(np.linalg.norm(toe)) + reach < SHORTEST:
            raise RobotError(
                f"leg '{name}': the toe of its last link '{shank}' cannot be determined.\n"
                f"Give '{shank}' a <collision>, or a frame at its toe: <link name='{shank}_foot'/> "
                f"<joint name='{shank}_toe' type='fixed'><parent link='{shank}'/><child link="
                f"'{shank}_foot'/><origin xyz='0 0 -LENGTH'/></joint>"
            )
        values = [round(float(x), 5) + 0.0 for x in toe]
        out[name] = {**leg, "foot": robot.links[foot], "toe": values}
    return out


def _end_of(hull: LinkHull) -> Floats:
    """Return the end of a link's shapes that is farthest from its joint, in link axes [m].

    The end of a long shape lies on its axis, that of another where the ray from the joint through
    its middle leaves its box.
    """
    ends = []
    for box in hull.boxes:
        half = box.edges / 2.0
        long = int(np.argmax(half))
        way = box.turn[:, long]
        if half[long] > SLENDER * float(np.delete(half, long).max()):
            ends.append(box.centre + way * half[long] * (1.0 if box.centre @ way >= 0.0 else -1.0))
            continue
        away = float(np.linalg.norm(box.centre))
        ray = box.centre / away if away > SHORTEST else way
        inside = np.abs(box.turn.T @ ray)
        ends.append(box.centre + ray * float(np.min(half / np.maximum(inside, 1e-9))))
    return np.asarray(max(ends, key=np.linalg.norm), dtype=np.float64)


def _stance_of(robot: RobotModel, legs: Mapping[str, Mapping[str, Any]]) -> _Stance:
    """Return reach and height of the stance."""
    values = np.zeros(robot.tree.joints)
    for leg in legs.values():
        values[[robot.joints.index(j) for j in leg["joints"]]] = leg.get("stance") or 0.0
    origins, turns = poses_in_base(robot.tree, values)
    reach, height = [], []
    for leg in legs.values():
        foot = robot.links.index(leg["foot"])
        toe = origins[foot] + turns[foot] @ np.array(leg["toe"])
        first = origins[robot.tree.child[robot.joints.index(leg["joints"][0])]]
        reach.append(float(np.linalg.norm((toe - first)[:2])))
        height.append(-float(toe[2]))
    return _Stance(float(np.mean(reach)), float(np.mean(height)))


def leg_servos(robot: RobotModel, legs: Mapping[str, Mapping[str, Any]]) -> dict[str, list[float]]:
    """Return servo gains with which half of the legs carry the weight."""
    carried = 9.81 * float(robot.mass.sum()) / (0.5 * len(legs))
    torque = carried * _stance_of(robot, legs).span
    damped = DAMPED_ON_FOUR if len(legs) == FEWEST else DAMPED
    values = {"kp_each": torque / SAG, "kd_each": damped * torque / SAG}
    values["torque_limit_each"] = RESERVE * torque
    return {key: [float(f"{x:.3g}")] * robot.tree.joints for key, x in values.items()}


def gait_of(robot: RobotModel, legs: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the settings of an initial gait: strokes of two thirds of the span, low steps.

    On four legs it trots, which is to fall from one diagonal to the other: a step takes about as
    long as the fall, and the feet carry the weight and hold the body level.
    """
    stance = _stance_of(robot, legs)
    # pendulums of the stance's height set the pace
    pace = np.sqrt(9.81 / max(stance.height, 1e-3)) / (2.0 * np.pi)
    lengths = {"stroke": 0.65 * stance.span, "lift": 0.3 * stance.height}
    paces = {"lowest": 0.5 * pace, "highest": 1.6 * pace}
    if len(legs) == FEWEST:
        lengths["lift"] *= 0.5
        paces = {"lowest": 2.6 * pace, "highest": 3.6 * pace}
        paces |= {"support": 1.0, "level": 8.0, "catch": 0.2 / (2.0 * np.pi * pace)}
    numbers = {key: float(f"{x:.3g}") for key, x in {**lengths, **paces}.items()}
    return {"pattern": "trot", **numbers} if len(legs) == FEWEST else numbers


def _shared(names: Sequence[str]) -> str:
    """Return the common prefix of names, without punctuation at its end.

    Example:
        >>> _shared(["l1_hip", "l1_knee"])
        'l1'
    """
    same = itertools.takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))
    return "".join(letters[0] for letters in same).rstrip("_-. ")


def _toe(robot: RobotModel, joint: int) -> tuple[int, Floats]:
    """Foot and toe of a leg: the farthest frame fixed to its last link, or a uniform rod's end.

    The latter is where a link without a shape stands.
    """
    tree, last = robot.tree, robot.tree.child[joint]
    frames = [last]
    for k in range(tree.links):
        if tree.parent[k] in frames and tree.joint[k] < 0:
            frames.append(k)
    if len(frames) > 1:
        origins, _ = poses_in_base(robot.tree)
        away = np.linalg.norm(origins[frames] - origins[last], axis=1).round(6)
        return max(zip(away, frames, strict=True))[1], np.zeros(3)
    return last, 2.0 * robot.centre[last]


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
CHOSEN = "chosen: straight legs are bent to 0.72 of their length"


def stances_of(
    robot: RobotModel, legs: Mapping[str, Mapping[str, Any]], stated: Mapping[str, float]
) -> tuple[dict[str, list[float]], str]:
    """Return joint values of legs that stand, empty for zeros, by leg; and where they are from.

    Args:
        robot: as read from the URDF.
        legs: entries of ``legs:``.
        stated: joint values of a pose that the file holds, by joint.
    """
    found = {}
    for name, leg in legs.items():
        chain = [robot.joints.index(joint) for joint in leg["joints"]]
        found[name] = chain, robot.links.index(leg["foot"]), np.array(leg["toe"], dtype=float)
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
    hinge = poses_in_base(robot.tree)[1][robot.tree.child[joint]] @ robot.tree.axis[joint]
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
