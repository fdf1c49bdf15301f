"""Remarks for the user of a new robot: which values were chosen, and what was left out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from seals.control.plant import ROTOR
from seals.robot.model import RobotModel
from seals.scaffold.effects import RobotMedium
from seals.scaffold.legs import DAMPED_ON_FOUR, gait_of
from seals.scaffold.rotors import Drives
from seals.scaffold.takeover import Takeover

if TYPE_CHECKING:
    from seals.scaffold.robot import NewRobot

_TWO_TURNS = 4.0 * np.pi + 1e-6
_AIR = 1.2
"""Density of air [kg/m^3]."""
_CARRIED = 0.1
"""Share of the weight above which the lift of displaced air is named [1]."""
_LATE = 0.1
"""Lag of the servos of legs by the time of the shortest step above which it is named [1]."""


def remarks_of(made: NewRobot, source: Takeover, *, chosen: bool) -> list[str]:
    """Return remarks on what to check first.

    Args:
        made: the robot.
        source: the file that was taken over.
        chosen: whether the medium was chosen instead of given.
    """
    robot = made.robot
    out = list(_in_degrees(source))
    if made.limbs.legs:
        out.append(f"legs: the stance is {made.limbs.stance}; the gait's numbers are chosen")
        out += _late_legs(made, source)
    elif not made.drives:
        out.append(
            "no link is named like a rotor or thruster (rotor, prop, thruster, motor): "
            "write them under actuators: in robot.yaml"
        )
    for drives in made.drives:
        out += _of_rotors(drives, robot) if drives.kind == ROTOR else _of_thrusters(drives, source)
    bare = [n for n, m in zip(robot.links, robot.mass, strict=True) if m <= 0.0 and n in made.hulls]
    if bare:
        out.append(
            f"links with a shape and no <inertial>: {', '.join(bare[:6])}; "
            "density=500 would give them mass"
        )
    if not made.hulls:
        out.append("no link has a shape: it displaces no water; write hulls: in robot.yaml")
    if made.limbs.others:
        out.append(f"joints left out of arms and grippers: {', '.join(made.limbs.others)}")
    out += _beyond_the_model(made)
    for each in source.stated.hydrodynamics:
        if each.added is not None and not np.any(each.added):
            out.append(f"{each.source.split(' (')[0]}: its added mass is zero, and so it is here")
        if each.left_out:
            out.append(f"{each.source.split(' (')[0]}: not used: {each.left_out}")
    for wing in source.stated.wings:
        if wing.left_out:
            out.append(f"lift of {wing.link}: not used: {wing.left_out}")
    return [*out, *_left_out(made, chosen=chosen)]


def _late_legs(made: NewRobot, source: Takeover) -> Iterator[str]:
    """Name servos of legs that follow their commands late, by the gains of the file."""
    joints = [name for leg in made.limbs.legs.values() for name in leg["joints"]]
    gains = [source.stated.servos[name] for name in joints if name in source.stated.servos]
    stiff = [(kd / kp, kd) for kp, kd in gains if kp > 0.0]
    if not stiff:
        return
    lag, damping = max(stiff)
    share = lag * float(gait_of(made.robot, made.limbs.legs)["highest"])
    if share > _LATE:
        yield (
            f"legs: servos of the file follow {lag:.2g} s late, {share:.0%} of a step: it may stop "
            f"short of its places; kp_each of {damping / DAMPED_ON_FOUR:.3g} N m/rad follows"
        )


def _beyond_the_model(made: NewRobot) -> Iterator[str]:
    """Name wheels, which no drive turns, and vehicles that air carries."""
    robot = made.robot
    free = [
        name
        for name, low, high in zip(robot.joints, robot.lower, robot.upper, strict=True)
        if name in made.limbs.others and not np.isfinite([low, high]).any()
    ]
    if free:
        yield f"joints without stops, such as wheels, are held at an angle: {', '.join(free)}"
    carried = _AIR * sum(hull.volume for hull in made.hulls.values()) / robot.mass.sum()
    if carried > _CARRIED:
        yield f"air would carry {carried:.0%} of its weight: lift in air is neglected"


def _in_degrees(source: Takeover) -> Iterator[str]:
    """Name angles of more than two turns, which are degrees most likely."""
    found = []
    for joint in source.root.iter("joint"):
        origin, limit = joint.find("origin"), joint.find("limit")
        words = [] if origin is None else origin.get("rpy", "").split()
        if limit is not None and joint.get("type") == "revolute":
            words += [limit.get("lower", "0"), limit.get("upper", "0")]
        if any(abs(float(word)) > _TWO_TURNS for word in words):
            found.append(str(joint.get("name")))
    if found:
        yield f"angles above two turns: {', '.join(found[:6])}; radians are expected, not degrees"


def _of_rotors(drives: Drives, robot: RobotModel) -> Iterator[str]:
    if "thrust" not in drives.sources:
        yield "rotors: thrust is chosen so that it hovers at half of full thrust"
    elif "max_speed" not in drives.sources:
        yield "rotors: the largest speed is chosen; check max_speed"
    if np.any(drives.axis[:, 2] < 0.5):
        yield "rotors: some do not point up; check axis"
    if "thrust" in drives.sources and "torque" not in drives.sources:
        yield "rotors: the drag torque is chosen; check torque_coefficient"
    if "direction" not in drives.sources:
        yield "rotors: directions of rotation alternate; check direction"
    followed = [link for link, _ in drives.by_carrier(robot) if link]
    yield from _of_tilting(drives, followed)


def _of_thrusters(drives: Drives, source: Takeover) -> Iterator[str]:
    if "max_force" not in drives.sources:
        yield "thrusters: the largest force is chosen; check axis and max_force"
    uneven = [
        motor.values
        for motor in source.stated.motors
        if {"max_force", "back_force"} <= motor.values.keys()
        and abs(motor.values["max_force"] - motor.values["back_force"])
        > 0.02 * motor.values["max_force"]
    ]
    if uneven:
        yield (
            f"thrusters: up to {uneven[0]['max_force']:g} N forwards and "
            f"{uneven[0]['back_force']:g} N backwards; max_force is the first for both"
        )
    yield from _of_tilting(drives)


def _of_tilting(drives: Drives, followed: Sequence[str] = ()) -> Iterator[str]:
    for link, joint in drives.tilting.items():
        if link in followed:
            yield f"{link} is tilted by the joint {joint}; the cascade commands both"
            continue
        yield f"{link} turns with the joint {joint}; its thrust keeps the direction of joint zero"


def _left_out(made: NewRobot, *, chosen: bool) -> Iterator[str]:
    """Name the effects of air, water and waves that the new robot lacks."""
    medium, hulls = made.medium, bool(made.hulls)
    if chosen and made.drives:
        yield f"medium: {medium.value} is taken; medium=air, water or both says otherwise"
        if any(drives.kind == ROTOR for drives in made.drives):
            yield "rotors: they turn one way; medium=both lets them turn backwards under water"
    if medium is RobotMedium.air and hulls:
        yield "left out: drag and added mass in water; medium=both writes them"
    if medium is RobotMedium.water:
        yield "left out: drag in air; medium=both writes it"
    if medium.wet and hulls:
        yield (
            "left out: waves that it makes (radiation_damping) and impacts on water (slamming); "
            "seals describe effect slamming"
        )
