"""Pairs of close points in NumPy: for checks and boundary volumes, outside of the time loop."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from seals.plugins.fluids.pbd.lattice import SHAPES, Calibration
from seals.plugins.fluids.pbd.settings import Kernel

Array = NDArray[np.float64]
Index = NDArray[np.int64]
# points looked at together, to bound the memory
BATCH = 20_000


def close_pairs(a: Array, b: Array, radius: float) -> Iterator[tuple[Index, Index, Array]]:
    """Yield (rows of a, rows of b, distances) of all pairs closer than ``radius``, in batches.

    Example:
        >>> a = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
        >>> [(i.tolist(), j.tolist()) for i, j, _ in close_pairs(a, a + 0.1, 1.0)]
        [([0, 1], [0, 1])]
    """
    if not len(a) or not len(b):
        return
    low = np.minimum(a.min(axis=0), b.min(axis=0)) - radius
    shape = np.floor((np.maximum(a.max(axis=0), b.max(axis=0)) - low) / radius).astype(int) + 3
    cells = np.floor((b - low) / radius).astype(np.int64) + 1
    keys = (cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2]
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    for begin in range(0, len(a), BATCH):
        part = a[begin : begin + BATCH]
        at = np.floor((part - low) / radius).astype(np.int64) + 1
        for ox in (-1, 0, 1):
            for oy in (-1, 0, 1):
                centre = ((at[:, 0] + ox) * shape[1] + at[:, 1] + oy) * shape[2] + at[:, 2]
                first = np.searchsorted(keys, centre - 1)
                counts = np.searchsorted(keys, centre + 1, side="right") - first
                total = int(counts.sum())
                if not total:
                    continue
                i = np.repeat(np.arange(len(part)), counts)
                skip = np.repeat(first - (np.cumsum(counts) - counts), counts)
                j = order[np.arange(total) + skip]
                r = np.linalg.norm(part[i] - b[j], axis=1)
                near = r < radius
                if near.any():
                    yield i[near] + begin, j[near], r[near]


def nearest_pair(a: Array, b: Array, radius: float, *, same: bool = False) -> float:
    """Return the smallest distance below ``radius`` between a and b, or ``radius`` [m]."""
    best = radius
    for i, j, r in close_pairs(a, b, radius):
        chosen = r[i != j] if same else r
        best = min(best, float(chosen.min(initial=radius)))
    return best


def boundary_weights(
    points: Array, *, spacing: float, kernel: Kernel, lattice: Calibration, convex: bool
) -> Array:
    """Return the weight of each sample: the area it stands for, in squared spacings.

    Volumes follow Akinci et al. 2012, one over the sum of the kernel over the same body's samples,
    so uneven and single layers are allowed. They are scaled so that a flat square sheet with the
    given spacing completes the lattice of the water: weight one.

    Samples of a convex body lie half a spacing below its surface, where there is less area than
    on it. The offset between a sample and the mean of its neighbours measures the curvature H, and
    (1 + H spacing / 2)^2 makes up for it; a box's edges gain the area that its faces lost.
    """
    total, offset = np.zeros(len(points)), np.zeros_like(points)
    for i, j, r in close_pairs(points, points, 2 * spacing):
        value, _ = SHAPES[kernel](r / spacing)
        np.add.at(total, i, value)
        np.add.at(offset, i, value[:, None] * (points[i] - points[j]))
    weights = np.asarray(lattice.sheet / (lattice.factor * total))
    if convex:
        bend = 2 * np.linalg.norm(offset, axis=1) / total / (lattice.spread * spacing)
        weights = weights * (1 + 0.5 * bend) ** 2
    return weights
