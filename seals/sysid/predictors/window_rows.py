"""Rows of the windows of a log, and the delay of a series along them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import LogError
from seals.sysid.data.samples import Samples


def window_rows(samples: Samples, length: float, skip: int) -> NDArray[np.int64]:
    """Return the rows of all windows of a common length, shape (W, K).

    Raises:
        LogError: a stretch of the log ends before the first window could begin.
    """
    spans = [(first + skip, last) for first, last in samples.runs]
    longest = max(last - first for first, last in spans)
    wanted = max(4, min(round(length / samples.step), longest))
    pieces = [max(1, round((last - first) / wanted)) for first, last in spans]
    size = min((last - first) // n for (first, last), n in zip(spans, pieces, strict=True))
    if size < 1:
        shortest = min(last - first for first, last in samples.runs)
        raise LogError(
            f"the log is too short: a stretch of it without a gap has {shortest} rows, and states "
            f"settle for {skip}.\nGive a longer log, or one without such gaps."
        )
    starts = [
        first + k * size
        for (first, last), n in zip(spans, pieces, strict=True)
        for k in range((last - first) // size)
    ]
    return np.asarray(starts, dtype=np.int64)[:, None] + np.arange(size)


def delaying(rows: int, late: float) -> Floats:
    """Return the matrix that delays a series by ``late`` rows, by linear interpolation."""
    at = np.arange(rows) - late
    below = np.clip(np.floor(at).astype(int), 0, rows - 2)
    share = at - below
    matrix = np.zeros((rows, rows))
    matrix[np.arange(rows), below] = 1.0 - share
    matrix[np.arange(rows), below + 1] += share
    return matrix
