"""Shapes of a scene for Mitsuba: mesh files and their poses."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.rendering.meshes import triangles
from seals.rendering.optics import to_linear
from seals.rendering.scene import WORLD, Scene, Shape
from seals.run.surface import Mesh, write_ply

SHINE = 0.45
"""Roughness of painted and moulded surfaces [1]."""
METAL = 0.06
"""Spread of the three colours under which a dark surface is taken for metal or rubber [1]."""


def write_shapes(scene: Scene, folder: Path) -> list[tuple[int, Shape, Path]]:
    """Write every shape but level planes to a file; return number, shape and file of each."""
    import trimesh

    found = []
    for number, shape in enumerate(scene.shapes):
        if shape.kind == "plane":
            continue
        corners, faces = triangles(shape)
        points = np.asarray(corners) @ np.asarray(shape.rotation).T + shape.position
        path = folder / f"shape_{number}.ply"
        if shape.kind != "sphere":
            # faces that meet at more than 40 degrees share no corners: such keep their edge
            body: Any = trimesh.Trimesh(points, faces, process=True)
            smooth = trimesh.graph.smooth_shade(body, angle=np.radians(40.0))
            points, faces = smooth.vertices, smooth.faces
        write_ply(path, Mesh(np.array(points, dtype=float), np.array(faces, dtype=np.int64)))
        found.append((number, shape, path))
    return found


def material(colour: tuple[float, float, float]) -> Mapping[str, Any]:
    """Return the surface material of a link of a displayed colour."""
    grey = max(colour) - min(colour) < METAL
    metal = 0.7 if grey and 0.35 < max(colour) < 0.75 else 0.0
    return {
        "type": "twosided",
        "bsdf": {
            "type": "principled",
            "base_color": {"type": "rgb", "value": to_linear(np.array(colour)).tolist()},
            "roughness": SHINE,
            "metallic": metal,
            "specular": 0.5,
        },
    }


def pose_of(shape: Shape, position: Floats, rotation: Floats) -> Floats:
    """Return the pose of a shape's file in the world as a 4 x 4 matrix."""
    place = np.eye(4)
    if shape.frame != WORLD:
        place[:3, :3], place[:3, 3] = rotation[shape.frame], position[shape.frame]
    return place
