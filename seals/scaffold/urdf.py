"""URDF of a robot on its way into a folder: read, changed, filled by other formats, written."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TypeAlias
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats
from seals.errors import RobotError, refuse_unlisted
from seals.frames import matrix_of, quaternion_of_rpy

Element: TypeAlias = "ElementTree.Element[str]"
WORLD = "world"
"""Name of the link without mass that stands for the world: a base of this name does not move."""
ENDLESS = 1e9
"""Limits of joints from which on there is none: files write 1e16, 1.8e308 or inf [any unit]."""
INERTIA = {
    "ixx": (0, 0),
    "ixy": (0, 1),
    "ixz": (0, 2),
    "iyy": (1, 1),
    "iyz": (1, 2),
    "izz": (2, 2),
}
"""Rows and columns of the inertia's attributes."""


class UrdfDraft:
    """Links and joints of a URDF, which change as it is taken over.

    Args:
        root: the ``<robot>`` element.
    """

    def __init__(self, root: Element) -> None:
        self.root = root

    @property
    def links(self) -> dict[str, Element]:
        """All links, by name."""
        return {str(link.get("name")): link for link in self.root.findall("link")}

    @property
    def joints(self) -> dict[str, Element]:
        """All joints, by name."""
        return {str(joint.get("name")): joint for joint in self.root.findall("joint")}

    @property
    def bases(self) -> list[str]:
        """Links that no joint has as its child: one, where the joints form a tree."""
        children = {end_of(joint, "child") for joint in self.root.findall("joint")}
        return [name for name in self.links if name not in children]

    def write(self, path: Path) -> None:
        """Write the file; frames get a mass of zero: PyBullet warns of links without."""
        for link in self.links.values():
            if link.find("inertial") is None:
                link.append(inertial_element(0.0, np.zeros((3, 3))))
        # PyBullet breaks lines of more than a thousand signs, in the middle of a name too
        ElementTree.indent(self.root)
        text = ElementTree.tostring(self.root, encoding="unicode")
        path.write_text(f'<?xml version="1.0"?>\n{text}\n', encoding="utf-8")


def refuse_unknown(said: str, what: str, name: str, known: Collection[str]) -> None:
    """Refuse the name of a link or joint that is not there.

    Raises:
        RobotError: what is `said` names it.
    """
    refuse_unlisted(
        name, known, f"{said} names the {what} '{name}', which does not exist", error=RobotError
    )


def end_of(joint: Element, which: str) -> str:
    """Return the link at an end of a joint, ``parent`` or ``child``; empty if it has none."""
    element = joint.find(which)
    return "" if element is None else str(element.get("link"))


def fix(joint: Element, *more: str) -> None:
    """Make a joint fixed: without axis, limits and dynamics, nor elements of some more names."""
    joint.set("type", "fixed")
    for tag in ("axis", "limit", "dynamics", *more):
        for part in joint.findall(tag):
            joint.remove(part)


def mass_of(link: Element | None) -> float:
    """Return the stated mass of a link, zero if it states none [kg]."""
    mass = None if link is None else link.find("inertial/mass")
    value = 0.0 if mass is None else number_or(mass.get("value"), 0.0)
    return value if math.isfinite(value) else 0.0


def tensor_of(inertia: Element) -> Floats:
    """Return the tensor of an ``<inertia>``, shape (3, 3) [kg m^2]."""
    tensor = np.zeros((3, 3))
    for key, (i, j) in INERTIA.items():
        tensor[i, j] = tensor[j, i] = number_or(inertia.get(key, "0"), math.nan)
    return tensor


def triple_of(origin: Element | None, key: str) -> Floats:
    """Return the ``xyz`` or ``rpy`` of an ``<origin>``, shape (3,); zeros where it has none."""
    text = None if origin is None else origin.get(key)
    return np.array([float(word) for word in (text or "0 0 0").split()])


def pose_of(origin: Element | None) -> Floats:
    """Return the pose of an ``<origin>``, shape (4, 4)."""
    turn = matrix_of(quaternion_of_rpy(triple_of(origin, "rpy")[None]))[0]
    return pose_at(triple_of(origin, "xyz"), turn)


