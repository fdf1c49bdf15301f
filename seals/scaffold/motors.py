"""Motors that a file states, or that names of links tell: their places, axes and laws."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seals.arrays import Floats
from seals.control.plant import ROTOR, THRUSTER
from seals.multibody.tree import poses_in_base
from seals.robot.model import RobotModel
from seals.scaffold.plug_ins import Motor
from seals.scaffold.takeover import Takeover
from seals.scaffold.urdf import refuse_unknown

_SAME_PLACE = 1e-6
"""Distance below which frames of two links coincide [m]."""
MOST_PUSH = 50.0
"""Thrust of one rotor by the weight beyond which its constant is no thrust by squared speed [1]."""
LIQUID = 100.0
"""Density above which the medium of a wing is water [kg/m^3]."""
UPRIGHT = 0.5
"""Mean upright part of the axes from which on propellers carry a vehicle [1]."""


def without_strange_laws(motors: Sequence[Motor], weight: float, changes: list[str]) -> list[Motor]:
    """Leave out constants of motor models whose law is not thrust by squared speed."""
    found = []
    for motor in motors:
        values = dict(motor.values)
        full = values.get("thrust", 0.0) * values.get("max_speed", 0.0) ** 2
        if full > MOST_PUSH * weight:
            for key in ("thrust", "torque", "max_speed"):
                values.pop(key, None)
            changes.append(
                f"{motor.source} of {motor.joint or motor.link}: thrust constant not used: times "
                f"the square of the largest speed it is {full:.3g} N, {full / weight:.3g} times "
                "the weight, so it belongs to another law; the thrust is chosen"
            )
        found.append(motor._replace(values=values))
    return found


def flies(source: Takeover, medium: str) -> bool:
    """Return whether propellers work in air: stated, or implied by wings in air."""
    return medium == "air" or any(wing.density < LIQUID for wing in source.stated.wings)


def level_ones(
    motors: Sequence[Motor], robot: RobotModel, source: Takeover, medium: str
) -> list[Motor]:
    """Return motor models of propellers that lie level, in water, as thrusters along their axes.

    Of a vehicle whose hydrodynamics the file states all propellers are, unless they all lift it.
    """
    rotors = [m for m in motors if m.kind == ROTOR and m.values]
    if flies(source, medium) or not rotors or len(rotors) < len(motors):
        return list(motors)
    links = [link_of(motor, robot, source) for motor in rotors]
    turns = poses_in_base(robot.tree)[1]
    axes = [
        axis_of(robot, k, ROTOR) if m.axis is None else turns[k] @ np.array(m.axis)
        for k, m in zip(links, rotors, strict=True)
    ]
    upright = np.abs(np.array(axes)[:, 2])
    dives = bool(source.stated.hydrodynamics) and float(upright.min()) < UPRIGHT
    if np.mean(upright) > UPRIGHT and not dives:
        return list(motors)
    found = []
    for motor, k, axis in zip(rotors, links, axes, strict=True):
        values = dict(motor.values)
        force = values.pop("thrust", 0.0) * values.pop("max_speed", 0.0) ** 2
        values = {key: v for key, v in values.items() if key in ("time_constant", "radius")}
        own = turns[k].T @ axis
        found.append(
            motor._replace(
                kind=THRUSTER,
                values={**values, **({"max_force": force} if force > 0.0 else {})},
                axis=(float(own[0]), float(own[1]), float(own[2])),
            )
        )
    source.changes.append(
        "propellers with a horizontal axis become thrusters"
        if not dives
        else "propellers of a vehicle with stated hydrodynamics become thrusters"
    )
    return found


def hubs_of(robot: RobotModel, links: Sequence[int], motors: Sequence[Motor]) -> list[Floats]:
    """Hubs of drives in axes of their links [m], shape (3,) each.

    A link without mass has no other use for the origin of its ``<inertial>`` than to state a
    place; and where frames of links that were found by their names coincide, the file has all of
    them at its base and their centres of mass at the hubs.
    """
    hubs = [np.array(motor.position, dtype=float) for motor in motors]
    if any(motor.values for motor in motors):
        # motor models push at the origin of their link
        return hubs
    frames = poses_in_base(robot.tree)[0][list(links)]
    apart = np.linalg.norm(frames[:, None] - frames[None], axis=2) + np.diag(np.ones(len(links)))
    together = apart.min(axis=1, initial=np.inf) < _SAME_PLACE
    centres = [robot.centre[k] for k in links]
    return [
        centre if not hub.any() and (robot.mass[k] <= 0.0 or both) else hub
        for k, hub, centre, both in zip(links, hubs, centres, together, strict=True)
    ]


def axis_of(robot: RobotModel, link: int, kind: str) -> Floats:
    """Axis of a drive in base axes: that of its joint, else z of a rotor and x of a thruster."""
    joint = robot.tree.joint[link]
    ahead = np.array([0.0, 0.0, 1.0] if kind == ROTOR else [1.0, 0.0, 0.0])
    own = robot.tree.axis[joint] if joint >= 0 else ahead
    axis: Floats = poses_in_base(robot.tree)[1][link] @ own
    return axis


def link_of(motor: Motor, robot: RobotModel, source: Takeover) -> int:
    """Link of a stated drive: the named link, or the child of the named joint."""
    link = source.child_of(motor.joint) if motor.joint else motor.link
    if not link or (link not in robot.links and motor.link in robot.links):
        link = motor.link
    if link not in robot.links:
        what, known = ("joint", source.joints) if motor.joint else ("link", robot.links)
        refuse_unknown(motor.source, what, motor.joint or motor.link, list(known))
    return robot.links.index(link)
