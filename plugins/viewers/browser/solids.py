"""Robots, objects and ground in the page: shapes on moving frames."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.frames import quaternion_of
from seals.rendering.meshes import triangles
from seals.rendering.scene import WORLD, Poses, Shape
from seals.view import Stage

STONE = 0.86
"""Lightness of the second colour of a tiled plane over that of the first [1]."""
GLASS = 0.1
"""Opacity of the walls of a tank [1]."""
TILES = 24
"""Tiles along an edge of a plane."""


class Solids:
    """Shapes of a scene in the page.

    Args:
        server: viser's.
        stage: of the run.
        middle: of the ground that is shown, x and y [m].
        half: of its edge [m].
    """

    def __init__(self, server: Any, stage: Stage, middle: Floats, half: float) -> None:
        self._handles: list[Any] = []
        self._frames = []
        scene = server.scene
        for name in stage.scene.frames:
            frame = scene.add_frame(f"/scene/{name}", show_axes=False)
            self._frames.append(frame)
            self._handles.append(frame)
        for k, shape in enumerate(stage.scene.shapes):
            if shape.kind == "plane":
                self._handles += _plane(scene, f"/scene/ground_{k}", shape, middle, half)
                continue
            carried = shape.frame != WORLD
            home = f"/scene/{stage.scene.frames[shape.frame]}" if carried else "/scene"
            glass = shape.part in stage.walls
            vertices, faces = triangles(shape)
            xyzw = quaternion_of(np.asarray(shape.rotation))
            self._handles.append(
                scene.add_mesh_simple(
                    f"{home}/shape_{k}",
                    vertices=vertices,
                    faces=faces,
                    color=shape.colour,
                    # edges of boxes and meshes stay sharp, round primitives round
                    flat_shading=shape.kind in ("box", "mesh", "cylinder"),
                    side="double" if shape.kind == "mesh" else "front",
                    opacity=GLASS if glass else None,
                    cast_shadow=not glass,
                    position=np.asarray(shape.position),
                    wxyz=xyzw[[3, 0, 1, 2]],
                )
            )

    def place(self, poses: Poses) -> None:
        """Move all frames."""
        places, turns = np.asarray(poses.position[0]), np.asarray(poses.rotation[0])
        for frame, place, turn in zip(self._frames, places, turns, strict=True):
            frame.position, frame.wxyz = place, quaternion_of(turn)[[3, 0, 1, 2]]

    def remove(self) -> None:
        """Remove all shapes from the page."""
        for handle in reversed(self._handles):
            handle.remove()


def _plane(scene: Any, name: str, shape: Shape, middle: Floats, half: float) -> list[Any]:
    """A piece of a level plane as tiles of two colours."""
    cells = np.arange(TILES * TILES).reshape(TILES, TILES)
    row, column = np.divmod(cells, TILES)
    edge = np.linspace(-half, half, TILES + 1)
    # every tile has corners of its own, so that neighbours may differ
    corners = np.stack(
        [
            np.stack([middle[0] + edge[column + i], middle[1] + edge[row + j]], axis=-1)
            for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))
        ],
        axis=2,
    )
    handles = []
    for side, lightness in ((0, 1.0), (1, STONE)):
        flat = corners[(row + column) % 2 == side].reshape(-1, 2)
        vertices = np.column_stack([flat, np.full(len(flat), float(shape.position[2]))])
        first = 4 * np.arange(len(flat) // 4)
        faces = np.concatenate([first[:, None] + [0, 1, 2], first[:, None] + [0, 2, 3]])
        colour = tuple(lightness * c for c in shape.colour)
        handles.append(
            scene.add_mesh_simple(
                f"{name}_{side}", vertices=vertices, faces=faces, color=colour, cast_shadow=False
            )
        )
    return handles
