"""Construction of the visual scene of a run: links by their URDF, and the ground."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.environment.ground import Solid
from seals.errors import RobotError
from seals.frames import matrix_of
from seals.hydrostatics.meshes import load_triangles
from seals.rendering.scene import NOTHING, TILE, WORLD, Detail, Scene, Shape
from seals.robot.model import RobotModel
from seals.robot.pieces import pieces_of

Colour = tuple[float, float, float]

PLAIN: Colour = (0.70, 0.70, 0.72)
"""Displayed colour of links whose URDF names none."""
GROUND: Colour = (0.62, 0.56, 0.43)
"""Displayed colour of bottom, shore and land: pale sand."""
OBSTACLE: Colour = (0.45, 0.46, 0.48)
"""Displayed colour of obstacles."""
_GROUND = ("tank_bottom", "ground_level", "slope", "land")


def build_scene(
    robots: Mapping[str, RobotModel],
    solids: Sequence[Solid],
    *,
    detail: Detail = Detail.visual,
    tile: float = TILE,
) -> Scene:
    """Return the scene of robots, objects and ground.

    Args:
        robots: by the name of their actor; frames are ``actor/link`` in this order.
        solids: that stand still, see `seals.environment.ground.solids_of`.
        detail: how closely links are drawn.
        tile: edge of the squares on level ground [m], 0 for one colour.

    Raises:
        RobotError: a mesh cannot be read.
    """
    names: list[str] = [NOTHING]
    shapes: list[Shape] = []
    frames: list[str] = []
    for solid in solids:
        turn = matrix_of(np.asarray(solid.quaternion, dtype=float)[None])[0]
        colour = GROUND if solid.name in _GROUND else OBSTACLE
        squares = tile if solid.kind == "plane" else 0.0
        place = np.asarray(solid.position, dtype=float)
        shapes.append(
            Shape(solid.kind, solid.size, place, turn, colour, len(names), WORLD, tile=squares)
        )
        names.append(f"world/{solid.name}")
    for actor, robot in robots.items():
        looks = _looks(robot, detail)
        for link in robot.links:
            part, frame = len(names), len(frames)
            shapes += [s._replace(part=part, frame=frame) for s in looks.get(link, ())]
            names.append(f"{actor}/{link}")
            frames.append(f"{actor}/{link}")
    return Scene(tuple(shapes), tuple(names), tuple(frames))


def _looks(robot: RobotModel, detail: Detail) -> dict[str, list[Shape]]:
    """Shapes of all links by name, in link axes, not yet parts of a scene.

    They are the visual geometry of the URDF, the collision geometry of links that have none.
    """
    from yourdfpy import URDF

    loaded: Any = URDF.load(
        robot.urdf, build_scene_graph=False, load_meshes=False, build_collision_scene_graph=False
    ).robot
    named = {m.name: m for m in loaded.materials or ()}
    drawn = {
        str(link.name): [*_visuals(robot, link.visuals or link.collisions or (), named)]
        for link in loaded.links
    }
    if detail is Detail.visual:
        return drawn
    found = {}
    for k, link in enumerate(robot.links):
        colour = drawn[link][0].colour if drawn.get(link) else PLAIN
        found[link] = [
            Shape(p.kind, p.size, p.position, p.rotation, colour, 0, 0, p.vertices, p.faces)
            for p in pieces_of(robot, k)
        ]
    return found


def _visuals(robot: RobotModel, parts: Any, named: Mapping[str, Any]) -> Iterator[Shape]:
    for part in parts:
        pose = np.eye(4) if part.origin is None else np.asarray(part.origin, dtype=float)
        shape, colour = part.geometry, _colour(getattr(part, "material", None), named)
        place, turn = pose[:3, 3], pose[:3, :3]
        if shape.box is not None:
            yield Shape("box", tuple(float(x) for x in shape.box.size), place, turn, colour, 0)
        elif shape.sphere is not None:
            yield Shape("sphere", (float(shape.sphere.radius),), place, turn, colour, 0)
        elif shape.cylinder is not None:
            size = (float(shape.cylinder.radius), float(shape.cylinder.length))
            yield Shape("cylinder", size, place, turn, colour, 0)
        elif shape.mesh is not None:
            vertices, faces = _mesh(robot, shape.mesh)
            yield Shape("mesh", (), place, turn, colour, 0, 0, vertices, faces)


def _colour(material: Any, named: Mapping[str, Any]) -> Colour:
    if material is not None and material.color is None:
        material = named.get(material.name)
    if material is None or material.color is None:
        return PLAIN
    red, green, blue = (min(max(float(x), 0.0), 1.0) for x in material.color.rgba[:3])
    return red, green, blue


def _mesh(robot: RobotModel, mesh: Any) -> tuple[Floats, Any]:
    """Corners and triangles of a mesh file, with the scale of the URDF."""
    name = str(mesh.filename).removeprefix("file://").removeprefix("package://")
    scale = np.ones(3) if mesh.scale is None else np.ones(3) * np.asarray(mesh.scale, dtype=float)
    path = Path(robot.urdf).parent / name
    vertices, faces = _loaded(str(path), path.stat().st_mtime_ns)
    if np.prod(scale) < 0.0:  # a mirrored mesh turns its faces inside out
        faces = faces[:, ::-1]
    return vertices * scale, faces


@lru_cache(maxsize=256)
def _loaded(path: str, _changed: int) -> tuple[Floats, Any]:
    try:
        loaded = load_triangles(Path(path), where="mesh", process=True)
        vertices, faces = np.asarray(loaded.vertices, dtype=float), np.asarray(loaded.faces)
    except (OSError, ValueError, AttributeError, IndexError) as cause:
        raise RobotError(
            f"the mesh {path} cannot be drawn: {cause}.\nRun: seals check robot=..."
        ) from cause
    return vertices, faces.astype(np.int64)
