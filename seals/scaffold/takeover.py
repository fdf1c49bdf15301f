"""Import of a URDF into a robot folder: copy meshes, leave out foreign elements."""

from __future__ import annotations

import itertools
import re
import shutil
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any, TypeAlias
from xml.etree import ElementTree

import numpy as np

from seals.errors import LogError, RobotError, suggestion
from seals.hydrostatics.formats import refuse_strange_format
from seals.hydrostatics.references import MOST_BYTES, without_references
from seals.robot.macros import expanded, holds_macros
from seals.robot.structure import check_structure
from seals.scaffold.resources import find_resource
from seals.untrusted_io import read_bytes, read_text

Element: TypeAlias = "ElementTree.Element[str]"
FAR = 20.0
"""Extent beyond which a mesh was probably drawn in millimetres [m]."""
_MOST_NEAR = 40
_OWN = ("link", "joint", "material")


class Takeover:
    """URDF that is imported into a robot folder.

    Args:
        path: of the URDF, or the short name of one that comes with SEALS.
        packages: folders of ``package://`` names, where they cannot be found around the file.

    Attributes:
        root: the ``<robot>`` element, changed as it goes.
        changes: what was changed, in words.

    Raises:
        RobotError: the file is missing, or is not a valid URDF.
        MissingExtra: it holds macros, and xacro is not installed.
    """

    def __init__(self, path: Path, packages: Mapping[str, Path]) -> None:
        path = path if path.exists() else shipped_urdfs().get(path.as_posix(), path)
        self.path, self.packages = path, packages
        self.changes: list[str] = []
        text = _text_of(path)
        if holds_macros(text):
            text = expanded(path)
            self.changes.append("xacro macros expanded")
        check_structure(path, text)
        keep = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
        self.root: Element = ElementTree.fromstring(text.encode("utf-8"), parser=keep)
        self._leave_out_foreign()
        self._drop_dummy_base()

    @property
    def name(self) -> str:
        """Name of the robot in the URDF."""
        return str(self.root.get("name") or self.path.stem)

    def velocity_limit(self, joint: str) -> float:
        """Return the speed limit of a joint [rad/s], zero without one."""
        for element in self.root.findall("joint"):
            limit = element.find("limit")
            if element.get("name") == joint and limit is not None:
                return _number(limit.get("velocity"))
        return 0.0

    def effort_limit(self, joint: str) -> float:
        """Return the effort limit of a joint [N m or N], zero without one."""
        for element in self.root.findall("joint"):
            limit = element.find("limit")
            if element.get("name") == joint and limit is not None:
                return _number(limit.get("effort"))
        return 0.0

    def fix_joints(self, names: list[str]) -> None:
        """Convert joints of rotors to fixed joints."""
        for joint in self.root.findall("joint"):
            if joint.get("name") in names and joint.get("type") != "fixed":
                joint.set("type", "fixed")
                for tag in ("axis", "limit", "dynamics", "mimic", "safety_controller"):
                    for part in joint.findall(tag):
                        joint.remove(part)
        if names:
            self.changes.append(
                f"{len(names)} rotor joint(s) fixed: a rotor's speed belongs to its actuator"
            )

    def copy_meshes(self, folder: Path) -> None:
        """Copy every mesh to ``folder/meshes`` and update its path.

        Raises:
            RobotError: a mesh is missing, cannot be read, or is far too large for metres.
        """
        taken: dict[Path, str] = {}
        for mesh in self.root.iter("mesh"):
            given = str(mesh.get("filename"))
            source = find_resource(given, self.path, self.packages)
            if source not in taken:
                taken[source] = self._copy(source, folder, set(taken.values()))
                _refuse_millimetres(mesh, given, folder / taken[source])
            mesh.set("filename", taken[source])
        for material in self.root.iter("material"):
            # pictures on surfaces weigh much and say nothing to physics
            for texture in material.findall("texture"):
                material.remove(texture)
        if taken:
            self.changes.append(f"{len(taken)} mesh file(s) copied to meshes/")

    def write(self, path: Path) -> None:
        """Write the modified URDF."""
        text = ElementTree.tostring(self.root, encoding="unicode")
        path.write_text(f'<?xml version="1.0"?>\n{text}\n', encoding="utf-8")

    def _copy(self, source: Path, folder: Path, names: set[str]) -> str:
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
            self.changes.append(f"{source.name} converted to {Path(name).name}")
        return name

    def _leave_out_foreign(self) -> None:
        """Leave out elements of other programs: they are not part of a robot's body."""
        foreign = [e for e in self.root if isinstance(e.tag, str) and e.tag not in _OWN]
        for element in foreign:
            self.root.remove(element)
        if foreign:
            tags = ", ".join(sorted({e.tag for e in foreign}))
            self.changes.append(f"left out: {tags} (of other programs)")

    def _drop_dummy_base(self) -> None:
        """Take away base links that are nothing but a frame, such as ``base_footprint``."""
        while True:
            joints = self.root.findall("joint")
            children = {_end(j, "child") for j in joints}
            bases = [e for e in self.root.findall("link") if e.get("name") not in children]
            if len(bases) != 1 or bases[0].find("inertial") is not None:
                return
            below = [j for j in joints if _end(j, "parent") == bases[0].get("name")]
            if len(below) != 1 or below[0].get("type") != "fixed":
                return
            if bases[0].find("collision") is not None or bases[0].find("visual") is not None:
                return
            self.root.remove(bases[0])
            self.root.remove(below[0])
            self.changes.append(
                f"base link '{bases[0].get('name')}' left out: a frame without mass; "
                f"the base is now '{_end(below[0], 'child')}'"
            )


