"""Images formed from the echoes of a sonar or a lidar."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.rendering.files import png
from seals.state_records import state_record

MOST_RAYS = 1 << 22
"""Rays of a scan, and entries of each table of it."""


@state_record
class Scan(NamedTuple):
    """Images of one ping or one turn, with number, time and pose.

    Args:
        number: from 0 on.
        time: at which it was taken [s].
        images: grey images of 8 or 16 bits by the ending of their files.
        position: of the sensor, world [m], shape (3,).
        axes: of the sensor in the world as columns, shape (3, 3).
    """

    number: int
    time: float
    images: Mapping[str, Any]
    position: Floats
    axes: Floats

    def files(self) -> Mapping[str, bytes]:
        """Return PNG files by the ending of their names."""
        return {ending: png(image) for ending, image in self.images.items()}


def counts(values: Floats, unit: float) -> NDArray[np.uint16]:
    """Return values in whole units as 16 bits; 0 for what is not finite, not positive or too large.

    Example:
        >>> counts(np.array([1.25, np.inf, -3.0]), 0.01).tolist()
        [125, 0, 0]
    """
    whole = np.rint(np.where(np.isfinite(values), values, 0.0) / unit)
    return np.where((whole < 0.0) | (whole > 65535.0), 0.0, whole).astype(np.uint16)


def fan(bearings: Floats, nearest: float, farthest: float, height: int) -> NDArray[np.int64]:
    """Return which echo each pixel of a fan from above shows; -1 beside the fan, shape (H, W).

    The sensor is in the middle of the lower edge and looks up, left is left.

    Args:
        bearings: of the beams, from left to right: falling [rad], shape (B,).
        nearest: range of the first bin [m].
        farthest: end of the last bin [m].
        height: of the picture, also the number of bins [px].

    Example:
        >>> fan(np.array([0.5, 0.0, -0.5]), 0.0, 1.0, 4).shape
        (4, 4)
    """
    widest = min(float(np.max(np.abs(bearings))), 0.5 * np.pi)
    half = max(int(np.ceil(height * np.sin(widest))), 1)
    ahead = (height - np.arange(height) - 0.5)[:, None]
    left = (half - np.arange(2 * half) - 0.5)[None, :]
    size = farthest / height
    way, bearing = np.hypot(ahead, left) * size, np.arctan2(left, ahead)
    beam = np.rint(np.interp(-bearing, -bearings, np.arange(len(bearings)))).astype(np.int64)
    row = np.floor((way - nearest) / (farthest - nearest) * height).astype(np.int64)
    off = 0.5 * (2.0 * widest) / max(len(bearings) - 1, 1)
    seen = (row >= 0) & (row < height) & (np.abs(bearing) <= widest + off)
    return np.where(seen, beam * height + row, -1)