def pose_at(position: Floats, turn: Floats) -> Floats:
    """Return the pose of a position [m], shape (3,), and a rotation, shape (3, 3)."""
    pose = np.eye(4)
    pose[:3, 3], pose[:3, :3] = position, turn
    return pose


def number_or(text: str | None, default: float) -> float:
    """Return the number in a text, else a default; words such as inf are numbers.

    Example:
        >>> number_or("-inf", 0.0), number_or("", 0.0)
        (-inf, 0.0)
    """
    try:
        value = float(text or default)
    except ValueError:
        return default
    return default if math.isnan(value) else value


def inertial_element(
    mass: float, tensor: Floats, origin: dict[str, str] | None = None, *, digits: int = 9
) -> Element:
    """Return an ``<inertial>``.

    Args:
        mass: [kg].
        tensor: about the centre of mass, shape (3, 3) [kg m^2].
        origin: its attributes, see `pose_text`; None for none.
        digits: of its numbers.
    """
    inertial = ElementTree.Element("inertial")
    if origin is not None:
        ElementTree.SubElement(inertial, "origin", origin)
    ElementTree.SubElement(inertial, "mass", value=f"{mass:.{digits}g}")
    values = {key: f"{tensor[place]:.{digits}g}" for key, place in INERTIA.items()}
    ElementTree.SubElement(inertial, "inertia", values)
    return inertial


def cylinder_element(radius: float, length: float, *, capped: bool = False) -> Element:
    """Return a cylinder; a capsule, which URDF lacks, becomes one of equal radius and volume.

    Args:
        radius: [m].
        length: of the cylinder, or of the straight part of the capsule [m].
        capped: whether it is a capsule.
    """
    whole = length + (4.0 / 3.0 * radius if capped else 0.0)
    return ElementTree.Element("cylinder", {"radius": f"{radius:.9g}", "length": f"{whole:.9g}"})


def joint_element(
    name: str,
    kind: str,
    parent: str,
    child: str,
    origin: Floats,
    *,
    axis: Floats | None = None,
    limits: Mapping[str, float] | None = None,
) -> Element:
    """Return a joint.

    Args:
        name: of the joint.
        kind: type as URDF names it.
        parent: link.
        child: link.
        origin: pose of the child in the parent, shape (4, 4).
        axis: in axes of the child, shape (3,); None for a fixed joint.
        limits: lower and upper [rad or m], effort [N m or N], velocity [rad/s or m/s].
    """
    joint = ElementTree.Element("joint", {"name": name, "type": kind})
    ElementTree.SubElement(joint, "parent", {"link": parent})
    ElementTree.SubElement(joint, "child", {"link": child})
    ElementTree.SubElement(joint, "origin", pose_text(origin))
    if axis is not None:
        words = " ".join(f"{x:.17g}" for x in axis / max(float(np.linalg.norm(axis)), 1e-300))
        ElementTree.SubElement(joint, "axis", {"xyz": words})
        stated = {
            key: f"{value:.9g}"
            for key, value in (limits or {}).items()
            if kind != "continuous" or key in ("effort", "velocity")
        }
        ElementTree.SubElement(joint, "limit", stated)
    return joint


def pose_text(pose: Floats) -> dict[str, str]:
    """Return position and roll, pitch, yaw of a pose as attributes of an ``<origin>``.

    Example:
        >>> pose_text(np.eye(4))
        {'xyz': '0 0 0', 'rpy': '0 0 0'}
    """
    turn = pose[:3, :3]
    pitch = math.asin(float(np.clip(-turn[2, 0], -1.0, 1.0)))
    if abs(turn[2, 0]) < 1.0 - 1e-12:
        roll = math.atan2(float(turn[2, 1]), float(turn[2, 2]))
        yaw = math.atan2(float(turn[1, 0]), float(turn[0, 0]))
    else:
        roll, yaw = 0.0, math.atan2(-float(turn[0, 1]), float(turn[1, 1]))
    rpy = np.round([roll, pitch, yaw], 9) + 0.0
    place = np.round(pose[:3, 3], 9) + 0.0
    return {key: " ".join(f"{x:.9g}" for x in row) for key, row in (("xyz", place), ("rpy", rpy))}
