"""Construction of the visual scene of a run: links by their URDF, and the ground."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from seals.environment.ground import Solid
from seals.frames import matrix_of
from seals.rendering.scene import NOTHING, TILE, WORLD, Detail, Scene, Shape
from seals.robot.model import RobotModel
from seals.robot.pieces import Piece, drawn_urdf, piece_of_geometry, pieces_of

Colour = tuple[float, float, float]

PLAIN: Colour = (0.70, 0.70, 0.72)
"""Displayed colour of links whose URDF names none."""
GROUND: Colour = (0.62, 0.56, 0.43)
"""Displayed colour of bottom, shore and land: pale sand."""
OBSTACLE: Colour = (0.45, 0.46, 0.48)
"""Displayed colour of obstacles."""
_NO_MESH: tuple[Any, Any] = (None, None)
_GROUND = ("tank_bottom", "ground_level", "slope", "land", "terrain")


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
        kind, size, mesh = solid.kind, solid.size, _NO_MESH
        if solid.terrain is not None:
            kind, size, mesh = "mesh", (), solid.terrain.mesh()
        shapes.append(
            Shape(kind, size, place, turn, colour, len(names), WORLD, *mesh, tile=squares)
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
    loaded = drawn_urdf(robot)
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
        found[link] = [_shape(piece, colour) for piece in pieces_of(robot, k)]
    return found


def _visuals(robot: RobotModel, parts: Any, named: Mapping[str, Any]) -> Iterator[Shape]:
    for part in parts:
        piece = piece_of_geometry(robot, part)
        if piece is not None:
            material = getattr(part, "material", None)
            if material is not None and material.color is None:
                material = named.get(material.name)
            if material is None or material.color is None:
                colour = PLAIN
            else:
                red, green, blue = (min(max(float(x), 0.0), 1.0) for x in material.color.rgba[:3])
                colour = red, green, blue
            yield _shape(piece, colour)


def _shape(p: Piece, colour: Colour) -> Shape:
    return Shape(p.kind, p.size, p.position, p.rotation, colour, 0, 0, p.vertices, p.faces)
