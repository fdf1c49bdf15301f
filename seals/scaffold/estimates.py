"""Initial servo gains and hydrodynamic coefficients of a new robot, by rules of thumb."""

from __future__ import annotations

import math
import re

import numpy as np

from seals.arrays import Floats
from seals.check.joints import joint_loads_of
from seals.robot.model import RobotModel
from seals.scaffold.drag import WATER
from seals.scaffold.hydrodynamics import added_mass_of_ellipsoid, ellipsoid_of_moments
from seals.scaffold.limbs import SURFACE
from seals.scaffold.shapes import LinkHull
from seals.scaffold.takeover import Takeover

FREQUENCY, DAMPING = 6.0, 1.0
"""Natural frequency [Hz] and damping ratio of the servos: a brisk hobby servo, no overshoot."""
RESERVE = 3.0
"""Torque of a servo whose URDF states none, by the torque that holds its joint level."""
_LEAST_TORQUE = 0.01
_LEAST_INERTIA = 1e-7
"""Inertia about a joint below which its link is a frame [kg m^2]: a fin of one gram has more."""
WATER_PRESSURE, AIR_PRESSURE = 2000.0, 240.0
"""Dynamic pressure of water at 2 m/s and of air at 20 m/s [Pa]."""
LIQUID = 100.0
"""Density above which the medium of a wing is water [kg/m^3]."""
STIFFEST = 30.0
"""Natural frequency up to which a control surface is held by its stated effort [Hz]."""


def servo_values(robot: RobotModel, source: Takeover) -> dict[str, list[float]]:
    """Return gains and limits of the servos, one number per joint.

    Args:
        robot: with the joints that remain.
        source: the URDF, for limits of effort.
    """
    inertia, hold = joint_loads_of(robot)
    slowest = 2.0 * math.pi * FREQUENCY
    stated = np.array([source.effort_limit(name) for name in robot.joints])
    # what turns in the flow is held by the whole effort at the end of its travel
    travel = np.maximum(np.minimum(np.abs(robot.lower), np.abs(robot.upper)), 1e-3)
    stated = np.where(stated > 0.0, stated, _hinge_torques(robot, source, travel))
    limit = np.where(stated > 0.0, stated, np.maximum(RESERVE * hold, _LEAST_TORQUE))
    flown = [
        re.search(SURFACE, f"{name} {robot.links[robot.tree.child[j]]}", re.IGNORECASE) is not None
        for j, name in enumerate(robot.joints)
    ]
    stiff = np.where(flown, stated / travel, 0.0)
    # links without a mass of their own turn with the motor and gear of a servo
    motor = np.maximum(stiff / (2.0 * math.pi * STIFFEST) ** 2, _LEAST_INERTIA)
    armature = np.where(inertia < _LEAST_INERTIA, motor, 0.0)
    safe = inertia + armature
    rate = np.clip(np.sqrt(stiff / safe), slowest, 2.0 * math.pi * STIFFEST)
    values = {
        "kp_each": [short(x) for x in safe * rate**2],
        "kd_each": [short(x) for x in 2.0 * DAMPING * safe * rate],
        "torque_limit_each": [short(x) for x in limit],
    }
    if armature.any():
        values["armature_each"] = [short(x) for x in armature]
    return values


def _hinge_torques(robot: RobotModel, source: Takeover, travel: Floats) -> Floats:
    """Torques that hold the stated wings on links of joints at the end of their travel [N m].

    Equation:
        The lift q A d of slope A at the deflection d, at a tenth of the root of A from the hinge;
        q of water or air in brisk motion.
    """
    found = np.zeros(len(robot.joints))
    for wing in source.stated.wings:
        pressure = WATER_PRESSURE if wing.density > LIQUID else AIR_PRESSURE
        for j, link in enumerate(robot.tree.child[: len(found)]):
            if robot.links[link] == wing.link:
                lift = pressure * wing.area * min(float(travel[j]), 0.5)
                found[j] = max(found[j], 0.1 * lift * math.sqrt(wing.area))
    return found


def added_mass(hull: LinkHull) -> Floats:
    """Return the added mass in water of the ellipsoid with a hull's volume and second moments.

    Args:
        hull: of a link; the boxes around its shapes tell their second moments.

    Returns:
        Matrix about the link origin, order [linear, angular], shape (6, 6) [kg, kg m, kg m^2].
    """
    volume = np.array(hull.volumes)
    centres = np.array([box.centre for box in hull.boxes])
    middle = volume @ centres / volume.sum()
    spread = np.zeros((3, 3))
    for share, box in zip(volume / volume.sum(), hull.boxes, strict=True):
        arm = box.centre - middle
        spread += share * ((box.turn * box.edges**2 / 12.0) @ box.turn.T + np.outer(arm, arm))
    return added_mass_of_ellipsoid(ellipsoid_of_moments(volume.sum(), middle, spread), WATER)


def short(value: float) -> float:
    """Return a number with three significant digits.

    Example:
        >>> short(0.0123456)
        0.0123
    """
    return float(f"{value:.3g}")
