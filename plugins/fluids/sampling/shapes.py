"""Sampling of primitives in layers from the surface inwards.

The first layer lies half a spacing under the surface, the next one a spacing deeper, as if the
fluid's lattice went on. Every sample has the volume of its own cell: the volumes of all layers add
up to that of the body, to rounding.
"""

from __future__ import annotations

import math

import numpy as np

from seals.arrays import Floats
from seals.plugins.fluids.sampling.samples import Samples

SEEN = 1
"""Layers of boundary samples: one stands for all that lies behind it."""

ALL = 1_000_000
"""Layers that fill the whole body."""
_GOLDEN = math.pi * (3.0 - math.sqrt(5.0))


def sample_box(size: tuple[float, ...], spacing: float, layers: int = SEEN) -> Samples:
    """Sample a box about its centre.

    Args:
        size: edges [m].
        spacing: [m]; the nearest spacing that divides an edge evenly is taken along it.
        layers: under the surface; deeper ones are left out.

    Example:
        >>> bool(np.isclose(sample_box((0.4, 0.2, 0.1), 0.1).volumes.sum(), 0.008))
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


def sample_sphere(
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


def sample_cylinder(size: tuple[float, ...], spacing: float, layers: int = SEEN) -> Samples:
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


def sample_capsule(size: tuple[float, ...], spacing: float, layers: int = SEEN) -> Samples:
    """Sample a capsule along z about its centre: a cylinder between two halves of a ball.

    Args:
        size: radius and length of the straight part [m].
        spacing: [m].
        layers: under the surface; deeper ones are left out.
    """
    radius, length = size
    ball = sample_sphere(radius, spacing, layers, halves=True)
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
