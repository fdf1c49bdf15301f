"""Rotors and thrusters of a new robot: stated in its file, or found by the names of links."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.control.plant import ROTOR, THRUSTER
from seals.environment.seawater import FRESH_WATER
from seals.multibody.tree import poses_in_base
from seals.robot.model import RobotModel
from seals.scaffold.motors import (
    UPRIGHT,
    axis_of,
    flies,
    hubs_of,
    level_ones,
    link_of,
    without_strange_laws,
)
from seals.scaffold.plug_ins import Motor
from seals.scaffold.takeover import Takeover

GRAVITY, WATER = 9.81, FRESH_WATER
"""Gravity [m/s^2] and the density of water [kg/m^3]."""
TIP_SPEED = 120.0
"""Speed of blade tips at full speed [m/s]; small propellers turn at 80 to 180."""
REACTION = 0.12
"""Reaction torque by thrust and radius [1]; propellers of this size lie near 0.1 to 0.15."""
PUSH = 0.5
"""Force of all thrusters together by the weight [1]: a brisk underwater vehicle has 0.3 to 1."""
BRISK = 2.0
"""Speed whose stated drag all thrusters together can bear, where that is less [m/s]."""
SMALL = 0.04, 50.0
"""Radius [m] and largest force [N] of a small underwater thruster."""
_ROTOR_LAG, _THRUSTER_LAG = 0.05, 0.1
_WORDS = r"thruster", r"rotor|prop|blade|screw", r"motor"
_NOT = r"guard|mount|shroud|duct|arm|frame|base|cage|servo|nacelle|tilt"
LEAST_DRAG = 0.02
"""Drag coefficient by volume^(2/3) of the most slender hulls [1]; torpedoes have 0.025 (Hoerner
1965, ch. 6). A stated drag below it was never measured, and no measure of thrusters."""


@dataclass(kw_only=True)
class Drives:
    """Rotors or thrusters of a new robot.

    Args:
        kind: ``rotor`` or ``thruster``.
        links: that they turn with, or that carry them.
        joints: movable joints that turn them; empty if they are fixed.
        position: base axes [m], shape (n, 3).
        axis: of positive thrust, base axes [1], shape (n, 3).
        direction: +1 anticlockwise seen from the tip of the axis, -1 clockwise, shape (n,).
        radius: [m], shape (n,).
        max_speed: of rotors [rad/s], shape (n,).
        thrust: coefficient of rotors [N/(rad/s)^2], largest force of thrusters [N], shape (n,).
        torque: coefficient [N m/(rad/s)^2], shape (n,).
        time_constant: [s], shape (n,).
        spin_down: time constant of falling speed [s], shape (n,).
        drag: force against sideways motion by speed of rotor and hub [N s^2/(rad m)], shape (n,).
        sources: where numbers are from, by field, in words.
        tilting: joints that turn a drive with its axis, by the drive's link.
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
    time_constant: Floats
    spin_down: Floats
    drag: Floats
    sources: dict[str, str] = field(default_factory=dict)
    tilting: dict[str, str] = field(default_factory=dict)

    def rows(self, rows: list[int]) -> Drives:
        """Return some of the drives."""
        arrays: dict[str, Any] = {
            key: value[rows] for key, value in vars(self).items() if isinstance(value, np.ndarray)
        }
        return replace(self, links=[self.links[k] for k in rows], **arrays)

    def by_carrier(self, robot: RobotModel) -> list[tuple[str, Drives]]:
        """Return the drives on the base, then each rotor that one hinge tilts, in axes of its link.

        Args:
            robot: with the joints of its drives fixed.

        Returns:
            Names of the links, empty for the base, with their drives.
        """
        tilted = {}
        for k, name in enumerate(self.links):
            link = robot.links.index(name)
            moves = robot.tree.moves[link] if robot.tree.joints else np.zeros(0)
            moving = np.flatnonzero(moves)
            if self.kind == ROTOR and len(moving) == 1 and not robot.tree.slides[moving[0]]:
                tilted[k] = link
        base = [k for k in range(len(self.links)) if k not in tilted]
        found = [("", self.rows(base))] if base else []
        origins, turns = poses_in_base(robot.tree)
        for k, link in tilted.items():
            one = self.rows([k])
            one.position = (one.position - origins[link]) @ turns[link]
            one.axis = one.axis @ turns[link]
            found.append((robot.links[link], one))
        return found


