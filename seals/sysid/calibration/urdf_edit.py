"""Mass and inertia of the base link written into the text of a URDF."""

from __future__ import annotations

import re

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.robot.model import RobotModel
from seals.robot.yaml_edit import figure

_INERTIAL = re.compile(r"<inertial\b.*?</inertial\s*>", re.DOTALL)


def base_inertial(
    robot: RobotModel, mass: float, turn: Floats, centre: Floats
) -> tuple[float, Floats, Floats]:
    """Return mass, centre and inertia of the base link under a change of the whole vehicle.

    Args:
        robot: with all links of its URDF.
        mass: change of the mass, at ``centre`` [kg].
        turn: change of the moments of inertia about the centre of gravity [kg m^2], shape (3,).
        centre: of gravity of the vehicle, base axes [m], shape (3,).

    Returns:
        Mass [kg], centre of mass [m] and inertia about it [kg m^2], base axes.

    Raises:
        ConfigError: other links are heavier than the whole vehicle would be.
    """
    own, new = float(robot.mass[0]), float(robot.mass[0]) + mass
    if new <= 0.0:
        raise ConfigError(
            f"the calibrated mass is less than that of the links beside '{robot.links[0]}'.\n"
            "Change their masses in the URDF by hand: the value is in calibration.json."
        )
    middle = (own * robot.centre[0] + mass * centre) / new
    inertia = robot.inertia[0] + np.diag(turn)
    inertia = inertia + own * _steiner(robot.centre[0] - middle)
    return new, middle, inertia + mass * _steiner(centre - middle)


def _steiner(arm: Floats) -> Floats:
    return (arm @ arm) * np.eye(3) - np.outer(arm, arm)


def with_inertial(text: str, link: str, mass: float, centre: Floats, inertia: Floats) -> str:
    """Return the text of a URDF with another mass, centre and inertia of one link.

    Args:
        text: of the file.
        link: its name.
        mass: [kg].
        centre: of mass, link axes [m], shape (3,).
        inertia: about it, link axes [kg m^2], shape (3, 3).

    Raises:
        ConfigError: the link has no inertial element of its own in this file.
    """
    start = re.search(rf"<link\s+name\s*=\s*[\"']{re.escape(link)}[\"'][^>]*>", text)
    end = text.find("</link", start.end()) if start else -1
    found = _INERTIAL.search(text, start.end(), end) if start and end > 0 else None
    if found is None:
        raise ConfigError(
            f'the URDF has no plain <inertial> in <link name="{link}">.\n'
            "Write mass and inertia by hand: the values are in calibration.json."
        )
    parts = {a + b: inertia["xyz".index(a), "xyz".index(b)] for a, b in _PAIRS}
    moments = " ".join(f'i{name}="{figure(value)}"' for name, value in parts.items())
    place = " ".join(figure(x) for x in centre)
    new = (
        f'<inertial><origin xyz="{place}" rpy="0 0 0"/><mass value="{figure(mass)}"/>'
        f"<inertia {moments}/></inertial>"
    )
    return text[: found.start()] + new + text[found.end() :]


_PAIRS = (("x", "x"), ("x", "y"), ("x", "z"), ("y", "y"), ("y", "z"), ("z", "z"))
"""Entries of an inertia matrix that a URDF states."""
