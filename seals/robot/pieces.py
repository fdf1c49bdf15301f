"""Solid pieces of a link, for fluids and other volume methods."""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import RobotError
from seals.hydrostatics import (
    Hull,
    HullBox,
    HullCapsule,
    HullCompound,
    HullCylinder,
    HullMesh,
    HullSphere,
)
from seals.hydrostatics.meshes import load_triangles
from seals.robot.model import RobotModel


class Piece(NamedTuple):
    """Solid or sheet in the axes of its body.

    Args:
        kind: ``box``, ``sphere``, ``cylinder``, ``capsule`` or ``mesh``.
        size: box edges; cylinder and capsule radius, length of the straight part; sphere radius;
            empty for a mesh [m].
        position: of its centre or, of a mesh, its origin [m], shape (3,).
        rotation: of its axes in the body's, shape (3, 3).
        vertices: of a mesh [m], shape (V, 3).
        faces: of a mesh, shape (F, 3).
        volume: stated volume that rules over that of the shape [m^3]; None for the shape's own.
    """

    kind: str
    size: tuple[float, ...]
    position: Floats
    rotation: Floats
    vertices: Floats | None = None
    faces: Any = None
    volume: float | None = None

    def placed(self, position: Floats, rotation: Floats) -> Piece:
        """Return the piece in the axes of another body, given the pose of the present one."""
        return self._replace(
            position=position + rotation @ self.position, rotation=rotation @ self.rotation
        )


def pieces_of(robot: RobotModel, link: int) -> tuple[Piece, ...]:
    """Return the pieces of one link, in link axes.

    The hull rules, since it is what the robot displaces; a link without one is made of its
    collision geometry.

    Raises:
        RobotError: a collision mesh cannot be read.
    """
    hull = robot.hulls[link]
    if hull is not None:
        return _of_hull(hull, 1.0)
    return collision_pieces(robot, (robot.links[link],))[link]


def collision_pieces(
    robot: RobotModel, links: Collection[str] | None = None
) -> tuple[tuple[Piece, ...], ...]:
    """Return the pieces of the collision geometry, link by link, in link axes.

    Args:
        robot: the model.
        links: links whose geometry is read, the others come out empty; None for all.

    Raises:
        RobotError: a collision mesh cannot be read.
    """
    wanted = set(robot.links if links is None else links)
    touching = [
        has and name in wanted for name, has in zip(robot.links, robot.has_collision, strict=True)
    ]
    if not any(touching):
        return ((),) * len(robot.links)
    found = {link.name: link.collisions for link in drawn_urdf(robot).links}
    pieces = [
        [piece_of_geometry(robot, one) for one in found[name]] if touches else []
        for name, touches in zip(robot.links, touching, strict=True)
    ]
    return tuple(tuple(p for p in row if p is not None) for row in pieces)


def drawn_urdf(robot: RobotModel) -> Any:
    """Return the URDF of a robot with its visuals and collisions, meshes not read."""
    from yourdfpy import URDF

    return URDF.load(
        robot.urdf, build_scene_graph=False, load_meshes=False, build_collision_scene_graph=False
    ).robot


def _of_hull(hull: Hull, share: float) -> tuple[Piece, ...]:
    """Pieces of a hull; ``share`` scales their volumes to a stated total."""
    if isinstance(hull, HullCompound):
        return tuple(p for part in hull.parts for p in _of_hull(part, share * hull.scale))
    volume = None if abs(share - 1.0) < 1e-9 else share * hull.volume
    still = np.zeros(3), np.eye(3)
    if isinstance(hull, HullMesh):
        corners = np.asarray(hull.faces.corners).reshape(-1, 3)
        points, back = np.unique(corners.round(9), axis=0, return_inverse=True)
        return (Piece("mesh", (), *still, points, back.reshape(-1, 3), volume),)
    sizes: dict[type, tuple[str, tuple[str, ...]]] = {
        HullSphere: ("sphere", ("radius",)),
        HullCylinder: ("cylinder", ("radius", "length")),
        HullCapsule: ("capsule", ("radius", "length")),
    }
    known: Any = hull
    if isinstance(hull, HullBox):
        kind, size = "box", tuple(hull.size)
    elif type(hull) in sizes:
        kind, fields = sizes[type(hull)]
        size = tuple(float(getattr(hull, name)) for name in fields)
    else:
        raise RobotError(
            f"a hull of the kind {type(hull).__name__} has no surface for a fluid.\n"
            "Allowed: sphere, box, cylinder, capsule, mesh, and combinations of them."
        )
    turn = np.array(known.axes).T
    return (Piece(kind, size, np.array(known.position), turn, volume=volume),)


def piece_of_geometry(robot: RobotModel, part: Any) -> Piece | None:
    """Return a visual or collision of the URDF in the axes of its link; None for no known shape.

    Raises:
        RobotError: its mesh cannot be read.
    """
    pose = np.eye(4) if part.origin is None else np.asarray(part.origin, dtype=float)
    place, turn, shape = pose[:3, 3], pose[:3, :3], part.geometry
    if shape.box is not None:
        return Piece("box", tuple(float(x) for x in shape.box.size), place, turn)
    if shape.sphere is not None:
        return Piece("sphere", (float(shape.sphere.radius),), place, turn)
    if shape.cylinder is not None:
        size = (float(shape.cylinder.radius), float(shape.cylinder.length))
        return Piece("cylinder", size, place, turn)
    if shape.mesh is None:
        return None
    # a mesh from its file, with the scale of the URDF
    name = str(shape.mesh.filename).removeprefix("file://").removeprefix("package://")
    path, given = Path(robot.urdf).parent / name, shape.mesh.scale
    scale = np.ones(3) if given is None else np.ones(3) * np.asarray(given, dtype=float)
    try:
        points, faces = _loaded(str(path), path.stat().st_mtime_ns)
    except (OSError, ValueError, AttributeError, IndexError) as cause:
        raise RobotError(
            f"the mesh {path} of '{robot.name}' cannot be read: {cause}.\n"
            "Run: seals check robot=..."
        ) from cause
    # a mirrored mesh turns its faces inside out
    faces = faces[:, ::-1] if np.prod(scale) < 0.0 else faces
    return Piece("mesh", (), place, turn, points * scale, faces)


@lru_cache(maxsize=256)
def _loaded(path: str, _changed: int) -> tuple[Floats, Any]:
    loaded = load_triangles(Path(path), where="mesh", process=True)
    return np.asarray(loaded.vertices, dtype=float), np.asarray(loaded.faces, dtype=np.int64)
