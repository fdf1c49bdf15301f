"""Reading of a URDF: links with mass properties, and joints, checked for physical validity.

Its mesh files must exist, lie in its folder and be of bounded size.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats
from seals.errors import RobotError, refuse_unlisted, suggestion
from seals.hydrostatics.meshes import refuse_strange_format
from seals.hydrostatics.references import refuse_elsewhere
from seals.robot.structure import check_structure

_LARGEST_MESH = 50_000_000
"""Largest mesh that is loaded [bytes]."""
_READ_BY_ENGINES = ("link", "joint", "material", "deformable")
_FILE_NAMES = {"filename", "file", "uri", "url"}
_ENDINGS = (".stl", ".obj", ".dae")


def mesh_names(path: Path) -> list[str]:
    """Return the mesh files that a valid URDF names, relative to its folder, each once."""
    root = ElementTree.fromstring(path.read_bytes())
    named = (mesh.get("filename", "") for mesh in root.iter("mesh"))
    return list(dict.fromkeys(_relative(name) for name in named))


def _relative(name: str) -> str:
    """Path of a mesh without the scheme that ROS puts in front."""
    return name.removeprefix("file://").removeprefix("package://")


def _refuse_bad_meshes(path: Path, robot: Any) -> None:
    """Refuse meshes that are missing, outside the robot's folder, or too large."""
    folder = path.parent.resolve()
    for link in robot.links:
        for part in (*link.visuals, *link.collisions):
            mesh = None if part.geometry is None else part.geometry.mesh
            if mesh is None:
                continue
            name = str(mesh.filename)
            where = f"URDF {path}: link '{link.name}': mesh '{name}'"
            target = (folder / _relative(name)).resolve()
            # the folder that holds a robot's meshes: robots that come with SEALS share theirs
            shipped = Path(str(resources.files("seals.robots"))).resolve()
            if not target.is_relative_to(shipped if folder.is_relative_to(shipped) else folder):
                raise RobotError(
                    f"{where} lies outside the robot's folder.\nKeep meshes in {folder} or below."
                )
            if not os.path.isfile(target):
                found = [
                    str(p.relative_to(folder))
                    for p in folder.rglob("*")
                    if p.suffix.lower() in _ENDINGS
                ]
                advice = suggestion(name, found, label="Meshes there")
                if (folder.parent / "meta.yaml").is_file():
                    advice = (
                        "A log keeps its robot without meshes that only show it: "
                        "give the folder or name of the robot itself."
                    )
                elif "://" in name:
                    advice += "\nTo copy it from its package: seals new robot NAME urdf=FILE"
                raise RobotError(f"{where} does not exist.\n{advice}")
            _refuse_huge_mesh(where, target)
            refuse_strange_format(target, where)


def _refuse_huge_mesh(where: str, target: Path) -> None:
    """Refuse a mesh that is truncated, or whose real or declared size is too large."""
    size = declared = target.stat().st_size
    if target.suffix.lower() == ".stl" and size >= 84:
        with target.open("rb") as stream:
            head = stream.read(84)
        if not head.startswith(b"solid"):
            declared = 84 + 50 * int.from_bytes(head[80:84], "little")
    if max(size, declared) > _LARGEST_MESH:
        raise RobotError(
            f"{where} has, or declares, {max(size, declared) / 1e6:.0f} MB.\n"
            f"Allowed: up to {_LARGEST_MESH / 1e6:.0f} MB; "
            "simplify it (about 1,000 triangles are enough)."
        )
    if declared > size:
        raise RobotError(
            f"{where} declares {declared} bytes and holds {size}.\n"
            "It is truncated or damaged: copy or export it again."
        )


MOST_BYTES = 5_000_000
MOST_LINKS = 500
_MOVING = {"revolute": False, "continuous": False, "prismatic": True}


@dataclass(kw_only=True)
class UrdfLink:
    """Link: mass properties in link axes, and whether it has collision shapes."""

    name: str
    mass: float = 0.0
    centre: Floats = field(default_factory=lambda: np.zeros(3))
    inertia: Floats = field(default_factory=lambda: np.zeros((3, 3)))
    collides: bool = False


@dataclass(kw_only=True)
class UrdfJoint:
    """Joint: pose of the child in the parent, axis, limits."""

    name: str
    parent: str
    child: str
    moves: bool
    prismatic: bool
    origin: Floats
    rotation: Floats
    axis: Floats
    lower: float
    upper: float