def drives_of(
    robot: RobotModel, source: Takeover, extents: Mapping[str, float], *, medium: str = ""
) -> list[Drives]:
    """Return the rotors and thrusters that the file states, else those found by names of links.

    Args:
        robot: as read from the URDF.
        source: the file, for plug-ins and limits of speed.
        extents: size of each link [m].
        medium: ``air`` or ``water``, where propellers are known to work in one alone.

    Raises:
        RobotError: a plug-in names a link or joint that is not there.
    """
    motors = source.stated.motors
    if not motors:
        winged = medium != "water" and flies(source, "")
        wet = bool(source.stated.hydrodynamics)
        motors = _named(robot, "air" if winged else medium, wet=wet, fewest=1 if winged else 2)
    motors = without_strange_laws(motors, GRAVITY * float(robot.mass.sum()), source.changes)
    motors = level_ones(motors, robot, source, medium)
    found = []
    for kind in (ROTOR, THRUSTER):
        own = [motor for motor in motors if motor.kind == kind]
        if own:
            found.append(_drives(kind, own, robot, source, extents))
    return found


def _named(robot: RobotModel, medium: str, *, wet: bool, fewest: int) -> list[Motor]:
    """Find drives by names of links: those with a level axis are thrusters, upright ones rotors.

    Args:
        robot: as read from the URDF.
        medium: in which propellers are known to work.
        wet: whether the file states hydrodynamics.
        fewest: rotors.
    """
    for words in _WORDS:
        fits = [
            k
            for k, name in enumerate(robot.links)
            if k
            and re.search(words, name, re.IGNORECASE)
            and not re.search(_NOT, name, re.IGNORECASE)
        ]
        tree = robot.tree
        fits = [k for k in fits if not _drives_a_joint(robot, k)]
        carrying = {tree.parent[k] for k in range(tree.links) if tree.joint[k] >= 0}
        links = [
            k
            for k in fits
            if k not in carrying and not any(tree.parent[other] == k for other in fits)
        ]
        if not links:
            continue
        kind = THRUSTER if words == _WORDS[0] or medium == "water" or wet else ROTOR
        if kind == ROTOR and medium != "air":
            upright = [abs(axis_of(robot, k, ROTOR)[2]) for k in links]
            kind = ROTOR if np.mean(upright) > UPRIGHT else THRUSTER
        if words == _WORDS[2] and kind == ROTOR and len(links) < 3:
            continue
        if len(links) >= (fewest if kind == ROTOR else 1):
            said = f"names of links ({words.replace('|', ', ')})"
            return [Motor(kind, robot.links[k], "", {}, said) for k in links]
    return []


def _drives_a_joint(robot: RobotModel, link: int) -> bool:
    """Return whether a link is the rotor of a joint's motor: calf_rotor, beside what moves calf."""
    stem = re.sub(r"[_-]?(rotor|motor)$", "", robot.links[link], flags=re.IGNORECASE)
    tree, moved = robot.tree, robot.links.index(stem) if stem in robot.links else link
    beside = tree.parent[moved] == tree.parent[link]
    return moved != link and beside and tree.joint[moved] >= 0 and tree.joint[link] < 0


