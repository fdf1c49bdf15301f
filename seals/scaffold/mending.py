"""Changes to a robot's file without which no body has its numbers, or that unburden the robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats
from seals.frames import matrix_of, quaternion_of_rpy
from seals.scaffold.shapes import LinkHull
from seals.scaffold.urdf import (
    ENDLESS,
    INERTIA,
    Element,
    UrdfDraft,
    end_of,
    fix,
    inertial_element,
    joint_element,
    mass_of,
    number_or,
    pose_at,
    pose_of,
    pose_text,
    tensor_of,
)

SMALL_PART = 0.05
"""Share of the robot's mass up to which an impossible inertia of a link is made sound [1]."""
MOST_CHANGED = 0.1
"""Share of a principal moment by which the inertia of a larger part is changed at most [1]."""
SLACK = 1e-4
"""Share of the largest moment by which a made inertia keeps the triangle inequality [1]."""
PART_DENSITY = 1000.0
"""Density of the ball whose inertia a small part gets that has mass and no inertia [kg/m^3]."""
FORWARD = {"x": 0.0, "-x": math.pi, "y": -math.pi / 2.0, "-y": math.pi / 2.0}
"""Turn about z that lays an axis of the base along x [rad]."""
NO_AXIS, LAST_DIGIT = 1e-9, 1e-15
"""Length of an axis that is none, and change of length that is a rounding [1]."""


def mended(robot: UrdfDraft, forward: str) -> list[str]:
    """Replace impossible numbers of a URDF, and return the changes, in words.

    Args:
        robot: changed.
        forward: axis of the base link that points forward, a key of :data:`FORWARD`.
    """
    changes = []
    if FORWARD.get(forward) and robot.links:
        changes.append(f"the frame '{turned_base(robot, forward)}' is the base: x ahead, z up")
    # the axes of joints a length of one: an engine may take the length for a gear ratio
    for axis in robot.root.iterfind("joint/axis"):
        given = np.array([float(word) for word in (axis.get("xyz") or "1 0 0").split()])
        length = float(np.linalg.norm(given))
        if np.isfinite(length) and length > NO_AXIS and abs(length - 1.0) > LAST_DIGIT:
            axis.set("xyz", " ".join(f"{x:.17g}" for x in given / length))
    endless = _endless_limits(robot)
    if endless:
        changes.append(f"infinite joint limits removed: {', '.join(endless[:6])}")
    still = fixed_joints(robot)
    if still:
        changes.append(f"joints without range of motion fixed: {', '.join(still[:6])}")
    name = weighted_base(robot)
    if name:
        changes.append(f"mass of '{name}' assigned to the massless base to which it is fixed")
    sound = sound_inertias(robot)
    if sound:
        changes.append(
            f"impossible inertia replaced by the nearest valid one: {', '.join(sound[:6])}"
        )
    return changes


def turned_base(robot: UrdfDraft, forward: str) -> str:
    """Add a frame above the base link that points forward along x, and return its name."""
    names = robot.links
    base, name = next(iter(robot.bases or names)), "body"
    while name in names:
        name += "_2"
    turn = matrix_of(quaternion_of_rpy(np.array([[0.0, 0.0, FORWARD[forward]]])))[0]
    robot.root.insert(0, ElementTree.Element("link", name=name))
    pose = pose_at(np.zeros(3), turn)
    robot.root.append(joint_element(f"{name}_joint", "fixed", name, base, pose))
    return name


def weighted_base(robot: UrdfDraft) -> str:
    """Give a base without mass the mass properties of the heaviest link fixed to it.

    Returns:
        Name of that link, empty if none is needed or there is none.
    """
    links, bases = robot.links, robot.bases
    if len(bases) != 1 or mass_of(links[bases[0]]) > 0.0:
        return ""
    base = links[bases[0]]
    placed, waiting = {bases[0]: np.eye(4)}, [bases[0]]
    below: dict[str, list[Element]] = {}
    for joint in robot.joints.values():
        if joint.get("type") == "fixed":
            below.setdefault(end_of(joint, "parent"), []).append(joint)
    while waiting:
        above = waiting.pop()
        for joint in below.get(above, []):
            child = end_of(joint, "child")
            if child not in placed:
                placed[child] = placed[above] @ pose_of(joint.find("origin"))
                waiting.append(child)
    name = max(placed, key=lambda one: mass_of(links.get(one)))
    if mass_of(links.get(name)) <= 0.0:
        return ""
    heavy = links[name]
    inertial = heavy.find("inertial")
    assert inertial is not None
    for old in base.findall("inertial"):
        base.remove(old)
    heavy.remove(inertial)
    heavy.append(inertial_element(0.0, np.zeros((3, 3))))
    pose = placed[name] @ pose_of(inertial.find("origin"))
    for old in inertial.findall("origin"):
        inertial.remove(old)
    inertial.insert(0, ElementTree.Element("origin", pose_text(pose)))
    base.insert(0, inertial)
    return name


def fixed_joints(robot: UrdfDraft) -> list[str]:
    """Fix joints whose two limits are one, as sensors are mounted; return their names."""
    found = []
    for name, joint in robot.joints.items():
        limit = joint.find("limit")
        if limit is None or joint.get("type") not in ("revolute", "prismatic"):
            continue
        if all(number_or(limit.get(key), math.nan) == 0.0 for key in ("lower", "upper")):
            fix(joint)
            found.append(name)
    return found


