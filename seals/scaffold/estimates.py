"""Initial servo gains and hydrodynamic coefficients of a new robot, by rules of thumb."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.check.joints import joint_loads_of
from seals.robot.model import RobotModel
from seals.scaffold.shapes import Box, LinkHull
from seals.scaffold.takeover import Takeover

WATER = 1000.0
"""Density for the estimates [kg/m^3]."""
FREQUENCY, DAMPING = 6.0, 1.0
"""Natural frequency [Hz] and damping ratio of the servos: a brisk hobby servo, no overshoot."""
RESERVE = 3.0
"""Torque of a servo whose URDF states none, by the torque that holds its joint level."""
BLUFF = 1.0
"""Drag coefficient of a bluff body at these speeds [1]; cubes and cylinders lie at 0.8 to 1.2."""
CARRIED = 0.5
"""Added mass by displaced mass [1]: that of a sphere."""
_LEAST_TORQUE = 0.01


def servo_values(robot: RobotModel, source: Takeover) -> dict[str, list[float]]:
    """Return gains and limits of the servos, one number per joint.

    Args:
        robot: with the joints that remain.
        source: the URDF, for limits of effort.
    """
    inertia, hold = joint_loads_of(robot)
    rate = 2.0 * math.pi * FREQUENCY
    safe = np.maximum(inertia, 1e-7)
    stated = np.array([source.effort_limit(name) for name in robot.joints])
    limit = np.where(stated > 0.0, stated, np.maximum(RESERVE * hold, _LEAST_TORQUE))
    return {
        "kp_each": [short(x) for x in safe * rate**2],
        "kd_each": [short(x) for x in 2.0 * DAMPING * safe * rate],
        "torque_limit_each": [short(x) for x in limit],
    }


def water_effects(robot: RobotModel, hulls: Mapping[str, LinkHull]) -> dict[str, dict[str, Any]]:
    """Return drag and added mass in water: of the base, and the mean of all other links."""
    base = robot.links[0]
    others = [name for name in robot.links if name in hulls and name != base]
    out: dict[str, dict[str, Any]] = {}
    if base in hulls:
        out |= _of_hulls("hull", [base], [hulls[base]])
    if others:
        out |= _of_hulls("limb", others, [hulls[name] for name in others])
    return out


def _of_hulls(word: str, links: list[str], hulls: list[LinkHull]) -> dict[str, dict[str, Any]]:
    """Drag, rotational drag and added mass of some links, all alike."""
    boxes = [box for hull in hulls for box in hull.boxes]
    carried = CARRIED * WATER * float(np.mean([hull.volume for hull in hulls]))
    areas = sum((box.areas for box in boxes), np.zeros(3)) / len(hulls)
    drag = 0.5 * WATER * BLUFF * areas
    turning = sum((_turning(box) for box in boxes), np.zeros(3)) / len(hulls)
    where: dict[str, Any] = {"links": links}
    return {
        f"{word}_drag": {
            "effect": "quadratic_drag",
            "medium": "water",
            **where,
            **_axes("coefficient", drag),
        },
        f"{word}_turning": {
            "effect": "angular_drag",
            "medium": "water",
            **where,
            **_axes("quadratic", turning),
        },
        f"{word}_added_mass": {
            "effect": "added_mass",
            **where,
            **_axes("mass", np.full(3, carried)),
        },
    }


def _turning(box: Box) -> Floats:
    """Quadratic torque of one box turning about each axis of its link [N m s^2/rad^2].

    Strips of the box feel 1/2 rho C (w y)^2: about its own centre their moments sum to
    rho C l b^4 / 64 a face; its centre feels 1/2 rho C A r^3.
    """
    x, y, z = box.size
    own = WATER * BLUFF / 64.0 * np.array([x * (y**4 + z**4), y * (x**4 + z**4), z * (x**4 + y**4)])
    for k in range(3):
        arm = np.delete(box.centre, k)
        reach = float(np.hypot(*arm))
        if reach > 0.0:
            # moving across the arm: the shadow along one axis counts by the other's share of it
            facing = float(np.delete(box.areas, k) @ np.abs(arm[::-1])) / reach
            own[k] += 0.5 * WATER * BLUFF * facing * reach**3
    return own


def _axes(stem: str, values: Floats) -> dict[str, float]:
    return {f"{stem}_{axis}": short(x) for axis, x in zip("xyz", values, strict=True)}


def short(value: float) -> float:
    """Return a number with three significant digits.

    Example:
        >>> short(0.0123456)
        0.0123
    """
    return float(f"{value:.3g}")