def _drives(
    kind: str,
    motors: Sequence[Motor],
    robot: RobotModel,
    source: Takeover,
    extents: Mapping[str, float],
) -> Drives:
    links = [link_of(motor, robot, source) for motor in motors]
    origins, turns = poses_in_base(robot.tree)
    hubs = hubs_of(robot, links, motors)
    place = np.array([origins[k] + turns[k] @ hub for k, hub in zip(links, hubs, strict=True)])
    rows = [
        axis_of(robot, k, kind) if m.axis is None else turns[k] @ np.array(m.axis)
        for k, m in zip(links, motors, strict=True)
    ]
    raw = np.array(rows)
    # thrust of a rotor that may point either way points up
    axis = raw * np.where((kind == ROTOR) & (raw[:, 2:] < -1e-6), -1.0, 1.0)
    names = [robot.links[k] for k in links]
    source.changes += _turned_up(motors, names, raw, turns[links]) if kind == ROTOR else []
    own = [robot.tree.joint[k] for k in links]
    # a drive on a link of its own turns it; one on a leg or an arm does not
    turned = [
        j >= 0 and (m.axis is None or np.isinf(robot.upper[j]))
        for j, m in zip(own, motors, strict=True)
    ]
    joints = [robot.joints[j] for j, turns_it in zip(own, turned, strict=True) if turns_it]
    sources: dict[str, str] = {}
    sizes = np.array([extents.get(name, 0.0) for name in names])
    force = np.array([motor.values.get("max_force", SMALL[1]) for motor in motors])
    screws = np.round(SMALL[0] * np.sqrt(force / SMALL[1]), 4)
    chosen = _radii(place, axis, sizes) if kind == ROTOR else screws
    radius = _stated(motors, "radius", chosen, sources)
    direction, said = _directions(motors, names, raw, place, source)
    sources |= {"direction": said} if said else {}
    limits = np.array([source.velocity_limit(robot.joints[j]) if j >= 0 else 0.0 for j in own])
    # limits below 50 rad/s were written for something else than a propeller
    speeds = np.where(limits > 50.0, limits, np.round(TIP_SPEED / radius, -1))
    found = Drives(
        kind=kind,
        links=names,
        joints=joints,
        position=place,
        axis=axis,
        direction=direction,
        radius=radius,
        max_speed=_stated(motors, "max_speed", speeds, sources),
        thrust=np.zeros(len(links)),
        torque=np.zeros(len(links)),
        time_constant=_stated(
            motors, "time_constant", _ROTOR_LAG if kind == ROTOR else _THRUSTER_LAG, sources
        ),
        spin_down=np.zeros(0),
        drag=_stated(motors, "drag", 0.0, sources),
        sources=sources,
        tilting=_tilting(robot, links, joints),
    )
    found.spin_down = _stated(motors, "spin_down", found.time_constant, sources)
    mass = float(robot.mass.sum())
    stated = source.stated.hydrodynamics
    linear = sum(float(each.linear[0]) for each in stated if each.linear is not None)
    quadratic = sum(float(each.quadratic[0]) for each in stated if each.quadratic is not None)
    weight, drag = GRAVITY * mass, linear * BRISK + quadratic * BRISK**2
    # of the most slender hull of a neutral vehicle at that speed
    least = 0.5 * WATER * LEAST_DRAG * (mass / WATER) ** (2.0 / 3.0) * BRISK**2
    _strengths(found, motors, weight, min(PUSH * weight, drag if drag > least else np.inf))
    return found


def _turned_up(motors: Sequence[Motor], names: list[str], axis: Floats, turns: Floats) -> list[str]:
    """Tell of rotors that are turned up: motor models of Gazebo push along z of the link."""
    rows = zip(names, motors, axis, turns, strict=True)
    down = [
        name
        for name, motor, row, turn in rows
        if "thrust" in motor.values and row[2] < -1e-6 and row @ turn[:, 2] > 0.5
    ]
    said = "rotors with downward thrust in the file reversed to point upwards"
    return [f"{said}: {', '.join(down)}"] if down else []


def held_down(drives: Sequence[Drives], net: float) -> None:
    """Let thrusters that push up hold a vehicle whose weight and buoyancy differ.

    Args:
        drives: changed: chosen largest forces grow to twice what holds it.
        net: weight less buoyancy [N].
    """
    for each in drives:
        if each.kind == THRUSTER and "max_force" not in each.sources:
            up = float(np.abs(each.axis[:, 2]).sum())
            if up > UPRIGHT:
                each.thrust = np.maximum(each.thrust, 2.0 * abs(net) / up)


