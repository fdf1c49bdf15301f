"""Meshes of an imported robot file: copied into the robot's folder, converted where needed."""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from seals.check.finding import listed
from seals.errors import RobotError, SealsError
from seals.hydrostatics.meshes import FORMATS, load_triangles
from seals.hydrostatics.references import MOST_BYTES, without_references
from seals.scaffold.resources import MissingMesh, find_resource
from seals.scaffold.urdf import Element, mass_of, pose_of, pose_text, tensor_of
from seals.untrusted_io import read_bytes

FAR = 20.0
"""Extent beyond which a mesh was probably drawn in millimetres [m]."""
_THIN = 0.02
"""Least edge of a box by its largest one, where an inertia is that of a plate or a rod [1]."""
COMPILED = "compiled://"
"""Scheme of meshes that are texts in memory instead of files."""


def copy_meshes(
    root: Element,
    path: Path,
    folder: Path,
    packages: Mapping[str, Path],
    texts: Mapping[str, str],
    *,
    boxes: bool = False,
) -> list[str]:
    """Copy every mesh to ``folder/meshes``, update its path, and return messages for the user.

    Drawings of a link that has a collision shape are left out where they are not there, hold no
    triangles, or are of a format that is not read.

    Args:
        root: of a URDF; changed.
        path: of the file, around which meshes are looked for.
        folder: of the robot.
        packages: folders of packages, by name.
        texts: OBJ texts of the meshes ``compiled://NAME``, by name.
        boxes: whether boxes of their links' inertia take the places of missing collision meshes.

    Raises:
        RobotError: a mesh is missing, cannot be read, or is far too large for metres.
    """
    copies = _Copies(path, folder, packages, texts)
    for link in root.iter("link"):
        copies.of_link(link, boxes=boxes)
    for material in root.iter("material"):
        # pictures on surfaces weigh much and say nothing to physics
        for texture in material.findall("texture"):
            material.remove(texture)
    return copies.summary()


class _Copies:
    """Meshes on their way into a folder: copied, left out, or replaced by boxes."""

    def __init__(
        self, path: Path, folder: Path, packages: Mapping[str, Path], texts: Mapping[str, str]
    ) -> None:
        self.path, self.folder, self.packages, self.texts = path, folder, packages, texts
        self.taken: dict[Path, str] = {}
        self.changes: list[str] = []
        self.lost: list[str] = []
        self.boxed: list[str] = []

    def of_link(self, link: Element, *, boxes: bool) -> None:
        """Copy the meshes of one link."""
        parts = [(kind, p) for kind in ("collision", "visual") for p in link.findall(kind)]
        before = len(self.boxed)
        for kind, part in parts:
            mesh = part.find("geometry/mesh")
            if mesh is None:
                continue
            try:
                self._take(mesh)
            except MissingMesh:
                if kind == "visual" and (link.find("collision") is not None or self.boxed[before:]):
                    self.lost.append(str(mesh.get("filename")))
                elif boxes:
                    self.boxed.append(str(link.get("name")))
                else:
                    raise
                link.remove(part)
        if self.boxed[before:]:
            _box(link)

    def _take(self, mesh: Element) -> None:
        """Copy the file of one mesh unless it was, and update its path."""
        given = str(mesh.get("filename"))
        name = given.removeprefix(COMPILED)
        if name != given and name in self.texts:
            (self.folder / "meshes").mkdir(exist_ok=True)
            (self.folder / "meshes" / f"{name}.obj").write_text(self.texts[name], encoding="utf-8")
            mesh.set("filename", f"meshes/{name}.obj")
            return
        source = find_resource(given, self.path, self.packages)
        if source.suffix.lower() not in FORMATS:
            raise MissingMesh(
                f"mesh: '{source.name}' has an unsupported format.\n"
                f"Allowed: {', '.join(FORMATS)}; export it."
            )
        if source not in self.taken:
            name = _copy(source, self.folder, set(self.taken.values()), self.changes)
            scale = max(abs(float(word)) for word in (mesh.get("scale") or "1").split())
            extent = (
                float(np.ptp(np.asarray(load_mesh(self.folder / name).vertices), axis=0).max())
                * scale
            )
            if extent > FAR:
                raise RobotError(
                    f"mesh '{given}' is {extent:.4g} m long: it was probably exported in "
                    "millimetres.\n"
                    'Write scale="0.001 0.001 0.001" into its <mesh> element.'
                )
            self.taken[source] = name
        mesh.set("filename", self.taken[source])

    def summary(self) -> list[str]:
        """Return what was done, in words."""
        words = list(self.changes)
        if self.lost:
            words.append(
                f"{len(self.lost)} visual shape(s) left out because missing, empty or unreadable: "
                f"{_some(self.lost)}"
            )
        if self.boxed:
            words.append(
                "missing meshes replaced by boxes with the inertia of the link: "
                f"{_some(self.boxed)}"
            )
        if self.taken:
            words.append(f"{len(self.taken)} mesh file(s) copied to meshes/")
        return words


def _some(names: list[str]) -> str:
    return listed(list(dict.fromkeys(Path(name).name for name in names)), 4)


def _box(link: Element) -> None:
    """Give a link the box that has its mass and principal moments, as its collision shape."""
    inertial = link.find("inertial")
    if inertial is None:
        return
    inertia, mass = inertial.find("inertia"), mass_of(link)
    if inertia is None or mass <= 0.0:
        return
    moments, axes = np.linalg.eigh(tensor_of(inertia))
    squares = 6.0 / mass * (moments.sum() - 2.0 * moments)
    if squares.max() <= 0.0:
        return
    edges = np.sqrt(np.maximum(squares, _THIN**2 * squares.max()))
    pose = pose_of(inertial.find("origin"))
    pose[:3, :3] = pose[:3, :3] @ axes * np.array([1.0, 1.0, np.linalg.det(axes)])
    part = ElementTree.SubElement(link, "collision")
    ElementTree.SubElement(part, "origin", pose_text(pose))
    size = " ".join(f"{x:.6g}" for x in edges)
    ElementTree.SubElement(ElementTree.SubElement(part, "geometry"), "box", {"size": size})


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
        mesh = load_mesh(source)
        text = mesh.export(file_type="obj", include_texture=False, include_normals=False)
        (folder / name).write_text(str(text), encoding="utf-8")
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
    try:
        mesh = load_triangles(path, where="mesh", process=True)
        faces = len(mesh.faces)
    except SealsError:
        raise
    except Exception as cause:  # each format's loader fails in its own way
        text = " ".join(str(cause).split())[:120]
        raise RobotError(
            f"mesh {path} cannot be read: {text}.\nExport it as STL or OBJ, in metres."
        ) from cause
    if not faces:
        raise MissingMesh(f"mesh {path} has no triangles.\nExport it as STL or OBJ, in metres.")
    unit = re.match(r"([\d.e+-]+) \* meters", str(mesh.units or ""))
    if unit:
        # COLLADA files say their unit
        mesh.apply_scale(float(unit[1]))
    return mesh
