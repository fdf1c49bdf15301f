"""A scene as tables of convex primitives, sorted by kind."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.plugins.viewers.raycast.convex import solids_of
from seals.rendering.scene import Scene, Shape

KINDS = ("sphere", "box", "cylinder", "convex", "plane")
"""Order of the kinds in the tables."""


class _Solid(NamedTuple):
    """One primitive in its frame; size as half lengths, for a cylinder (radius, radius, half)."""

    kind: str
    half: tuple[float, float, float]
    position: Floats
    rotation: Floats
    colour: tuple[float, float, float]
    part: int
    frame: int
    normals: Floats | None = None
    offsets: Floats | None = None
    tile: float = 0.0

    def planes(self) -> int:
        """Number of planes reserved for a convex solid in its group: the next power of two."""
        count = 0 if self.offsets is None else len(self.offsets)
        return 1 << max(count - 1, 0).bit_length()


class Tables(NamedTuple):
    """All primitives of a scene, K of them.

    Args:
        counts: number of each kind, in the order of ``KINDS``.
        half: half lengths [m], shape (K, 3).
        position: in the frames [m], shape (K, 3).
        rotation: in the frames, shape (K, 3, 3).
        colour: displayed, shape (K, 3).
        part: shape (K,).
        frame: shape (K,); the last frame of all stands still.
        hulls: number of convex ones, and of planes, of each group of them.
        normals: of the planes of convex ones, group by group, zero where one has fewer than its
            group, shape (P, 3).
        offsets: of those planes [m], one where there are fewer, shape (P,).
        tile: edge of a plane's squares [m], shape (K,).
    """

    counts: tuple[int, ...]
    half: Floats
    position: Floats
    rotation: Floats
    colour: Floats
    part: NDArray[np.int32]
    frame: NDArray[np.int64]
    hulls: tuple[tuple[int, int], ...]
    normals: Floats
    offsets: Floats
    tile: Floats

    @classmethod
    def of(cls, scene: Scene) -> Tables:
        """Return the primitives of a scene.

        Example:
            >>> ball = Shape("capsule", (0.1, 1.0), np.zeros(3), np.eye(3), (1.0, 0.0, 0.0), 1)
            >>> Tables.of(Scene((ball,), ("nothing", "a"), ())).counts
            (2, 0, 1, 0, 0)
        """
        found = [solid for shape in scene.shapes for solid in _split(shape)]
        found.sort(key=lambda solid: (KINDS.index(solid.kind), solid.planes()))
        hulls, normals, offsets = _grouped([s for s in found if s.kind == "convex"])
        still = len(scene.frames)
        return cls(
            counts=tuple(sum(s.kind == kind for s in found) for kind in KINDS),
            half=np.array([s.half for s in found]).reshape(-1, 3),
            position=np.array([s.position for s in found]).reshape(-1, 3),
            rotation=np.array([s.rotation for s in found]).reshape(-1, 3, 3),
            colour=np.array([s.colour for s in found]).reshape(-1, 3),
            part=np.array([s.part for s in found], dtype=np.int32),
            frame=np.array([still if s.frame < 0 else s.frame for s in found], dtype=np.int64),
            hulls=hulls,
            normals=normals,
            offsets=offsets,
            tile=np.array([s.tile for s in found]),
        )


def _grouped(solids: list[_Solid]) -> tuple[tuple[tuple[int, int], ...], Floats, Floats]:
    """Convex solids in groups of like size, and all their planes."""
    sizes = [s.planes() for s in solids]
    groups = tuple((sizes.count(n), n) for n in sorted(set(sizes)))
    normals, offsets = np.zeros((sum(sizes), 3)), np.ones(sum(sizes))
    start = 0
    for solid, size in zip(solids, sizes, strict=True):
        assert solid.normals is not None
        assert solid.offsets is not None
        cut = slice(start, start + len(solid.offsets))
        normals[cut], offsets[cut] = solid.normals, solid.offsets
        start += size
    return groups, normals, offsets


def _split(shape: Shape) -> list[_Solid]:
    """The primitives that make up a shape: a mesh is its convex pieces, a capsule three."""
    place, turn = np.asarray(shape.position, dtype=float), np.asarray(shape.rotation, dtype=float)
    rest = (shape.colour, shape.part, shape.frame)
    if shape.kind == "mesh":
        assert shape.vertices is not None
        assert shape.faces is not None
        return [
            _Solid(
                piece.kind,
                _half(piece.kind, piece.size),
                place + turn @ piece.position,
                turn @ piece.rotation,
                *rest,
                piece.normals,
                piece.offsets,
            )
            for piece in solids_of(shape.vertices, shape.faces)
        ]
    if shape.kind == "capsule":
        end = 0.5 * shape.size[1] * turn[:, 2]
        parts = (("cylinder", 0.0), ("sphere", 1.0), ("sphere", -1.0))
        return [
            _Solid(kind, _half(kind, shape.size), place + side * end, turn, *rest)
            for kind, side in parts
        ]
    return [_Solid(shape.kind, _half(shape.kind, shape.size), place, turn, *rest, tile=shape.tile)]


def _half(kind: str, size: tuple[float, ...]) -> tuple[float, float, float]:
    """Half lengths along the axes of a primitive [m]; ones for what planes bound."""
    if kind == "box":
        return 0.5 * size[0], 0.5 * size[1], 0.5 * size[2]
    if kind in ("sphere", "cylinder"):
        return size[0], size[0], 0.5 * size[1] if kind == "cylinder" else size[0]
    return 1.0, 1.0, 1.0