def _text_of(path: Path) -> str:
    """Text of a URDF or xacro file."""
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "does not exist"
        near = [*urdfs_near(path if path.is_dir() else path.parent), *shipped_urdfs()]
        raise RobotError(
            f"URDF {path} {what}.\n{suggestion(str(path), near, label='URDF files near')}"
        )
    try:
        text = read_text(path)
    except LogError as cause:
        raise RobotError(f"URDF {path} cannot be read: {cause}") from cause
    if re.search(r"<!\s*(DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise RobotError(
            f"URDF {path} declares a DOCTYPE or an ENTITY.\n"
            "Remove it: such files can expand without end."
        )
    return text


def shipped_urdfs() -> dict[str, Path]:
    """Return the URDF files that come with the package as examples, by short name.

    Example:
        >>> list(shipped_urdfs())
        ['own_animal/beetle', 'own_flight/quad', 'own_robot/hexa']
    """
    home = Path(str(resources.files("seals.experiments")))
    found = sorted(home.glob("*/*/urdf/*.urdf"))
    return {f"{path.relative_to(home).parts[0]}/{path.stem}": path for path in found}


def urdfs_near(folder: Path) -> list[str]:
    """Return URDF and xacro files in a folder and its subfolders, a few levels deep.

    Args:
        folder: to look into; the working directory where it does not exist.
    """
    start = folder if folder.is_dir() else Path()
    levels = ("*", "*/*", "*/*/*")
    found = (p for level in levels for p in start.glob(f"{level}.urdf"))
    more = (p for level in levels for p in start.glob(f"{level}.xacro"))
    return [str(p) for p in itertools.islice(itertools.chain(found, more), _MOST_NEAR)]


def _end(joint: Element, which: str) -> str:
    element = joint.find(which)
    return "" if element is None else str(element.get("link"))


def _number(text: str | None) -> float:
    try:
        value = float(text or 0.0)
    except ValueError:
        return 0.0
    return value if np.isfinite(value) else 0.0


def _is_binary_stl(path: Path) -> bool:
    """Return whether a file is a binary STL: the engine does not read the text form."""
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


def _refuse_millimetres(mesh: Element, name: str, path: Path) -> None:
    scale = max(abs(_number(word)) for word in (mesh.get("scale") or "1").split())
    extent = float(np.ptp(np.asarray(load_mesh(path).vertices), axis=0).max()) * scale
    if extent > FAR:
        raise RobotError(
            f"mesh '{name}' is {extent:.4g} m long: it was probably drawn in millimetres.\n"
            'Write scale="0.001 0.001 0.001" into its <mesh> element.'
        )
