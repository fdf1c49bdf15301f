"""Validation of the mesh files of a URDF: existence, location and size."""

from __future__ import annotations

import os
from importlib import resources
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from seals.errors import RobotError, suggestion
from seals.hydrostatics.meshes import refuse_strange_format
from seals.hydrostatics.references import refuse_elsewhere

MOST_BYTES = 50_000_000
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


def refuse_bad_meshes(path: Path, robot: Any) -> None:
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
            if not target.is_relative_to(_root(folder)):
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
                if "://" in name:
                    advice += "\nTo copy it from its package: seals new robot NAME urdf=FILE"
                raise RobotError(f"{where} does not exist.\n{advice}")
            _refuse_huge_mesh(where, target)
            refuse_strange_format(target, where)


def refuse_names_elsewhere(path: Path, raw: bytes) -> None:
    """Refuse a URDF that refers to images or shapes outside its folder.

    Args:
        path: of the URDF.
        raw: its content, sound XML.

    Raises:
        RobotError: a name leads elsewhere, or to a pipe or a device.
    """
    for part in ElementTree.fromstring(raw):
        for element in part.iter() if part.tag in _READ_BY_ENGINES else ():
            for key in _FILE_NAMES & set(element.attrib) if element.tag != "mesh" else ():
                where = f"URDF {path}: <{element.tag}>"
                refuse_elsewhere(element.attrib[key], path, where)


def _root(folder: Path) -> Path:
    """Return the folder that holds a robot's meshes: robots that come with SEALS share theirs."""
    shipped = Path(str(resources.files("seals.robots"))).resolve()
    return shipped if folder.is_relative_to(shipped) else folder


def _refuse_huge_mesh(where: str, target: Path) -> None:
    """Refuse a mesh that is truncated, or whose real or declared size is too large."""
    size = declared = target.stat().st_size
    if target.suffix.lower() == ".stl" and size >= 84:
        with target.open("rb") as stream:
            head = stream.read(84)
        if not head.startswith(b"solid"):
            declared = 84 + 50 * int.from_bytes(head[80:84], "little")
    if max(size, declared) > MOST_BYTES:
        raise RobotError(
            f"{where} has, or declares, {max(size, declared) / 1e6:.0f} MB.\n"
            f"Allowed: up to {MOST_BYTES / 1e6:.0f} MB; simplify it (some 1,000 triangles will do)."
        )
    if declared > size:
        raise RobotError(
            f"{where} declares {declared} bytes and holds {size}.\n"
            "It is cut short or damaged: copy or export it again."
        )
