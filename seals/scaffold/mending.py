"""Changes to a robot's file without which no body has its numbers, or that unburden the robot."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats
from seals.frames import matrix_of, quaternion_of_rpy
from seals.scaffold.shapes import LinkHull
from seals.scaffold.takeover import Element
from seals.scaffold.urdf_elements import ENDLESS, joint_element, link_element, pose_text

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
INERTIA_KEYS = {
    "ixx": (0, 0),
    "ixy": (0, 1),
    "ixz": (0, 2),
    "iyy": (1, 1),
    "iyz": (1, 2),
    "izz": (2, 2),
}
"""Rows and columns of the inertia's attributes."""


def mended(root: Element, forward: str) -> list[str]:
    """Change a URDF so that bodies can have its numbers, and return what was changed, in words.

    Args:
        root: of the URDF; changed.
        forward: axis of the base link that points forward, a key of :data:`FORWARD`.
    """
    changes = []
    if FORWARD.get(forward):
        changes.append(f"the frame '{turned_base(root, forward)}' is the base: x ahead, z up")
    unit_axes(root)
    endless = endless_limits(root)
    if endless:
        changes.append(f"endless limits of joints: {', '.join(endless[:6])}")
    still = fixed_joints(root)
    if still:
        changes.append(f"joints without room to move fixed: {', '.join(still[:6])}")
    name = weighted_base(root)
    if name:
        changes.append(f"mass of '{name}' belongs to the base it is fixed to, which had none")
    sound = sound_inertias(root)
    if sound:
        changes.append(f"inertia of no body made the nearest of one: {', '.join(sound[:6])}")
    return changes


def turned_base(root: Element, forward: str) -> str:
    """Add a frame above the base link that points forward along x, and return its name."""
    children = {_end(joint, "child") for joint in root.findall("joint")}
    names = [str(link.get("name")) for link in root.findall("link")]
    base = next((name for name in names if name not in children), names[0])
    name = "body"
    while name in names:
        name += "_2"
    pose = np.eye(4)
    pose[:3, :3] = matrix_of(quaternion_of_rpy(np.array([[0.0, 0.0, FORWARD[forward]]])))[0]
    root.insert(0, link_element(name))
    root.append(joint_element(f"{name}_joint", "fixed", name, base, pose))
    return name


def weighted_base(root: Element) -> str:
    """Give a base without mass the mass properties of the heaviest link fixed to it.

    Returns:
        Name of that link, empty where none is needed or there is none.
    """
    joints = root.findall("joint")
    children = {_end(joint, "child") for joint in joints}
    links = {str(link.get("name")): link for link in root.findall("link")}
    bases = [name for name in links if name not in children]
    if len(bases) != 1 or _mass(links[bases[0]]) > 0.0:
        return ""
    placed = {bases[0]: np.eye(4)}
    below: dict[str, list[Element]] = {}
    for joint in joints:
        if joint.get("type") == "fixed":
            below.setdefault(_end(joint, "parent"), []).append(joint)
    waiting = [bases[0]]
    while waiting:
        above = waiting.pop()
        for joint in below.get(above, []):
            child = _end(joint, "child")
            if child not in placed:
                placed[child] = placed[above] @ _pose(joint.find("origin"))
                waiting.append(child)
    name = max(placed, key=lambda one: _mass(links.get(one)))
    inertial = links[name].find("inertial") if name in links else None
    if inertial is None or _mass(links[name]) <= 0.0:
        return ""
    for old in links[bases[0]].findall("inertial"):
        links[bases[0]].remove(old)
    links[name].remove(inertial)
    none = ElementTree.SubElement(links[name], "inertial")
    ElementTree.SubElement(none, "mass", {"value": "0"})
    ElementTree.SubElement(none, "inertia", dict.fromkeys(INERTIA_KEYS, "0"))
    pose = placed[name] @ _pose(inertial.find("origin"))
    for old in inertial.findall("origin"):
        inertial.remove(old)
    inertial.insert(0, ElementTree.Element("origin", pose_text(pose)))
    links[bases[0]].insert(0, inertial)
    return name


def fixed_joints(root: Element) -> list[str]:
    """Fix joints whose two limits are one, as sensors are mounted; return their names."""
    found = []
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        if joint.get("type") not in ("revolute", "prismatic") or limit is None:
            continue
        lower, upper = (_value(limit, key) for key in ("lower", "upper"))
        if lower == upper == 0.0 and limit.get("lower") and limit.get("upper"):
            joint.set("type", "fixed")
            for part in (*joint.findall("axis"), *joint.findall("dynamics"), limit):
                joint.remove(part)
            found.append(str(joint.get("name")))
    return found


