"""Checks of meshes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from seals.check.finding import RobotFinding, passed, warned
from seals.errors import SealsError
from seals.hydrostatics.meshes import load_triangles
from seals.robot.meshes import mesh_names
from seals.robot.settings import RobotSettings

MANY_TRIANGLES = 20_000
"""Triangles of a mesh above which loading and contacts become slow."""
FAR = 20.0
"""Extent of a mesh beyond which millimetres were probably taken for metres [m]."""
TINY = 1e-4
"""Extent of a mesh below which it was probably scaled twice [m]."""


def look_at_meshes(settings: RobotSettings) -> Iterator[RobotFinding]:
    """Yield findings about large, oddly sized or open meshes."""
    fine = 0
    for name, scale in _scaled(settings.urdf_path):
        remarks = list(_look(settings.urdf_path.parent / name, name, scale))
        fine += not remarks
        yield from remarks
    for link, notes in _hulls(settings):
        fine += not notes
        for note in notes:
            yield warned(f"hull of {link}", note, "Export the mesh closed and wound outwards.")
    if fine:
        yield passed("meshes", f"{fine} without remark")


def _scaled(path: Path) -> list[tuple[str, float]]:
    """Meshes of the URDF, each once, with the largest factor it is scaled by."""
    names = mesh_names(path)
    elements = list(ElementTree.fromstring(path.read_bytes()).iter("mesh"))
    scales = dict.fromkeys(names, 1.0)
    for mesh in elements:
        numbers = [abs(float(word)) for word in mesh.get("scale", "1").split()]
        name = next((n for n in names if str(mesh.get("filename")).endswith(n)), "")
        scales[name] = max(numbers)
    return [(name, scales[name]) for name in names]


def _look(path: Path, name: str, scale: float) -> Iterator[RobotFinding]:
    """Yield findings about one mesh file."""
    triangles, extent = _size(path)
    if triangles > MANY_TRIANGLES:
        advice = f"Above {MANY_TRIANGLES:,} loading and contacts are slow; simplify it."
        yield warned("mesh", f"{name} has about {triangles:,} triangles", advice)
    size = extent * scale
    if size > FAR:
        advice = 'Drawn in millimetres? Say scale="0.001 0.001 0.001" in the URDF\'s <mesh>.'
        yield warned("mesh", f"{name} is {size:.4g} m long", advice)
    elif 0.0 < size < TINY:
        advice = "Scaled twice? URDF lengths are metres."
        yield warned("mesh", f"{name} is {size:.2g} m long", advice)


def _size(path: Path) -> tuple[int, float]:
    """Number of triangles and largest extent in the mesh's own unit, estimated for large files."""
    size = path.stat().st_size
    if size > 100 * MANY_TRIANGLES:
        return ((size - 84) // 50 if path.suffix.lower() == ".stl" else size // 100), 0.0
    try:
        mesh = load_triangles(path, where="mesh")
        return len(mesh.faces), float(np.ptp(np.asarray(mesh.vertices), axis=0).max())
    except (ValueError, IndexError, KeyError, AttributeError, TypeError, SealsError):
        # what cannot be drawn is refused elsewhere, with the words of the loader
        return size // 100, 0.0


def _hulls(settings: RobotSettings) -> Iterator[tuple[str, list[str]]]:
    """Yield link and remarks of the meshes that displace water."""
    from seals.hydrostatics import hull_from_mesh

    folder = Path(settings.folder)
    for link, hull in settings.hulls.items():
        for shape in hull.shapes:
            if shape.type.value == "mesh" and shape.file:
                found = hull_from_mesh(folder / shape.file, position=shape.position, rpy=shape.rpy)
                yield link, [note.text for note in found.notes]
