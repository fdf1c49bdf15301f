"""Validation of mesh files and arrays, and their conversion to hulls."""

from __future__ import annotations

import enum
import io
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.errors import RobotError, SealsError
from seals.hydrostatics.mesh import HullMesh, placed_points
from seals.hydrostatics.references import MOST_BYTES, refuse_references, without_references
from seals.hydrostatics.samples import LEAST_SAMPLES, MOST_DRAWS, HullSamples, winding_test
from seals.hydrostatics.wetted import Vector
from seals.untrusted_io import read_bytes

MOST_FACES = 200_000
MOST_BROKEN_FACES = 20_000
MOST_WORK = 150_000_000
"""Pairs of a point and a triangle that are looked at to sample a broken mesh, some 4 seconds."""
BYTES_PER_FACE = 400
"""More than any mesh format spends on one face; bounds what is read at all."""
SIZES = (1e-3, 100.0)
"""Largest extents [m] that are believed; outside them the unit is probably not the metre."""
WELD = 1e-7
"""Share of the extent below which two corners are the same point; STL repeats every corner."""

Numbers = NDArray[np.int64]
FORMATS = (".stl", ".obj", ".ply", ".off", ".dae", ".glb")
"""Endings of the mesh files that are read; the mesh library knows archives as well."""
_ENTITY = re.compile(rb"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)
_OTHER_SIGNS = re.compile(
    rb"<\?xml[^>]*encoding\s*=\s*['\"](?!utf-8['\"]|us-ascii['\"])", re.IGNORECASE
)
"""Declaration of another encoding than UTF-8, in which the words above look different."""


class NoteKind(enum.Enum):
    """Findings about a mesh."""

    FLIPPED = "flipped"
    BROKEN = "broken"


class MeshNote(NamedTuple):
    """Remark on an accepted mesh: the defect and the repair."""

    kind: NoteKind
    text: str


class LoadedHull(NamedTuple):
    """Hull made from a mesh, with remarks; a broken mesh is replaced by samples."""

    hull: HullMesh | HullSamples
    notes: tuple[MeshNote, ...]


def hull_from_mesh(
    source: str | Path | Any,
    *,
    scale: float = 1.0,
    position: Sequence[float] = (0.0, 0.0, 0.0),
    rpy: Sequence[float] = (0.0, 0.0, 0.0),
    any_size: bool = False,
    seed: int = 0,
) -> LoadedHull:
    """Make a hull from a mesh file, a mesh object or arrays, checked.

    Args:
        source: path of a mesh file; or an object with ``vertices`` and ``faces``; or that pair.
        scale: metres per unit of the mesh.
        position: origin of the mesh in link axes [m].
        rpy: roll, pitch, yaw of the mesh in the link [rad].
        any_size: accept sizes that look like a wrong unit.
        seed: of the samples of a broken mesh.

    Raises:
        RobotError: the file is missing, unreadable or too large, or the mesh cannot be a hull.
    """
    name, vertices, faces = _read(source)
    vertices = _checked(name, vertices, faces, scale, any_size)
    corners = placed_points(vertices, position, rpy)[faces]
    # corners at the same position are one point
    grid = WELD * max(float(np.ptp(vertices, axis=0).max()), 1e-300)
    rounded = np.round((vertices - vertices.min(axis=0)) / grid).astype(np.int64)
    _, number = np.unique(rounded, axis=0, return_inverse=True)
    welded = np.asarray(number.reshape(-1)[faces], dtype=np.int64)
    notes: list[MeshNote] = []
    fault = _fault(welded)
    volume = float(
        np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    )
    if fault is not None:
        text = f"{name}: {fault}; its volume is sampled instead of cut exactly."
        return LoadedHull(_sampled(name, corners, seed), (MeshNote(NoteKind.BROKEN, text),))
    if volume < 0.0:
        corners = corners[:, ::-1]
        text = f"{name}: faces oriented inwards (volume {volume:.4g} m^3); they were reversed."
        notes.append(MeshNote(NoteKind.FLIPPED, text))
    if abs(volume) < 1e-9 * float(np.ptp(vertices, axis=0).max()) ** 3:
        raise RobotError(f"{name}: the mesh is flat and encloses no volume.\nUse a closed mesh.")
    hull = HullMesh(
        vertices=corners.reshape(-1, 3),
        faces=np.arange(3 * len(corners), dtype=np.int64).reshape(-1, 3),
    )
    return LoadedHull(hull, tuple(notes))


def _read(source: Any) -> tuple[str, Vector, Numbers]:
    """Return a name, vertices and faces of any accepted source."""
    if isinstance(source, str | Path):
        return _read_file(Path(source))
    pair = source if isinstance(source, tuple) else (source.vertices, source.faces)
    return "mesh", np.asarray(pair[0], dtype=np.float64), np.asarray(pair[1], dtype=np.int64)


def _read_file(path: Path) -> tuple[str, Vector, Numbers]:
    """Read a mesh file after a check of its size."""
    if not os.path.isfile(path):
        beside = sorted(p.name for p in path.parent.glob("*")) if path.parent.is_dir() else []
        raise RobotError(f"mesh file {path} does not exist.\nIn that folder: {beside[:12]}")
    size = path.stat().st_size
    declared = size // BYTES_PER_FACE
    if path.suffix.lower() == ".stl" and size >= 84:
        with path.open("rb") as file:
            head = file.read(84)
        count = int.from_bytes(head[80:84], "little")
        if not head.lstrip().startswith(b"solid") or size == 84 + 50 * count:
            declared = count
            if size < 84 + 50 * count:
                raise RobotError(
                    f"mesh file {path} declares {count} triangles ({50 * count} bytes) "
                    f"but holds {size} bytes.\nThe file is truncated or damaged: export it again."
                )
    if declared > MOST_FACES:
        raise RobotError(
            f"mesh file {path} holds about {declared} triangles; allowed: {MOST_FACES}.\n"
            "Simplify the mesh (a hull needs a few hundred triangles)."
        )
    try:
        mesh = load_triangles(path, where="mesh")
        faces = np.asarray(mesh.faces, dtype=np.int64)
        vertices = np.asarray(mesh.vertices, dtype=np.float64)
    except SealsError:
        raise
    except Exception as error:
        raise RobotError(
            f"mesh file {path} cannot be read: {error}\nAllowed: STL, OBJ, PLY, OFF, DAE, GLB."
        ) from error
    return str(path), vertices, faces


def _checked(name: str, vertices: Vector, faces: Numbers, scale: float, any_size: bool) -> Vector:
    """Return the scaled vertices, or raise an error about the mesh."""
    if faces.ndim != 2 or faces.shape[-1] != 3 or not len(faces):
        raise RobotError(f"{name} has no triangles.\nGive a closed triangle mesh.")
    if len(faces) > MOST_FACES:
        raise RobotError(
            f"{name} has {len(faces)} triangles; allowed: {MOST_FACES}.\nSimplify the mesh."
        )
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise RobotError(f"{name} has vertices of shape {vertices.shape}.\nAllowed: (V, 3).")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise RobotError(
            f"{name} has faces that name vertices {faces.min()} to {faces.max()}.\n"
            f"Allowed: 0 to {len(vertices) - 1}."
        )
    if not np.isfinite(vertices).all() or not np.isfinite(scale) or scale <= 0.0:
        raise RobotError(f"{name} has NaN or infinite vertices or scale {scale}.\nExport it again.")
    scaled = vertices * scale
    extent = float(np.ptp(scaled, axis=0).max())
    low, high = SIZES
    if not any_size and not low <= extent <= high:
        factor = 0.001 if extent > high else 1000.0
        raise RobotError(
            f"{name} is {extent:.4g} m long; {low:g} to {high:g} m is expected.\n"
            f"Another unit? Give scale={scale * factor:g}, or any_size=True if it is right."
        )
    return scaled


def _fault(faces: Numbers) -> str | None:
    """Return why faces do not form a closed surface of one orientation, or None.

    A slit whose two faces collapse after welding is harmless: every edge still has its opposite.
    """
    edges = np.concatenate((faces[:, :2], faces[:, 1:], faces[:, ::2][:, ::-1]))
    edges = edges[edges[:, 0] != edges[:, 1]]
    most = int(faces.max()) + 1
    forward = np.sort(edges[:, 0] * most + edges[:, 1])
    backward = np.sort(edges[:, 1] * most + edges[:, 0])
    # closed and wound alike: each edge a -> b has its b -> a in the next face
    if np.array_equal(forward, backward):
        return None
    low, high = edges.min(axis=1), edges.max(axis=1)
    _, counts = np.unique(low * most + high, return_counts=True)
    open_edges = int((counts % 2 == 1).sum())
    if open_edges:
        return f"the mesh is not watertight ({open_edges} open edges)"
    return "the faces are not consistently oriented"


def _sampled(name: str, corners: Vector, seed: int) -> HullSamples:
    """Fill a broken mesh with samples."""
    if len(corners) > MOST_BROKEN_FACES:
        raise RobotError(
            f"{name} is broken and has {len(corners)} triangles; {MOST_BROKEN_FACES} can be "
            "sampled.\nRepair or simplify the mesh."
        )
    import trimesh

    points = corners.reshape(-1, 3)
    mesh = trimesh.Trimesh(
        vertices=points, faces=np.arange(len(points)).reshape(-1, 3), process=False
    )
    mesh.merge_vertices()
    repair: Any = trimesh.repair
    repair.fix_winding(mesh)
    even = np.asarray(mesh.vertices, dtype=np.float64)[np.asarray(mesh.faces)]
    low, high = points.min(axis=0), points.max(axis=0)
    return HullSamples.inside(
        winding_test(even),
        low=low.tolist(),
        high=high.tolist(),
        seed=seed,
        # a thin shape of many triangles would take minutes
        most=min(MOST_DRAWS, max(2 * LEAST_SAMPLES, MOST_WORK // len(even))),
    )


def load_triangles(path: Path, *, where: str, process: bool = False, most: int = MOST_BYTES) -> Any:
    """Return a mesh file as one trimesh object: the only reader of meshes.

    Materials and pictures are left out: the libraries behind choose a picture's decoder by its
    content, and one of them starts a program.

    Args:
        path: the file.
        where: what names it, for the message.
        process: whether equal corners are made one.
        most: largest size [byte].

    Raises:
        RobotError: it is no plain mesh, or names files elsewhere.
        LogError: it is absent, no ordinary file, or too large.
        ValueError: it cannot be read; whatever the loader of its format raised.
    """
    raw = read_bytes(path, most=most)
    refuse_strange_format(path, where)
    import trimesh

    kind = path.suffix.lower().removeprefix(".")
    if kind == "obj":
        # each change of material would make a mesh of its own
        raw = without_references(raw)
    try:
        mesh = trimesh.load(
            io.BytesIO(raw),
            file_type=kind,
            # buffers of its own may lie beside a glTF; refuse_references has seen their names
            resolver=trimesh.resolvers.FilePathResolver(str(path)) if kind == "glb" else None,
            force="mesh",
            process=process,
            skip_materials=True,
        )
    except MemoryError:
        raise
    except Exception as cause:  # each format's loader fails in its own way
        raise ValueError(f"{type(cause).__name__}, {cause}") from cause
    if not isinstance(mesh, trimesh.Trimesh):
        raise ValueError("it holds no triangles")
    return mesh


def refuse_strange_format(path: Path, where: str) -> None:
    """Refuse a file that is not a plain mesh.

    Args:
        path: a file that is there, of bearable size.
        where: what names it, for the message.

    Raises:
        RobotError: its ending is another one, it is XML that declares entities, or it names
            files elsewhere.
    """
    if path.suffix.lower() not in FORMATS:
        raise RobotError(
            f"{where}: '{path.name}' is not a mesh file.\nAllowed: {', '.join(FORMATS)}; export it."
        )
    if path.suffix.lower() == ".dae":
        raw = path.read_bytes()
        if _ENTITY.search(raw) or _OTHER_SIGNS.search(raw) or b"\0" in raw:
            raise RobotError(
                f"{where}: '{path.name}' declares a DOCTYPE or an ENTITY, or is not UTF-8.\n"
                "Remove it: such files can expand without limit."
            )
    refuse_references(path, where)
