"""Rows of the windows of a log, and the delay of a series along them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import LogError
from seals.sysid.data.samples import Samples

_LEAST = 2
"""Rows of the shortest run that is compared."""


def window_rows(samples: Samples, length: float, skip: int) -> NDArray[np.int64]:
    """Return the rows of all windows of a common length, shape (W, K).

    Raises:
        LogError: a run has no rows but those that are left out at its start.
    """
    spans = [(first + skip, last) for first, last in samples.runs]
    for k, (first, last) in enumerate(spans):
        if last - first < _LEAST:
            rows, left_out = last - first + skip, skip * samples.step
            raise LogError(
                f"run {k + 1} of the log has {rows} rows, {rows * samples.step:.3g} s; the start "
                f"state of its drives counts for the first {left_out:.3g} s.\n"
                "Give a longer log, or leave out the runs that are too short."
            )
    longest = max(last - first for first, last in spans)
    wanted = max(4, min(round(length / samples.step), longest))
    pieces = [max(1, round((last - first) / wanted)) for first, last in spans]
    size = min((last - first) // n for (first, last), n in zip(spans, pieces, strict=True))
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
