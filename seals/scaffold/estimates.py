"""Initial servo gains and hydrodynamic coefficients of a new robot, by rules of thumb.

Drag in water follows from the shapes of the hulls.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.check.joints import joint_loads_of
from seals.control.plant import ROTOR
from seals.effects.drag_form import DragForm, HullAxis, form_of_hull
from seals.environment.seawater import FRESH_WATER
from seals.hydrostatics import HullBox, HullCapsule, HullCylinder, HullSphere
from seals.hydrostatics.wetted import Hull
from seals.multibody.tree import poses_in_base
from seals.robot.model import RobotModel
from seals.scaffold.hydrodynamics import ellipsoid_of_moments
from seals.scaffold.limbs import SURFACE
from seals.scaffold.motors import LIQUID
from seals.scaffold.rotors import Drives
from seals.scaffold.shapes import Box, LinkHull
from seals.scaffold.takeover import Takeover

WATER, AIR = FRESH_WATER, 1.2
"""Densities for the estimates [kg/m^3]."""
BLUFF = 1.0
"""Drag coefficient of a bluff body at these speeds [1]; cubes and cylinders lie at 0.8 to 1.2."""
SPHERE = 0.47
"""That of a sphere below the drag crisis (Hoerner 1965)."""
ROUND = 0.3
"""That of a capsule along its axis: hemispherical ends (Hoerner 1965)."""
FRICTION = 0.01
"""Skin friction of a turning round body [1], order of Sawatzki 1970 for spheres."""


class LinkDrag(NamedTuple):
    """Drag of links that share the same numbers.

    Args:
        options: form and size of the body; empty for drag per axis.
        coefficients: along the link axes [N s^2/m^2], shape (3,).
        turning: quadratic drag of turning that the form does not hold [N m s^2/rad^2], shape (3,).
    """

    options: dict[str, Any]
    coefficients: Floats
    turning: Floats

    @property
    def source(self) -> str:
        """Origin of the numbers, in words."""
        return "drag of the shape of the hull" if self.options else "bluff boxes around the shapes"


def drag_of(hulls: Sequence[LinkHull]) -> LinkDrag:
    """Return the mean drag of links: by the form of their common shape, else as bluff boxes."""
    forms = [form_of_hull(_only_shape(hull)) for hull in hulls]
    kinds = {(form.get("form"), form.get("axis")) for form in forms}
    if len(kinds) > 1 or not forms[0]:
        boxes = [box for hull in hulls for box in hull.boxes]
        areas = sum((box.areas for box in boxes), np.zeros(3)) / len(hulls)
        turning = sum((_box_turning(box) for box in boxes), np.zeros(3)) / len(hulls)
        return LinkDrag({}, 0.5 * WATER * BLUFF * areas, turning)
    lengths = [k for k, v in forms[0].items() if isinstance(v, float)]
    mean = {k: float(np.mean([form[k] for form in forms])) for k in lengths}
    used = {k: v for k, v in mean.items() if round(v, 6)}
    chosen: dict[str, Any] = {k: forms[0][k].value for k in ("form", "axis") if k in forms[0]}
    each = [_of_one_shape(hull, form) for hull, form in zip(hulls, forms, strict=True)]
    drag, turning = (np.mean(part, axis=0) for part in zip(*each, strict=True))
    return LinkDrag({**chosen, **used}, drag, turning)


def _only_shape(hull: LinkHull) -> Hull | None:
    """Hull of a link that consists of one primitive; None for other links."""
    shape = hull.shapes[0]
    if len(hull.shapes) > 1 or shape["type"] == "mesh":
        return None
    size, position = shape["size"], shape.get("position", (0.0, 0.0, 0.0))
    if shape["type"] == "sphere":
        return HullSphere(radius=size[0], position=position)
    rpy = shape.get("rpy", (0.0, 0.0, 0.0))
    if shape["type"] == "box":
        return HullBox(size=size, position=position, rpy=rpy)
    made = HullCylinder if shape["type"] == "cylinder" else HullCapsule
    return made(radius=size[0], length=size[1], position=position, rpy=rpy)


def _of_one_shape(hull: LinkHull, form: dict[str, Any]) -> tuple[Floats, Floats]:
    """Coefficients along the link axes, and friction of a round body about its own axis."""
    areas, size = hull.boxes[0].areas, hull.shapes[0]["size"]
    if form["form"] is DragForm.faces:
        return 0.5 * WATER * BLUFF * areas, np.zeros(3)
    radius, disc = size[0], 0.25 * np.pi
    if form["form"] is DragForm.isotropic:
        turning = np.full(3, FRICTION * WATER * radius**5)
        return 0.5 * WATER * SPHERE * disc * areas, turning
    along = np.eye(3)[list(HullAxis).index(form["axis"])]
    capsule = hull.shapes[0]["type"] == "capsule"
    across = areas - (4.0 - np.pi) * radius**2 * capsule
    end = disc * (ROUND if capsule else BLUFF)
    factor = 0.5 * WATER * (BLUFF * across * (1.0 - along) + end * areas * along)
    return factor, along * np.pi * FRICTION * WATER * radius**4 * size[1]


def _box_turning(box: Box) -> Floats:
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
    origins, turns = poses_in_base(robot.tree)
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
    origins, turns = poses_in_base(robot.tree)
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
