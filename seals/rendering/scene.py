"""Visual scene: coloured shapes, each on a moving link or fixed in the world."""

from __future__ import annotations

import enum
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Array, Floats
from seals.errors import ConfigError, PhysicsError, refuse_unlisted

NOTHING = "nothing"
"""Name of what a ray meets that meets nothing; always the first of a scene."""
WORLD = -1
"""Frame of shapes that stand still."""
TILE = 0.25
"""Edge of the squares on a level ground [m]: something for the eye to hold on to."""
SIZES = {"plane": 0, "box": 3, "sphere": 1, "cylinder": 2, "capsule": 2, "mesh": 0}
"""Kinds of shapes and how many lengths describe them."""


class Detail(enum.Enum):
    """Level of detail of the links.

    ``visual`` takes the URDF's visual geometry; ``simple`` the primitives that displace water, or
    the collision geometry of links that displace none.
    """

    visual = "visual"
    simple = "simple"


class Shape(NamedTuple):
    """A solid of one colour.

    Args:
        kind: a key of ``SIZES``; a plane is a level half space below its position.
        size: box edges; cylinder and capsule radius, length of the straight part; sphere radius,
            all [m].
        position: of its centre or, of a mesh, its origin, in its frame [m], shape (3,).
        rotation: of its axes in its frame, shape (3, 3); cylinders and capsules lie along z.
        colour: red, green, blue as displayed (sRGB), 0 to 1.
        part: number of its name in the scene.
        frame: number of the pose that carries it, ``WORLD`` for none.
        vertices: of a mesh, its axes [m], shape (V, 3).
        faces: of a mesh, anticlockwise from outside, shape (F, 3).
        tile: edge of a plane's squares [m], 0 for one colour.
    """

    kind: str
    size: tuple[float, ...]
    position: Floats
    rotation: Floats
    colour: tuple[float, float, float]
    part: int
    frame: int = WORLD
    vertices: Floats | None = None
    faces: NDArray[np.int64] | None = None
    tile: float = 0.0


class Scene(NamedTuple):
    """Visual scene of cameras: shapes, colours and frames.

    Args:
        shapes: all solids.
        names: of the parts, ``actor/link`` or ``world/solid``; the numbers in a picture's ``parts``
            are places in this list. The first is ``NOTHING``.
        frames: names of the poses that carry shapes, ``actor/link``.
    """

    shapes: tuple[Shape, ...]
    names: tuple[str, ...]
    frames: tuple[str, ...]

    def part(self, name: str) -> int:
        """Return the number of a part.

        Raises:
            ConfigError: there is no such part.
        """
        refuse_unlisted(name, self.names, f"'{name}' is not in the scene", label="Parts")
        return self.names.index(name)


class Poses(NamedTuple):
    """Poses of the frames of a scene.

    Args:
        position: world [m], shape (N, F, 3): F frames in each of N environments.
        rotation: R_WF, shape (N, F, 3, 3).
    """

    position: Array
    rotation: Array

    @classmethod
    def nowhere(cls, environments: int = 1) -> Poses:
        """Return the poses of a scene without moving frames."""
        return cls(np.zeros((environments, 0, 3)), np.zeros((environments, 0, 3, 3)))


_Prepared = TypeVar("_Prepared")


def opened(prepared: _Prepared | None) -> _Prepared:
    """Return what a renderer has prepared of its scene.

    Raises:
        PhysicsError: no scene is open.
    """
    if prepared is None:
        raise PhysicsError("the renderer has no scene.\nOpen one first: open(scene, light)")
    return prepared


def check_scene(scene: Scene) -> None:
    """Refuse a scene that no renderer can draw.

    Raises:
        ConfigError: a shape is of an unknown kind, or its numbers do not fit.
    """
    for k, shape in enumerate(scene.shapes):
        refuse_unlisted(shape.kind, SIZES, f"shape {k} is a '{shape.kind}'", label="Kinds")
        right = len(shape.size) == SIZES[shape.kind] and all(0.0 < x < np.inf for x in shape.size)
        if not right:
            raise ConfigError(
                f"shape {k}, a {shape.kind}, has the size {list(shape.size)}.\n"
                f"Allowed: {SIZES[shape.kind]} lengths above zero [m]."
            )
        if shape.kind == "mesh" and (shape.vertices is None or shape.faces is None):
            raise ConfigError(f"shape {k} is a mesh.\nGive it vertices and faces.")
        if not (0 < shape.part < len(scene.names) and WORLD <= shape.frame < len(scene.frames)):
            raise ConfigError(
                f"shape {k} names part {shape.part} and frame {shape.frame}.\n"
                f"Allowed: parts 1 to {len(scene.names) - 1}, frames up to {len(scene.frames) - 1}."
            )