def _endless_limits(robot: UrdfDraft) -> list[str]:
    """Write limits that are none as a URDF does; return what became of them, in words.

    A hinge without any becomes continuous; else an endless side lies 1000 rad or m away.
    """
    found = []
    for name, joint in robot.joints.items():
        limit, kind = joint.find("limit"), joint.get("type")
        if limit is None or kind not in ("revolute", "prismatic"):
            continue
        stated = {key: number_or(limit.get(key), 0.0) for key in ("lower", "upper")}
        far = {key: value for key, value in stated.items() if abs(value) >= ENDLESS}
        if len(far) == 2 and kind == "revolute":
            joint.set("type", "continuous")
            for key in far:
                limit.attrib.pop(key)
            found.append(f"{name} is continuous")
        elif far:
            for key, value in far.items():
                limit.set(key, "-1000" if value < 0.0 else "1000")
            found.append(f"{name} 1000 away")
    return found


def sound_inertias(robot: UrdfDraft) -> list[str]:
    """Change inertias that no body has to the nearest that one has.

    Sensors and frames are often written with an inertia that breaks the triangle inequality of the
    principal moments, or is zero; beside the robot they weigh nothing. Moments of parts above
    :data:`SMALL_PART` change by equal precision, up to :data:`MOST_CHANGED`; beyond it they are
    left as they are, for the robot's own check to refuse.

    Args:
        robot: changed.

    Returns:
        Names of the links, of larger parts with their moments.
    """
    total = sum(map(mass_of, robot.links.values()))
    changed = []
    for name, link in robot.links.items():
        inertia, mass = link.find("inertial/inertia"), mass_of(link)
        if inertia is None or mass <= 0.0:
            continue
        small, was = mass <= SMALL_PART * total, tensor_of(inertia)
        near = _sound(was, mass) if small else _rounded_off(was)
        if near is None:
            continue
        for key, place in INERTIA.items():
            inertia.set(key, f"{near[place]:.9g}")
        words = (", ".join(f"{x:.3g}" for x in np.linalg.eigvalsh(each)) for each in (was, near))
        changed.append(name if small else f"{name} ({' becomes '.join(words)} kg m^2)")
    return changed


def _sound(tensor: Floats, mass: float) -> Floats | None:
    """Return the nearest inertia that a body has; None if it is one, or far from all."""
    if not np.all(np.isfinite(tensor)):
        return None
    if not np.any(tensor):
        radius = (0.75 * mass / (math.pi * PART_DENSITY)) ** (1.0 / 3.0)
        return np.asarray(0.4 * mass * radius**2 * np.eye(3), dtype=np.float64)
    moments, axes = np.linalg.eigh(tensor)
    excess = moments[2] - moments[0] - moments[1]
    if moments[0] < -1e-3 * moments[2] or excess <= 1e-3 * moments[2]:
        return None
    # the nearest point, by squares, of the plane on which one moment is the sum of the others
    moments += np.array([1.0, 1.0, -1.0]) * (excess + SLACK * moments[2]) / 3.0
    return np.asarray((axes * moments) @ axes.T, dtype=np.float64)


def _rounded_off(tensor: Floats) -> Floats | None:
    """Return the inertia of a body whose moments differ least by their shares; None if too far."""
    if not np.all(np.isfinite(tensor)):
        return None
    moments, axes = np.linalg.eigh(tensor)
    excess = moments[2] - moments[0] - moments[1]
    if moments[0] <= 0.0 or excess <= 1e-3 * moments[2]:
        return None
    # the nearest point of the same plane where each moment is known to the same share
    share = (excess + SLACK * moments[2]) / float(moments @ moments) * moments
    near = moments * (1.0 + share * np.array([1.0, 1.0, -1.0]))
    if share.max() > MOST_CHANGED:
        return None
    return np.asarray((axes * near) @ axes.T, dtype=np.float64)


def add_inertials(robot: UrdfDraft, hulls: Mapping[str, LinkHull], density: float) -> list[str]:
    """Give links without ``<inertial>``, or of mass 0, the mass properties of their shapes.

    Each shape counts as an even box of its own volume's mass: its inertia is exact for boxes, a
    fifth too large for cylinders and two thirds for spheres.

    Args:
        robot: changed.
        hulls: shapes by link.
        density: [kg/m^3].

    Returns:
        Names of the links.
    """
    changed = []
    for name, link in robot.links.items():
        if mass_of(link) <= 0.0 and name in hulls:
            for stated in link.findall("inertial"):
                link.remove(stated)
            link.insert(0, _inertial(hulls[name], density))
            changed.append(name)
    return changed


def _inertial(hull: LinkHull, density: float) -> Element:
    masses = density * np.array(hull.volumes)
    total = float(masses.sum())
    centre: Floats = masses @ np.array([box.centre for box in hull.boxes]) / total
    inertia = np.zeros((3, 3))
    for mass, box in zip(masses, hull.boxes, strict=True):
        squares = box.edges**2
        own = np.diag(mass / 12.0 * (squares.sum() - squares))
        arm = box.centre - centre
        inertia += box.turn @ own @ box.turn.T
        inertia += mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    origin = {"xyz": " ".join(f"{x:.6g}" for x in centre), "rpy": "0 0 0"}
    return inertial_element(total, inertia, origin, digits=6)