@dataclass(frozen=True, kw_only=True)
class Urdf:
    """Parsed URDF: links in tree order, base first, and the joint above each.

    Args:
        name: of the robot.
        links: base first.
        joints: above each link but the base.
        listed: names of the movable joints in the order of the file.
    """

    name: str
    links: tuple[UrdfLink, ...]
    joints: tuple[UrdfJoint, ...]
    listed: tuple[str, ...] = ()


def read_urdf(path: Path, *, meshes: bool = True) -> Urdf:
    """Read a URDF file.

    Args:
        path: the file; meshes it names must lie in its folder or below.
        meshes: whether they must be there; masses and joints need none.

    Raises:
        RobotError: the file is not a readable URDF, its tree is broken, or no body has its numbers.
    """
    robot = _parse(path, _text_of(path))
    links = {link.name: _link(path, link) for link in robot.links}
    joints = [_joint(path, joint) for joint in robot.joints]
    order = _tree_order(path, list(links), joints)
    above = {joint.child: joint for joint in joints}
    if meshes:
        _refuse_bad_meshes(path, robot)
    return Urdf(
        name=str(robot.name or path.stem),
        links=tuple(links[name] for name in order),
        joints=tuple(above[name] for name in order[1:]),
        listed=tuple(joint.name for joint in joints if joint.moves),
    )


def _text_of(path: Path) -> bytes:
    """Bytes of the file after the checks that need no parser."""
    # unlike a path's own methods, these answer for names that no file can have
    if not os.path.isfile(path):
        what = "a folder" if os.path.isdir(path) else "missing"
        near = os.path.isdir(path.parent)
        beside = [p.name for p in path.parent.glob("*.urdf")] if near else []
        raise RobotError(
            f"URDF {path} is {what}.\n{suggestion(path.name, beside, label='URDF files there')}"
        )
    if path.stat().st_size > MOST_BYTES:
        raise RobotError(
            f"URDF {path} has {path.stat().st_size} bytes.\nAllowed: up to {MOST_BYTES} bytes."
        )
    try:
        # what claims to be empty may still keep a reader waiting, such as /proc/kmsg
        raw = path.read_bytes() if path.stat().st_size else b""
    except OSError as cause:
        raise RobotError(f"URDF {path} cannot be read: {cause}.\nGive an ordinary file.") from cause
    if not raw.strip():
        raise RobotError(
            f"URDF {path} is empty.\nIt must contain one <robot> element with at least one <link>."
        )
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError as cause:
        raise RobotError(
            f"URDF {path} is not UTF-8 text (byte {cause.start}).\nSave it as UTF-8."
        ) from cause
    if "\0" in text:
        # a parser would take it for UTF-16, in which the words below look different
        raise RobotError(f"URDF {path} holds zero bytes: it is not UTF-8 text.\nSave it as UTF-8.")
    if re.search(r"<!\s*(DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise RobotError(
            f"URDF {path} declares a DOCTYPE or an ENTITY.\n"
            "Remove it: such files can expand without limit."
        )
    check_structure(path, text.removeprefix("\ufeff"))
    # refuse a URDF that refers to images or shapes outside its folder
    for part in ElementTree.fromstring(raw):
        for element in part.iter() if part.tag in _READ_BY_ENGINES else ():
            for key in _FILE_NAMES & set(element.attrib) if element.tag != "mesh" else ():
                where = f"URDF {path}: <{element.tag}>"
                refuse_elsewhere(element.attrib[key], path, where)
    return raw


def _parse(path: Path, raw: bytes) -> Any:
    """Robot description of yourdfpy, without meshes."""
    import io

    from lxml.etree import LxmlError
    from yourdfpy import URDF

    try:
        loaded = URDF.load(
            io.BytesIO(raw),
            build_scene_graph=False,
            load_meshes=False,
            build_collision_scene_graph=False,
        )
    except (LxmlError, ValueError, TypeError, KeyError, AttributeError, IndexError) as cause:
        text = " ".join(str(cause).split())[:200]
        raise RobotError(
            f"URDF {path} cannot be read: {text}.\nCheck it against the URDF specification."
        ) from cause
    robot = loaded.robot
    if not robot.links:
        raise RobotError(
            f"URDF {path} has no links.\nIt must contain one <robot> element with at least one "
            "<link>."
        )
    if len(robot.links) > MOST_LINKS:
        raise RobotError(f"URDF {path} has {len(robot.links)} links.\nAllowed: up to {MOST_LINKS}.")
    return robot