def _strengths(drives: Drives, motors: Sequence[Motor], weight: float, push: float) -> None:
    """Coefficients of thrust and torque, or largest forces."""
    count = len(motors)
    if drives.kind == THRUSTER:
        drives.thrust = _stated(motors, "max_force", push / count, drives.sources)
        return
    largest = [motor.values.get("max_force", 2.0 * weight / count) for motor in motors]
    if any("max_force" in motor.values for motor in motors):
        drives.sources["thrust"] = motors[0].source
    chosen = np.array(largest) / drives.max_speed**2
    drives.thrust = _stated(motors, "thrust", chosen, drives.sources)
    arm = _stated(motors, "moment", REACTION * drives.radius, drives.sources)
    drives.torque = _stated(motors, "torque", arm * drives.thrust, drives.sources)
    if "moment" in drives.sources:
        drives.sources["torque"] = drives.sources["moment"]


def _stated(
    motors: Sequence[Motor], key: str, chosen: Floats | float, sources: dict[str, str]
) -> Floats:
    """One number for each drive: the stated one, else the chosen one."""
    default = np.broadcast_to(np.asarray(chosen, dtype=float), (len(motors),))
    given = [motor.values.get(key) for motor in motors]
    stated = sorted({m.source for m, v in zip(motors, given, strict=True) if v is not None})
    if stated:
        sources[key] = "; ".join(stated[:3])
    return np.array([d if v is None else v for v, d in zip(given, default, strict=True)])


def _radii(place: Floats, axis: Floats, extents: Floats) -> Floats:
    """Radius of each disc [m]: that of its shape, or 0.4 of the distance to the nearest disc."""
    apart = place[:, None] - place[None]
    along = np.einsum("ijk,jk->ij", apart, axis)
    across = np.linalg.norm(apart - along[:, :, None] * axis[None], axis=2)
    # coaxial discs lie one above the other, not side by side
    across[across < 0.1 * np.linalg.norm(apart, axis=2) + 1e-3] = np.inf
    room = np.where(np.isfinite(across.min(axis=1)), 0.4 * across.min(axis=1), 0.1)
    drawn = extents / 2.0
    # a shape much smaller than the room is a motor or a hub, a larger one is a sphere of safety
    fits = (drawn > 0.3 * room) & (drawn < 2.0 * room)
    return np.asarray(np.round(np.where(fits, drawn, room), 4), dtype=np.float64)


def _directions(
    motors: Sequence[Motor], names: list[str], axis: Floats, place: Floats, source: Takeover
) -> tuple[Floats, str]:
    """Directions of rotation and their source: stated, by names, or by axes that point down."""
    given = [motor.values.get("direction") for motor in motors]
    if all(value is not None for value in given):
        # seen from the tip of the axis, which was turned up
        turned = np.where(axis[:, 2] < -1e-6, -1.0, 1.0)
        return np.array(given, dtype=float) * turned, motors[0].source
    said = [
        re.search(r"(?<![a-z])(c?cw)(?![a-z])", text.lower())
        for text in (" ".join((name, *source.words_of(name))) for name in names)
    ]
    if all(said):
        signs = [1.0 if m and m[1] == "ccw" else -1.0 for m in said]
        return np.array(signs), "cw and ccw in names of links, joints or meshes"
    down = axis[:, 2] < -0.5
    if 2 * int(down.sum()) == len(names):
        return np.where(down, -1.0, 1.0), "axes of the joints, half of which point downwards"
    return _alternating(place), ""


def _alternating(place: Floats) -> Floats:
    """Alternating directions: neighbours around the body and coaxial pairs counter-rotate."""
    aside = place - place.mean(axis=0)
    angle = np.round(np.arctan2(aside[:, 1], aside[:, 0]), 2) % 6.28
    levels = np.lexsort((place[:, 2], angle))
    out = np.ones(len(place))
    column, before = -1, None
    for k in levels:
        above = before is not None and abs(angle[k] - angle[before]) < 0.02
        if not above:
            column, height = column + 1, 0
        else:
            height += 1
        out[k] = 1.0 if (column + height) % 2 == 0 else -1.0
        before = k
    return out


def _tilting(robot: RobotModel, links: Sequence[int], spun: Sequence[str]) -> dict[str, str]:
    """Joints between the base and a drive, except the drive's own."""
    tree, found = robot.tree, {}
    for k in links:
        above = k
        while above > 0:
            joint = tree.joint[above]
            if joint >= 0 and robot.joints[joint] not in spun:
                found[robot.links[k]] = robot.joints[joint]
            above = tree.parent[above]
    return found