def endless_limits(root: Element) -> list[str]:
    """Write limits that are none as a URDF does; return what became of them, in words.

    A hinge without any becomes continuous; else an endless side lies 1000 rad or m away.
    """
    found = []
    for joint in root.findall("joint"):
        limit, kind = joint.find("limit"), joint.get("type")
        if limit is None or kind not in ("revolute", "prismatic"):
            continue
        far = [k for k in ("lower", "upper") if abs(_value(limit, k)) >= ENDLESS]
        if not far:
            continue
        if len(far) == 2 and kind == "revolute":
            joint.set("type", "continuous")
            for key in far:
                limit.attrib.pop(key)
            found.append(f"{joint.get('name')} is continuous")
            continue
        for key in far:
            limit.set(key, "-1000" if _value(limit, key) < 0.0 else "1000")
        found.append(f"{joint.get('name')} 1000 away")
    return found


def unit_axes(root: Element) -> None:
    """Give the axes of joints a length of one: an engine may take the length for a gear ratio."""
    for axis in root.iterfind("joint/axis"):
        given = np.array(list(_three(axis.get("xyz") or "1 0 0")))
        length = float(np.linalg.norm(given))
        if np.isfinite(length) and length > NO_AXIS and abs(length - 1.0) > LAST_DIGIT:
            axis.set("xyz", " ".join(f"{x:.17g}" for x in given / length))


def sound_inertias(root: Element) -> list[str]:
    """Change inertias that no body has to the nearest that one has.

    Sensors and frames are often written with an inertia that breaks the triangle inequality of the
    principal moments, or is zero; beside the robot they weigh nothing. Moments of parts above
    :data:`SMALL_PART` change by equal precision, up to :data:`MOST_CHANGED`; beyond it they are
    left as they are, for the robot's own check to refuse.

    Args:
        root: of the URDF; changed.

    Returns:
        Names of the links, of larger parts with their moments.
    """
    links = root.findall("link")
    total = sum(_mass(link) for link in links)
    changed = []
    for link in links:
        inertia = link.find("inertial/inertia")
        if inertia is None or _mass(link) <= 0.0:
            continue
        small = _mass(link) <= SMALL_PART * total
        was = _tensor(inertia)
        near = _sound(was, _mass(link)) if small else _rounded_off(was)
        if near is None:
            continue
        for key, place in INERTIA_KEYS.items():
            inertia.set(key, f"{near[place]:.9g}")
        changed.append(f"{link.get('name')}{'' if small else _moments(was, near)}")
    return changed


def _sound(tensor: Floats, mass: float) -> Floats | None:
    """Return the nearest inertia that a body has; None where it is one, or far from all."""
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


def _moments(was: Floats, near: Floats) -> str:
    """Return the principal moments before and after in words."""
    words = (", ".join(f"{x:.3g}" for x in np.linalg.eigvalsh(each)) for each in (was, near))
    return f" ({' becomes '.join(words)} kg m^2)"


def _tensor(inertia: Element) -> Floats:
    tensor = np.zeros((3, 3))
    for key, (i, j) in INERTIA_KEYS.items():
        tensor[i, j] = tensor[j, i] = _value(inertia, key)
    return tensor


def _mass(link: Element | None) -> float:
    mass = None if link is None else link.find("inertial/mass")
    value = 0.0 if mass is None else _value(mass, "value")
    return value if math.isfinite(value) else 0.0


def _pose(origin: Element | None) -> Floats:
    pose = np.eye(4)
    if origin is not None:
        pose[:3, 3] = list(_three(origin.get("xyz")))
        turn = np.array([list(_three(origin.get("rpy")))])
        pose[:3, :3] = matrix_of(quaternion_of_rpy(turn))[0]
    return pose


def _three(text: str | None) -> Iterator[float]:
    return (float(word) for word in (text or "0 0 0").split())


def _end(joint: Element, which: str) -> str:
    element = joint.find(which)
    return "" if element is None else str(element.get("link"))


def _value(element: Element, key: str) -> float:
    try:
        return float(element.get(key, "0"))
    except ValueError:
        return math.nan


def add_inertials(root: Element, hulls: Mapping[str, LinkHull], density: float) -> list[str]:
    """Add mass properties to links without ``<inertial>``, from their shapes.

    Each shape counts as an even box of its own volume's mass: its inertia is exact for boxes, a
    fifth too large for cylinders and two thirds for spheres.

    Args:
        root: of the URDF; changed.
        hulls: shapes by link.
        density: [kg/m^3].

    Returns:
        Names of the links.
    """
    changed = []
    for link in root.findall("link"):
        name = str(link.get("name"))
        if link.find("inertial") is None and name in hulls:
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
    element = ElementTree.Element("inertial")
    words = " ".join(f"{x:.6g}" for x in centre)
    ElementTree.SubElement(element, "origin", {"xyz": words, "rpy": "0 0 0"})
    ElementTree.SubElement(element, "mass", {"value": f"{total:.6g}"})
    values = {key: f"{inertia[place]:.6g}" for key, place in INERTIA_KEYS.items()}
    ElementTree.SubElement(element, "inertia", values)
    return element
