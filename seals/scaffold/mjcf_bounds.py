"""Reduction of an MJCF file to the parts that describe a robot, with meshes in memory."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from seals.errors import RobotError
from seals.robot.urdf import MOST_LINKS
from seals.scaffold.meshes import load_mesh
from seals.scaffold.resources import MissingMesh, find_resource, read_tree

Element = ElementTree.Element
_SECTIONS = ("compiler", "default", "asset", "worldbody", "actuator", "keyframe")
_REFUSED = ("composite", "flexcomp", "replicate", "attach", "plugin", "flex", "skin")
_DROPPED = (
    "light",
    "camera",
    "material",
    "texture",
    "hfield",
    "lengthrange",
    "pair",
    "tendon",
    "equality",
)
_ATTRIBUTES = (
    "material",
    "texture",
    "hfield",
    "plugin",
    "meshdir",
    "texturedir",
    "assetdir",
    "strippath",
    "actdim",
    "nsample",
    "delay",
    "interp",
)
_ACTUATORS = ("motor", "position", "velocity", "general", "intvelocity", "damper")
_DEEPEST_INCLUDE, _MOST_INCLUDES = 8, 100
_MOST_ELEMENTS = 200_000
_MOST_FACES = 150_000
_MOST_ALL_FACES = 2_000_000
_MOST_NUMBERS = 3 * _MOST_FACES
_MOST_PARTS = dict.fromkeys(("geom", "site", "key", *_ACTUATORS), 2000)
"""Elements of a kind; MuJoCo compares some of them in pairs."""


class Bounded(NamedTuple):
    """A model reduced to its robot.

    Args:
        text: of the model.
        assets: meshes as binary STL, by the file name that the text refers to.
        missing: names of meshes that are not there, of which `stand_ins` take the places, with
            their files as written.
        changes: in words.
    """

    text: str
    assets: dict[str, bytes]
    missing: dict[str, str]
    changes: list[str]

    def stand_ins(self, edge: float) -> dict[str, bytes]:
        """Return all meshes, with cubes in the places of missing ones.

        Args:
            edge: of the cubes [m].
        """
        import trimesh

        cube = bytes(trimesh.creation.box(extents=[edge] * 3).export(file_type="stl"))
        return {file: mesh or cube for file, mesh in self.assets.items()}


def bounded_mjcf(path: Path, root: Element, packages: Mapping[str, Path]) -> Bounded:
    """Return a model reduced to its robot, with its meshes, and messages on changes.

    Args:
        path: of the file.
        root: its ``<mujoco>`` element.
        packages: folders of ``package://`` names.

    Raises:
        RobotError: it includes a file elsewhere, generates bodies, or has too many.
    """
    tree = with_parts(path, root)
    for element in tree.iter():
        if element.tag in _REFUSED:
            raise RobotError(
                f"MJCF {path} holds a <{element.tag}>, which is not a rigid link.\n"
                "Allowed: bodies, joints, geoms and actuators, written out explicitly."
            )
    bodies = sum(1 for _ in tree.iter("body"))
    if bodies > MOST_LINKS:
        raise RobotError(f"MJCF {path} has {bodies} bodies.\nAllowed: up to {MOST_LINKS}.")
    _countable(path, tree)
    left = sorted({str(e.tag) for e in tree if e.tag not in _SECTIONS})
    changes = [f"left out: {', '.join(left)}"] if left else []
    folder = next(
        (c.get(k) for k in ("meshdir", "assetdir") for c in tree.iter("compiler") if c.get(k)), ""
    )
    for element in list(tree):
        if element.tag not in _SECTIONS:
            tree.remove(element)
    assets, missing = _meshes(path, tree, folder or "", packages)
    _strip(tree, changes)
    return Bounded(ElementTree.tostring(tree, encoding="unicode"), assets, missing, changes)


def with_parts(path: Path, root: Element) -> Element:
    """Return a copy of a model with all that it includes.

    Raises:
        RobotError: it includes a file elsewhere, or too many.
    """
    tree = deepcopy(root)
    _include(path, path, tree, [], 0)
    return tree


def _countable(path: Path, tree: Element) -> None:
    """Refuse what takes MuJoCo hours or all memory to compile, and is no part of a robot."""
    for kind, most in _MOST_PARTS.items():
        count = sum(1 for _ in tree.iter(kind))
        if count > most:
            raise RobotError(
                f"MJCF {path} has {count:,} elements <{kind}>.\nAllowed: up to {most:,}."
            )
    for mesh in tree.iter("mesh"):
        if mesh.get("builtin") is not None:
            raise RobotError(f"MJCF {path} lets MuJoCo generate a mesh.\nAllowed: mesh files.")
        count = len(mesh.get("vertex", "").split()) + len(mesh.get("face", "").split())
        if count > _MOST_NUMBERS:
            raise RobotError(
                f"MJCF {path}: a mesh of {count:,} numbers.\nAllowed: up to {_MOST_NUMBERS:,}."
            )


def _include(path: Path, home: Path, tree: Element, read: list[int], depth: int) -> None:
    """Replace every ``<include file=...>`` by the content of the file."""
    for parent in list(tree.iter()):
        for k, child in reversed(list(enumerate(parent))):
            if child.tag != "include":
                continue
            name = child.get("file", "")
            target = (home.parent / name).resolve()
            many = len(read) >= _MOST_INCLUDES or sum(read) > _MOST_ELEMENTS
            if depth >= _DEEPEST_INCLUDE or many:
                raise RobotError(
                    f"MJCF {path}: '{name}' includes itself, or too many others.\n"
                    f"Allowed: {_DEEPEST_INCLUDE} nested files, {_MOST_INCLUDES} "
                    f"together, with {_MOST_ELEMENTS:,} elements."
                )
            if not name or not target.is_relative_to(path.resolve().parent):
                raise RobotError(
                    f"MJCF {path} includes '{name[:80]}', which lies outside its folder.\n"
                    f"Allowed: files in {path.resolve().parent} or below."
                )
            try:
                part = read_tree(target)
            except RobotError as cause:
                raise RobotError(f"MJCF {path} includes a file: {cause}") from cause
            read.append(sum(1 for _ in part.iter()))
            _include(path, target, part, read, depth + 1)
            parent.remove(child)
            for number, inner in enumerate(part):
                parent.insert(k + number, inner)


def _strip(tree: Element, changes: list[str]) -> None:
    """Remove appearance, plug-ins, controls, and actuators of neither a joint nor a site."""
    for parent in list(tree.iter()):
        for child in list(parent):
            if (
                child.tag in _DROPPED
                or (parent.tag == "asset" and child.tag != "mesh")
                or parent.tag == "geom"
                or (child.tag == "geom" and child.get("type") in ("hfield", "sdf"))
            ):
                parent.remove(child)
        for key in _ATTRIBUTES:
            parent.attrib.pop(key, None)
    for frame in tree.iter("key"):
        # controls of actuators that are left out would not fit
        pose = {name: frame.get(name, "") for name in ("name", "qpos") if frame.get(name)}
        frame.attrib.clear()
        frame.attrib.update(pose)
    for section in tree.findall("actuator"):
        for child in list(section):
            if child.tag not in _ACTUATORS or not (child.get("joint") or child.get("site")):
                section.remove(child)
                changes.append(
                    f"actuator {child.get('name') or child.tag} left out: neither joint nor site"
                )


def _meshes(
    path: Path, tree: Element, folder: str, packages: Mapping[str, Path]
) -> tuple[dict[str, bytes], dict[str, str]]:
    """Meshes as binary STL, by the file name that the text now refers to; those not there, empty.

    Beside them the files of those, by the name of the mesh.
    """
    found: dict[str, bytes] = {}
    missing: dict[str, str] = {}
    faces = 0
    for mesh in tree.iter("mesh"):
        given = mesh.get("file")
        if not given:
            continue
        name = given if "://" in given else str(Path(folder) / given)
        mesh.set("name", mesh.get("name") or Path(given).stem)
        own = f"mesh_{len(found)}.stl"
        mesh.set("file", own)
        mesh.attrib.pop("content_type", None)
        try:
            source = find_resource(name, path, packages)
        except MissingMesh:
            found[own], missing[mesh.get("name", "")] = b"", name
            continue
        loaded = load_mesh(source)
        faces += len(loaded.faces)
        if faces > _MOST_ALL_FACES:
            raise RobotError(
                f"MJCF {path}: its meshes have too many triangles.\n"
                f"Allowed: up to {_MOST_ALL_FACES:,} together; simplify them."
            )
        if len(loaded.faces) > _MOST_FACES:
            raise RobotError(
                f"MJCF {path}: mesh '{given}' has {len(loaded.faces):,} triangles.\n"
                f"Allowed: up to {_MOST_FACES:,}; simplify it (about 1,000 are enough)."
            )
        found[own] = bytes(loaded.export(file_type="stl"))
    return found, missing
