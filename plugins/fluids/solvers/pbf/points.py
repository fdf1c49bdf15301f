"""Search of close point pairs in NumPy, for checks and boundary volumes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from seals.plugins.fluids.solvers.device_settings import Kernel
from seals.plugins.fluids.solvers.pbf.lattice import Calibration, shape_of

Array = NDArray[np.float64]
Index = NDArray[np.int64]
# how far water keeps off a convex surface, over H spacing^2: measured on held balls, 8 and 12
# spacings across
BULGE = 0.4
# no sample is moved by more than this [spacings]
MOST = 0.12
# radius in which samples make a sheet [spacings], and its least spread over the next one
SHEET, FLAT = 1.6, 0.5
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


def weigh(
    points: Array, *, spacing: float, kernel: Kernel, lattice: Calibration, convex: bool
) -> tuple[Array, Array]:
    """Return boundary samples with weights; those of convex bodies are offset inwards.

    Volumes follow Akinci et al. 2012, one over the sum of the kernel over the same body's samples,
    so uneven and single layers are allowed. They are scaled so that a flat square sheet with the
    given spacing completes the lattice of the water: weight one.

    Water keeps off a surface that bulges towards it, also off edges. The offset between a sample
    and the mean of its neighbours measures the curvature H and the normal; `BULGE` H spacing^2
    inwards makes the displaced volume right.

    Args:
        points: positions [m], shape (b, 3).
        spacing: of the water [m].
        kernel: smoothing kernel.
        lattice: its calibration.
        convex: whether the samples lie half a spacing below a surface that bulges.
    """
    total, offset = np.zeros(len(points)), np.zeros_like(points)
    shape = shape_of(kernel, lattice.support)
    for i, j, r in close_pairs(points, points, lattice.support * spacing):
        value, _ = shape(r / spacing)
        np.add.at(total, i, value)
        np.add.at(offset, i, value[:, None] * (points[i] - points[j]))
    weights = np.asarray(lattice.sheet / (lattice.factor * total))
    if not convex:
        return points, weights
    # of length H spacing
    bend = 2 * offset / total[:, None] / (lattice.spread * spacing)
    size = np.linalg.norm(bend, axis=1, keepdims=True)
    shift = BULGE * spacing * bend * np.minimum(1.0, MOST / np.maximum(BULGE * size, 1e-12))
    return points - shift, weights


def plane_normals(points: Array, spacing: float) -> Array:
    """Return the normal of the sheet around every point, of either sign; zero if there is none.

    Args:
        points: samples of a surface [m], shape (b, 3).
        spacing: of the water [m].

    Example:
        >>> x, y = np.meshgrid(np.arange(3.0), np.arange(3.0))
        >>> sheet = np.column_stack([x.ravel(), y.ravel(), np.zeros(9)])
        >>> np.abs(plane_normals(sheet, 1.0)[4]).tolist()
        [0.0, 0.0, 1.0]
    """
    spread = np.zeros((len(points), 3, 3))
    for i, j, _ in close_pairs(points, points, SHEET * spacing):
        off = points[i] - points[j]
        np.add.at(spread, i, off[:, :, None] * off[:, None, :])
    size, axes = np.linalg.eigh(spread)
    flat = size[:, 0] < FLAT * size[:, 1]
    return np.asarray(np.where(flat[:, None], axes[:, :, 0], 0.0))
