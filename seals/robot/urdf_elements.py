"""Links and joints of a URDF as plain objects.

`yourdfpy` reads the same, and imports half a second of mesh tools with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats

Element: TypeAlias = "ElementTree.Element[str]"

_PLAIN = {
    "limit": ("effort", "velocity"),
    "mimic": ("multiplier", "offset"),
    "calibration": ("rising", "falling"),
    "safety_controller": ("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"),
}
"""Numbers of a joint that nothing here uses: those of an engine that reads the file."""


@dataclass(frozen=True, kw_only=True)
class Inertial:
    """Mass properties: pose of the centre in the link, mass and matrix about the centre."""

    pose: Floats
    mass: float
    inertia: Floats


@dataclass(frozen=True, kw_only=True)
class Link:
    """Link with the mesh files of all its shapes, and the number of those that collide."""

    name: str
    inertial: Inertial | None
    meshes: tuple[str, ...]
    collisions: int


@dataclass(frozen=True, kw_only=True)
class Joint:
    """Joint with the pose of its child, its axis and its limits where they are stated."""

    name: str
    kind: str
    parent: str
    child: str
    pose: Floats
    axis: Floats
    lower: float | None
    upper: float | None


@dataclass(frozen=True, kw_only=True)
class Elements:
    """All links and joints, in the order of the file."""

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]


def elements_of(raw: bytes) -> Elements:
    """Return the elements of a URDF whose structure was checked.

    Args:
        raw: its content, sound XML.

    Raises:
        ValueError: a number cannot be read; says which.
    """
    root = ElementTree.fromstring(raw)
    for owner in root.iter("color"):
        _numbers(owner, "rgba", "1 1 1 1")
    return Elements(
        name=root.get("name", ""),
        links=tuple(_link(link) for link in root.findall("link")),
        joints=tuple(_joint(joint) for joint in root.findall("joint")),
    )


def _link(link: Element) -> Link:
    parts = [*link.findall("visual"), *link.findall("collision")]
    for part in parts:
        _pose(part)
    meshes = [m.get("filename", "") for p in parts for m in p.findall("geometry/mesh")]
    inertial = link.find("inertial")
    return Link(
        name=link.get("name", ""),
        inertial=None if inertial is None else _inertial(inertial),
        meshes=tuple(meshes),
        collisions=len(link.findall("collision")),
    )


def _inertial(inertial: Element) -> Inertial:
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    xx, xy, xz, yy, yz, zz = (
        _number(inertia, name) or 0.0 for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    return Inertial(
        pose=_pose(inertial),
        mass=_number(mass, "value") or 0.0,
        inertia=np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]),
    )


def _joint(joint: Element) -> Joint:
    for tag, names in _PLAIN.items():
        for name in names:
            _number(joint.find(tag), name)
    axis, limit = joint.find("axis"), joint.find("limit")
    parent, child = (joint.find(tag) for tag in ("parent", "child"))
    return Joint(
        name=joint.get("name", ""),
        kind=joint.get("type", ""),
        parent="" if parent is None else parent.get("link", ""),
        child="" if child is None else child.get("link", ""),
        pose=_pose(joint),
        axis=_numbers(axis, "xyz", "1 0 0"),
        lower=_number(limit, "lower"),
        upper=_number(limit, "upper"),
    )


def _pose(owner: Element) -> Floats:
    """Matrix of an origin: turned by roll, pitch and yaw about fixed axes, then moved, (4, 4)."""
    origin = owner.find("origin")
    out = np.eye(4)
    out[:3, 3] = _numbers(origin, "xyz", "0 0 0")
    roll, pitch, yaw = _numbers(origin, "rpy", "0 0 0")
    (si, sj, sk), (ci, cj, ck) = np.sin([roll, pitch, yaw]), np.cos([roll, pitch, yaw])
    out[:3, :3] = [
        [cj * ck, sj * (si * ck) - ci * sk, sj * (ci * ck) + si * sk],
        [cj * sk, sj * (si * sk) + ci * ck, sj * (ci * sk) - si * ck],
        [-sj, cj * si, cj * ci],
    ]
    return out


def _number(element: Element | None, name: str) -> float | None:
    """Return a number, or None where it is not stated."""
    given = None if element is None else element.get(name)
    if element is None or given is None:
        return None
    try:
        return float(given)
    except ValueError:
        raise ValueError(f"<{element.tag} {name}='{given[:60]}'> is no number") from None


def _numbers(element: Element | None, name: str, default: str) -> Floats:
    """Return as many numbers as the default has."""
    given = default if element is None else element.get(name, default)
    try:
        found = np.array([float(word) for word in given.split()])
    except ValueError:
        found = np.zeros(0)
    wanted = len(default.split())
    if element is not None and len(found) != wanted:
        raise ValueError(f"<{element.tag} {name}='{given[:60]}'> is not {wanted} numbers")
    return found