def _link(path: Path, link: Any) -> UrdfLink:
    """Mass properties of one link, turned into link axes and checked."""
    out = UrdfLink(name=str(link.name), collides=bool(link.collisions))
    if link.inertial is None:
        return out
    where = f"URDF {path}: link '{out.name}'"
    pose = (
        np.eye(4) if link.inertial.origin is None else np.asarray(link.inertial.origin, dtype=float)
    )
    out.mass = float(link.inertial.mass)
    inertia = np.asarray(link.inertial.inertia, dtype=float)
    if out.mass < 0.0:
        raise RobotError(
            f"{where}: mass {out.mass:g} kg is negative.\nAllowed: zero (a frame) or more."
        )
    out.centre = pose[:3, 3]
    out.inertia = pose[:3, :3] @ inertia @ pose[:3, :3].T
    # refuse inertias that no body has; the structure check has seen to finite numbers
    moments = np.linalg.eigvalsh(out.inertia)
    if moments[0] < -1e-12 * max(1.0, moments[-1]):
        raise RobotError(
            f"{where}: the principal moment {moments[0]:.3g} kg m^2 is negative.\n"
            "Allowed: zero or more."
        )
    if out.mass > 0.0 and moments[-1] > (moments[0] + moments[1]) * (1.0 + 1e-3) + 1e-15:
        raise RobotError(
            f"{where}: the principal moments {moments[0]:.3g}, {moments[1]:.3g}, {moments[2]:.3g} "
            "kg m^2 violate the triangle inequality.\n"
            "No body has such an inertia: the largest is at most the sum of the other two. Correct "
            "ixx, iyy or izz in the file."
        )
    return out


def _joint(path: Path, joint: Any) -> UrdfJoint:
    """One joint, checked."""
    where = f"URDF {path}: joint '{joint.name}'"
    kind = str(joint.type)
    refuse_unlisted(kind, [*_MOVING, "fixed"], f"{where} has the type '{kind}'", error=RobotError)
    pose = np.eye(4) if joint.origin is None else np.asarray(joint.origin, dtype=float)
    axis = np.array([1.0, 0.0, 0.0]) if joint.axis is None else np.asarray(joint.axis, dtype=float)
    length = float(np.linalg.norm(axis))
    if not np.all(np.isfinite(pose)) or (
        kind in _MOVING and not (np.isfinite(length) and length > 1e-9)
    ):
        raise RobotError(
            f"{where}: origin or axis is not finite, or the axis is zero.\nGive a unit axis."
        )
    limit = joint.limit
    free = kind == "continuous" or limit is None or limit.lower is None or limit.upper is None
    lower, upper = (-np.inf, np.inf) if free else (float(limit.lower), float(limit.upper))
    if lower > upper:
        raise RobotError(
            f"{where}: the lower limit {lower:g} is above the upper limit {upper:g}.\nSwap them."
        )
    return UrdfJoint(
        name=str(joint.name),
        parent=str(joint.parent),
        child=str(joint.child),
        moves=kind in _MOVING,
        prismatic=_MOVING.get(kind, False),
        origin=pose[:3, 3],
        rotation=pose[:3, :3],
        axis=axis / length if length else axis,
        lower=lower,
        upper=upper,
    )


def _tree_order(path: Path, names: list[str], joints: list[UrdfJoint]) -> list[str]:
    """Link names with parents first, in the order in which joints are listed below each parent."""
    parent_of: dict[str, str] = {}
    children: dict[str, list[str]] = {name: [] for name in names}
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in children:
                raise RobotError(
                    f"URDF {path}: joint '{joint.name}' names the link '{link}'.\n"
                    f"{suggestion(link, names)}"
                )
        if joint.child in parent_of:
            raise RobotError(
                f"URDF {path}: link '{joint.child}' has two parent joints.\n"
                "A link has only one parent joint."
            )
        parent_of[joint.child] = joint.parent
        children[joint.parent].append(joint.child)
    roots = [name for name in names if name not in parent_of]
    if len(roots) != 1:
        what = (
            "its links form a cycle"
            if not roots
            else f"it has {len(roots)} base links: {', '.join(roots[:5])}"
        )
        raise RobotError(f"URDF {path}: {what}.\nA robot is one tree with exactly one base link.")
    order, stack = [], [roots[0]]
    while stack:
        name = stack.pop()
        order.append(name)
        stack.extend(reversed(children[name]))
    if len(order) != len(names):
        lost = sorted(set(names) - set(order))
        raise RobotError(
            f"URDF {path}: the links {', '.join(lost[:5])} form a cycle.\nA robot is one tree."
        )
    return order
