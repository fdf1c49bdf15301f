"""Initial servo gains and hydrodynamic coefficients of a new robot, by rules of thumb."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

import numpy as np

from seals.arrays import Floats
from seals.check.joints import joint_loads_of
from seals.control.plant import ROTOR, rest_poses
from seals.robot.model import RobotModel
from seals.scaffold.drag import WATER, drag_of
from seals.scaffold.hydrodynamics import ellipsoid_of_moments
from seals.scaffold.limbs import SURFACE
from seals.scaffold.motors import LIQUID
from seals.scaffold.rotors import Drives
from seals.scaffold.shapes import LinkHull
from seals.scaffold.takeover import Takeover

FREQUENCY, DAMPING = 6.0, 1.0
"""Natural frequency [Hz] and damping ratio of the servos: a brisk hobby servo, no overshoot."""
RESERVE = 3.0
"""Torque of a servo whose file states none, by all that loads its joint [1]."""
SWING = 0.5 * (2.0 * math.pi) ** 2
"""Angular acceleration of a swing of half a radian at 1 Hz [rad/s^2]."""
GIVE = 0.05
"""Angle by which full thrust may turn a joint against its servo [rad]."""
STREAM = 1.0
"""Speed of the water whose drag loads a joint [m/s]."""
NO_LIMIT = 1e6
"""Torque limit of a joint whose file says that it has none [N m]."""
_LEAST_TORQUE = 0.01
_LEAST_INERTIA = 1e-7
"""Inertia about a joint below which its link is a frame [kg m^2]: a fin of one gram has more."""
WATER_PRESSURE, AIR_PRESSURE = 2000.0, 240.0
"""Dynamic pressure of water at 2 m/s and of air at 20 m/s [Pa]."""
STIFFEST = 30.0
"""Natural frequency up to which a control surface is held by its stated effort [Hz]."""


def servo_values(
    robot: RobotModel, source: Takeover, thrust: Floats | float = 0.0, water: Floats | float = 0.0
) -> dict[str, list[float]]:
    """Return gains and limits of the servos, one number per joint.

    Args:
        robot: with the joints that remain.
        source: the URDF, for limits of effort.
        thrust: largest load by drives, see `thrust_loads`, shape (J,) [N m or N].
        water: load by the water, see `water_loads`, shape (J,) [N m or N].
    """
    inertia, hold = joint_loads_of(robot)
    slowest = 2.0 * math.pi * FREQUENCY
    efforts = np.array([source.effort_limit(name) for name in robot.joints])
    stated = np.where(np.isinf(efforts), 0.0, efforts)
    # what turns in the flow is held by the whole effort at the end of its travel
    travel = np.maximum(np.minimum(np.abs(robot.lower), np.abs(robot.upper)), 1e-3)
    stated = np.where(stated > 0.0, stated, _hinge_torques(robot, source, travel))
    loads = hold + SWING * inertia + thrust + water
    limit = np.where(stated > 0.0, stated, np.maximum(RESERVE * loads, _LEAST_TORQUE))
    limit = np.where(np.isinf(efforts), NO_LIMIT, np.minimum(limit, NO_LIMIT))
    flown = [
        re.search(SURFACE, f"{name} {robot.links[robot.tree.child[j]]}", re.IGNORECASE) is not None
        for j, name in enumerate(robot.joints)
    ]
    # fins reach the end of their travel, and what a thrust bears on gives way by little
    stiff = np.maximum(np.where(flown, stated / travel, 0.0), np.asarray(thrust) / GIVE)
    # links without a mass of their own turn with the motor and gear of a servo
    motor = np.maximum(stiff / (2.0 * math.pi * STIFFEST) ** 2, _LEAST_INERTIA)
    geared = np.array([source.stated.armature.get(name, 0.0) for name in robot.joints])
    armature = np.where((inertia < _LEAST_INERTIA) & (geared == 0.0), motor, geared)
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


def thrust_loads(robot: RobotModel, drives: Sequence[Drives]) -> Floats:
    """Return what full thrust loads each joint with, all joints at zero [N m or N], shape (J,).

    Equation:
        |h . ((p - o) x a)| T + |h . a| Q, summed over the drives with thrust T and reaction Q along
        a at p beyond a hinge h at o; |h . a| T for one that slides.

    Args:
        robot: with the joints that remain.
        drives: in base axes, joints at zero.
    """
    origins, turns = rest_poses(robot)
    found = np.zeros(robot.tree.joints)
    for j, child in enumerate(robot.tree.child):
        hinge, place = turns[child] @ robot.tree.axis[j], origins[child]
        for each in drives:
            for k, name in enumerate(each.links):
                if not robot.tree.moves[robot.links.index(name), j]:
                    continue
                power = each.max_speed[k] ** 2 if each.kind == ROTOR else 1.0
                along = abs(float(hinge @ each.axis[k]))
                if robot.tree.prismatic[j]:
                    found[j] += along * each.thrust[k] * power
                    continue
                lever = abs(float(np.cross(hinge, each.position[k] - place) @ each.axis[k]))
                found[j] += (lever * each.thrust[k] + along * each.torque[k]) * power
    return found


def water_loads(robot: RobotModel, hulls: Mapping[str, LinkHull]) -> Floats:
    """Return what water loads each joint with, all joints at zero [N m or N], shape (J,).

    Equation:
        r (D u^2 + r M_A SWING), summed over the hulls at the distance r of their middles from the
        hinge: their largest drag D at u = `STREAM`, and their largest added mass M_A; r = 1 for a
        joint that slides.

    Args:
        robot: with the joints that remain.
        hulls: by link.
    """
    origins, turns = rest_poses(robot)
    found = np.zeros(robot.tree.joints)
    for name, hull in hulls.items():
        link = robot.links.index(name)
        joints = np.flatnonzero(robot.tree.moves[link])
        if not len(joints):
            continue
        volume, centres = np.array(hull.volumes), np.array([box.centre for box in hull.boxes])
        middle = origins[link] + turns[link] @ (volume @ centres / volume.sum())
        drag = float(drag_of([hull]).coefficients.max()) * STREAM**2
        carried = float(np.diag(added_mass(hull))[:3].max()) * SWING
        for j in joints:
            child = robot.tree.child[j]
            hinge, off = turns[child] @ robot.tree.axis[j], middle - origins[child]
            away = float(np.linalg.norm(off - (off @ hinge) * hinge))
            arm = 1.0 if robot.tree.prismatic[j] else away
            found[j] += arm * (drag + carried * arm)
    return found


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
    return ellipsoid_of_moments(volume.sum(), middle, spread).added_mass(WATER)


def short(value: float) -> float:
    """Return a number with three significant digits.

    Example:
        >>> short(0.0123456)
        0.0123
    """
    return float(f"{value:.3g}")
