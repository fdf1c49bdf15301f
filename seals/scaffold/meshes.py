"""Meshes of an imported robot file: copied into the robot's folder, converted where needed."""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from seals.errors import RobotError
from seals.hydrostatics.formats import refuse_strange_format
from seals.hydrostatics.references import MOST_BYTES, without_references
from seals.scaffold.resources import find_resource
from seals.untrusted_io import read_bytes

FAR = 20.0
"""Extent beyond which a mesh was probably drawn in millimetres [m]."""
COMPILED = "compiled://"
"""Scheme of meshes that are texts in memory instead of files."""


def copy_meshes(
    root: ElementTree.Element,
    path: Path,
    folder: Path,
    packages: Mapping[str, Path],
    texts: Mapping[str, str],
) -> list[str]:
    """Copy every mesh to ``folder/meshes``, update its path, and return messages for the user.

    Args:
        root: of a URDF; changed.
        path: of the file, around which meshes are looked for.
        folder: of the robot.
        packages: folders of packages, by name.
        texts: OBJ texts of the meshes ``compiled://NAME``, by name.

    Raises:
        RobotError: a mesh is missing, cannot be read, or is far too large for metres.
    """
    taken: dict[Path, str] = {}
    changes: list[str] = []
    for mesh in root.iter("mesh"):
        given = str(mesh.get("filename"))
        if given.startswith(COMPILED):
            mesh.set("filename", _written(given.removeprefix(COMPILED), folder, texts))
            continue
        source = find_resource(given, path, packages)
        if source not in taken:
            taken[source] = _copy(source, folder, set(taken.values()), changes)
            _refuse_millimetres(mesh, given, folder / taken[source])
        mesh.set("filename", taken[source])
    for material in root.iter("material"):
        # pictures on surfaces weigh much and say nothing to physics
        for texture in material.findall("texture"):
            material.remove(texture)
    if taken:
        changes.append(f"{len(taken)} mesh file(s) copied to meshes/")
    return changes


def _written(name: str, folder: Path, texts: Mapping[str, str]) -> str:
    (folder / "meshes").mkdir(exist_ok=True)
    (folder / "meshes" / f"{name}.obj").write_text(texts[name], encoding="utf-8")
    return f"meshes/{name}.obj"


def _copy(source: Path, folder: Path, names: set[str], changes: list[str]) -> str:
    """Copy one mesh as it is where the engine reads its format, else converted to OBJ."""
    ready = source.suffix.lower() == ".obj" or _is_binary_stl(source)
    ending = source.suffix.lower() if ready else ".obj"
    name, count = f"meshes/{source.stem}{ending}", 1
    while name in names:
        count += 1
        name = f"meshes/{source.stem}_{count}{ending}"
    (folder / "meshes").mkdir(exist_ok=True)
    if ready and ending == ".obj":
        # names of materials would point somewhere else from the new place
        raw = read_bytes(source, most=MOST_BYTES)
        (folder / name).write_bytes(without_references(raw))
    elif ready:
        shutil.copyfile(source, folder / name)
    else:
        _convert(source, folder / name)
        changes.append(f"{source.name} converted to {Path(name).name}")
    return name


def _is_binary_stl(path: Path) -> bool:
    """Return whether a file is a binary STL, the only form of STL that the engine reads."""
    if path.suffix.lower() != ".stl":
        return False
    with path.open("rb") as stream:
        head = stream.read(84)
    return len(head) == 84 and path.stat().st_size == 84 + 50 * int.from_bytes(head[80:], "little")


def load_mesh(path: Path) -> Any:
    """Return a mesh as one trimesh object in metres.

    Raises:
        RobotError: it cannot be read, or holds no triangles.
    """
    refuse_strange_format(path, "mesh")
    import trimesh

    try:
        mesh: Any = trimesh.load(path, force="mesh")
        faces = len(mesh.faces)
    except Exception as cause:  # each format's loader fails in its own way
        text = " ".join(str(cause).split())[:120]
        raise RobotError(
            f"mesh {path} cannot be read: {text}.\nExport it as STL or OBJ, in metres."
        ) from cause
    if not faces:
        raise RobotError(f"mesh {path} has no triangles.\nExport it as STL or OBJ, in metres.")
    unit = re.match(r"([\d.e+-]+) \* meters", str(mesh.units or ""))
    if unit:
        # COLLADA files say their unit
        mesh.apply_scale(float(unit[1]))
    return mesh


def _convert(source: Path, target: Path) -> None:
    mesh = load_mesh(source)
    text = mesh.export(file_type="obj", include_texture=False, include_normals=False)
    target.write_text(str(text), encoding="utf-8")


def _refuse_millimetres(mesh: ElementTree.Element, name: str, path: Path) -> None:
    scale = max(abs(float(word)) for word in (mesh.get("scale") or "1").split())
    extent = float(np.ptp(np.asarray(load_mesh(path).vertices), axis=0).max()) * scale
    if extent > FAR:
        raise RobotError(
            f"mesh '{name}' is {extent:.4g} m long: it was probably drawn in millimetres.\n"
            'Write scale="0.001 0.001 0.001" into its <mesh> element.'
        )
