"""Samples of a solid in a particle fluid, each with the volume it displaces.

Primitives are filled in layers from the surface inwards. The first layer lies half a spacing under
the surface, the next one a spacing deeper, as if the fluid's lattice went on. Every sample has the
volume of its own cell: the volumes of all layers add up to that of the body, to rounding.

The surface layer of faces is finer than the fluid's lattice. Were its samples a spacing apart, the
density that they add would change by a third from place to place along a flat wall, and a fluid
that slides along it would climb from hollow to hollow: water in a slice of eight spacings between
such walls loses half of a wave in one period, against a third without. Two thirds of a spacing
leave one per cent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats


class Samples(NamedTuple):
    """Samples of one solid.

    Args:
        points: [m], shape (b, 3).
        volumes: displaced by each sample [m^3], shape (b,).
        bulk: 1 for samples of thick solids, weighed by area; 0 for those of thin ones, weighed
            by volume; blended between; shape (b,). None for 1.
    """

    points: Floats
    volumes: Floats
    bulk: Floats | None = None

    def placed(self, position: Floats, rotation: Floats) -> Samples:
        """Return the samples in other axes."""
        return self._replace(points=position + self.points @ rotation.T)

    @property
    def thick(self) -> Floats:
        """`bulk` of every sample, shape (b,)."""
        return np.ones(len(self.points)) if self.bulk is None else self.bulk


def joined(parts: Sequence[Samples]) -> Samples:
    """Concatenate several sets of samples.

    Example:
        >>> joined([]).points.shape
        (0, 3)
    """
    points = [part.points for part in parts] or [np.zeros((0, 3))]
    volumes = [part.volumes for part in parts] or [np.zeros(0)]
    bulk = [part.thick for part in parts] or [np.zeros(0)]
    return Samples(np.concatenate(points), np.concatenate(volumes), np.concatenate(bulk))


SEEN = 1
"""Layers of boundary samples: one stands for all that lies behind it."""

ALL = 1_000_000
"""Layers that fill the whole body."""
_GOLDEN = math.pi * (3.0 - math.sqrt(5.0))


def _sample_box(size: tuple[float, ...], spacing: float, layers: int = SEEN) -> Samples:
    """Sample a box about its centre.

    Args:
        size: edges [m].
        spacing: [m]; the nearest spacing that divides an edge evenly is taken along it.
        layers: under the surface; deeper ones are left out.

    Example:
        >>> bool(np.isclose(_sample_box((0.4, 0.2, 0.1), 0.1).volumes.sum(), 0.008))
        True
    """
    counts = [max(1, round(edge / spacing)) for edge in size]
    axes = [
        (np.arange(n) + 0.5) / n * edge - 0.5 * edge for n, edge in zip(counts, size, strict=True)
    ]
    index = np.stack(np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"), -1).reshape(-1, 3)
    deep = np.minimum(index, np.array(counts) - 1 - index).min(axis=1)
    kept = index[deep < layers]
    points = np.stack([axis[kept[:, k]] for k, axis in enumerate(axes)], axis=1)
    return Samples(points, np.full(len(points), math.prod(size) / math.prod(counts)))


def _sample_sphere(
    radius: float, spacing: float, layers: int = SEEN, *, halves: bool = False
) -> Samples:
    """Sample a ball about its centre by evenly covered shells.

    Args:
        radius: [m].
        spacing: [m].
        layers: under the surface; deeper ones are left out.
        halves: whether the upper half shall have as many samples as the lower one.
    """
    shells = max(1, round(radius / spacing))
    edges = radius * np.arange(shells + 1) / shells
    points, volumes = [], []
    for k in range(max(0, shells - layers), shells):
        inner, outer = edges[k], edges[k + 1]
        whole = 4.0 / 3.0 * math.pi * (outer**3 - inner**3)
        count = max(1, round(whole / spacing**3))
        count += count % 2 if halves else 0
        middle = 0.5 * (inner + outer) if count > 1 else 0.0
        points.append(middle * _even_directions(count))
        volumes.append(np.full(count, whole / count))
    return Samples(np.concatenate(points), np.concatenate(volumes))


def _sample_cylinder(size: tuple[float, ...], spacing: float, layers: int = SEEN) -> Samples:
    """Sample a cylinder along z about its centre by rings in slices.

    Args:
        size: radius and length [m].
        spacing: [m].
        layers: under the surface; deeper ones are left out.
    """
    radius, length = size
    slices, rings = max(1, round(length / spacing)), max(1, round(radius / spacing))
    heights = (np.arange(slices) + 0.5) / slices * length - 0.5 * length
    parts = [
        _slice(
            radius,
            rings,
            spacing,
            height,
            length / slices,
            inner=0 if min(k, slices - 1 - k) < layers else max(0, rings - layers),
        )
        for k, height in enumerate(heights)
    ]
    return Samples(
        np.concatenate([p.points for p in parts]), np.concatenate([p.volumes for p in parts])
    )


def _slice(
    radius: float, rings: int, spacing: float, height: float, thick: float, *, inner: int
) -> Samples:
    """One slice: the rings from the number ``inner`` on."""
    points, volumes = [], []
    for ring in range(inner, rings):
        low, high = radius * ring / rings, radius * (ring + 1) / rings
        area = math.pi * (high**2 - low**2)
        count = max(1, round(area / spacing**2))
        middle = 0.5 * (low + high) if count > 1 else 0.0
        # turned against the slice below and the ring inside: rows do not line up
        angle = 2.0 * math.pi * (np.arange(count) + 0.5 * ring) / count + _GOLDEN * height / thick
        points.append(
            np.stack([middle * np.cos(angle), middle * np.sin(angle), np.full(count, height)], 1)
        )
        volumes.append(np.full(count, area * thick / count))
    return Samples(np.concatenate(points), np.concatenate(volumes))


def _sample_capsule(size: tuple[float, ...], spacing: float, layers: int = SEEN) -> Samples:
    """Sample a capsule along z about its centre: a cylinder between two halves of a ball.

    Args:
        size: radius and length of the straight part [m].
        spacing: [m].
        layers: under the surface; deeper ones are left out.
    """
    radius, length = size
    ball = _sample_sphere(radius, spacing, layers, halves=True)
    ends = ball.points.copy()
    ends[:, 2] += np.where(ends[:, 2] >= 0.0, 0.5, -0.5) * length
    slices, rings = max(1, round(length / spacing)), max(1, round(radius / spacing))
    heights = (np.arange(slices) + 0.5) / slices * length - 0.5 * length
    parts = [Samples(ends, ball.volumes)]
    inner = max(0, rings - layers)
    parts += [_slice(radius, rings, spacing, z, length / slices, inner=inner) for z in heights]
    return Samples(
        np.concatenate([p.points for p in parts]), np.concatenate([p.volumes for p in parts])
    )


def _even_directions(count: int) -> Floats:
    """Unit vectors spread evenly, by the golden angle, shape (count, 3)."""
    if count == 2:
        return np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle, flat = _GOLDEN * np.arange(count), np.sqrt(1.0 - z * z)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=1)


PITCH = 2.0 / 3.0
"""Distance of samples in a face, in spacings of the fluid."""


THICK = 3.0
"""Thickness from which a solid has a face, in spacings of the fluid."""


def fine_face(
    kind: str, size: tuple[float, ...], spacing: float, *, pitch: float = PITCH
) -> Samples:
    """Sample the surface layer of a box, sphere, cylinder or capsule.

    The samples are those of a slightly smaller shape at the finer distance, so that they lie half a
    spacing of the fluid under the surface; they share the volume of the layer evenly.

    Args:
        kind: of the shape.
        size: as the shape's own function takes it [m].
        spacing: of the fluid [m].
        pitch: distance of the samples [1 spacing].

    Example:
        >>> found = fine_face("sphere", (0.1,), 0.02)
        >>> bool(abs((found.points**2).sum(axis=1) ** 0.5 - 0.09).max() < 1e-9)
        True
    """
    fine = pitch * spacing
    edges = []
    for edge in size:
        span = face_edge(edge, spacing)
        count = round(span / fine) + 1
        edges.append(span * count / max(count - 1, 1))
    # the radius of a finer sphere with the outer shell of `radius` [m]
    reach = max(size[0] - 0.5 * spacing, 0.0)
    shells = max(1, round(reach / fine + 0.5))
    radius = reach / (1.0 - 0.5 / shells)
    smaller = {
        "sphere": (radius,),
        "box": tuple(edges),
        "cylinder": (radius, edges[-1]),
        "capsule": (radius, size[-1]),
    }[kind]
    whole, found = sample_shape(kind, size, spacing), sample_shape(kind, smaller, fine)
    return Samples(found.points, found.volumes * (whole.volumes.sum() / found.volumes.sum()))


def face_edge(edge: float, spacing: float) -> float:
    """Return the distance between the outermost samples of an edge [m]."""
    return max(edge - spacing, 0.0)


def sample_shape(kind: str, size: tuple[float, ...], spacing: float, layers: int = SEEN) -> Samples:
    """Sample a box, sphere, cylinder or capsule about its centre.

    Args:
        kind: of the shape.
        size: as the shape's own function takes it [m].
        spacing: [m].
        layers: under the surface; deeper ones are left out.
    """
    if kind == "sphere":
        return _sample_sphere(size[0], spacing, layers)
    draw = {"box": _sample_box, "cylinder": _sample_cylinder, "capsule": _sample_capsule}
    return draw[kind](size, spacing, layers)
