"""Detection of rotors and thrusters by link name, with initial parameters."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control.plant import ROTOR, THRUSTER
from seals.multibody.tree import forward
from seals.robot.model import RobotModel
from seals.scaffold.takeover import Takeover

GRAVITY = 9.81
TIP_SPEED = 120.0
"""Speed of blade tips at full speed [m/s]; small propellers turn at 80 to 180."""
REACTION = 0.12
"""Reaction torque by thrust and radius [1]; propellers of this size lie near 0.1 to 0.15."""
_WORDS = (
    (ROTOR, r"rotor|prop|blade"),
    (THRUSTER, r"thruster"),
    (ROTOR, r"motor"),
)
_NOT = r"guard|mount|shroud|duct|arm|frame|base|cage|servo"
_FEWEST = {ROTOR: 3, THRUSTER: 1}


class Drives(NamedTuple):
    """Candidates for rotors or thrusters.

    Args:
        kind: ``rotor`` or ``thruster``.
        links: their names.
        joints: movable joints that turn them; empty where they are fixed.
        position: base axes [m], shape (n, 3).
        axis: of positive thrust, base axes [1], shape (n, 3).
        direction: +1 anticlockwise from above, -1 clockwise, shape (n,).
        radius: [m], shape (n,).
        max_speed: [rad/s], shape (n,).
        thrust: coefficient [N/(rad/s)^2], shape (n,).
        torque: coefficient [N m/(rad/s)^2], shape (n,).
    """

    kind: str
    links: list[str]
    joints: list[str]
    position: Floats
    axis: Floats
    direction: Floats
    radius: Floats
    max_speed: Floats
    thrust: Floats
    torque: Floats


def drives_of(robot: RobotModel, source: Takeover, extents: Mapping[str, float]) -> Drives | None:
    """Return candidates for rotors or thrusters by link name, or None.

    Args:
        robot: as read from the URDF.
        source: the URDF, for limits of speed.
        extents: size of each link [m].
    """
    for kind, words in _WORDS:
        links = _named(robot, words)
        if len(links) >= _FEWEST[kind]:
            return _drives(kind, links, robot, source, extents)
    return None


def _named(robot: RobotModel, words: str) -> list[int]:
    """Links of that name that carry no other link of that name and lie apart from each other."""
    fits = [
        k
        for k, name in enumerate(robot.links)
        if k and re.search(words, name, re.IGNORECASE) and not re.search(_NOT, name, re.IGNORECASE)
    ]
    return [k for k in fits if not any(robot.tree.parent[other] == k for other in fits)]


def _drives(
    kind: str,
    links: list[int],
    robot: RobotModel,
    source: Takeover,
    extents: Mapping[str, float],
) -> Drives:
    tree = robot.tree
    zero = np.zeros((1, tree.joints))
    origins, turns = forward(tree, np.zeros((1, 3)), np.eye(3)[None], zero)
    place = origins[0, links]
    own = [tree.joint[k] for k in links]
    forwards = np.array([0.0, 0.0, 1.0] if kind == ROTOR else [1.0, 0.0, 0.0])
    axis = np.array(
        [
            turns[0, k] @ (tree.axis[j] if j >= 0 else forwards)
            for k, j in zip(links, own, strict=True)
        ]
    )
    if kind == ROTOR:
        # thrust of a rotor that may point either way points up
        axis = axis * np.where(axis[:, 2:] < -1e-6, -1.0, 1.0)
    names = [robot.links[k] for k in links]
    joints = [robot.joints[j] for j in own if j >= 0]
    radius = _radii(place, np.array([extents.get(name, 0.0) for name in names]))
    stated = np.array([source.velocity_limit(robot.joints[j]) if j >= 0 else 0.0 for j in own])
    # limits below 50 rad/s were written for something else than a propeller
    speed = np.where(stated > 50.0, stated, np.round(TIP_SPEED / radius, -1))
    weight = GRAVITY * float(robot.mass.sum())
    thrust = 2.0 * weight / (len(links) * speed**2)
    return Drives(
        kind=kind,
        links=names,
        joints=joints,
        position=place,
        axis=axis,
        direction=_directions(names, place),
        radius=radius,
        max_speed=speed,
        thrust=thrust,
        torque=REACTION * radius * thrust,
    )


def _radii(place: Floats, extents: Floats) -> Floats:
    """Radius of each disc: that of its shape where it has one, else what the neighbours leave."""
    gap = np.linalg.norm(place[:, None] - place[None], axis=2)
    gap[gap < 1e-3] = np.inf
    room = np.where(np.isfinite(gap.min(axis=1)), 0.4 * gap.min(axis=1), 0.1)
    drawn = extents / 2.0
    # a shape much smaller than the room is a motor or a hub, a larger one is a sphere of safety
    fits = (drawn > 0.3 * room) & (drawn < 2.0 * room)
    return np.asarray(np.round(np.where(fits, drawn, room), 4), dtype=np.float64)


def _directions(names: list[str], place: Floats) -> Floats:
    """Sense of rotation: from ``cw`` and ``ccw`` in the names, else alternating around the body."""
    said = [re.search(r"(c?cw)(?![a-z])", name.lower()) for name in names]
    if all(said):
        return np.array([1.0 if m and m[1] == "ccw" else -1.0 for m in said])
    aside = place - place.mean(axis=0)
    angle = np.round(np.arctan2(aside[:, 1], aside[:, 0]) % (2.0 * np.pi), 2)
    # those above each other turn against each other, and against their neighbours
    order = np.lexsort((place[:, 2], angle))
    out = np.ones(len(names))
    out[order[1::2]] = -1.0
    return out
