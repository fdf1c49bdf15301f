"""Readings of sensors that come late, between the rows of a log."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.sysid.predictors.plant import Plant


def delayed(plant: Plant, reading: Floats, delay: float, order: int = 0) -> Floats:
    """Delay readings, run by run; or return a time derivative of them.

    Cubic pieces with the slopes of central differences: straight ones would weigh the noise of the
    trajectory by where between two rows the delay falls.
    """
    out: Floats = reading.copy()
    step = plant.samples.step
    for first, last in plant.samples.runs:
        time, seen = plant.samples.time[first:last], reading[first:last]
        if len(time) < 2:
            continue
        if not np.isfinite(seen).all():
            # a trajectory that ran out of digits has no readings at any time
            out[first:last] = np.nan
            continue
        moments = np.clip(time - delay, time[0], time[-1])
        out[first:last] = hermite(time, seen, np.gradient(seen, step, axis=0), moments, order)
    return out


def hermite(time: Floats, values: Floats, slopes: Floats, at: Floats, order: int) -> Floats:
    """Return cubic pieces between values (T, k) with slopes, or their first derivative, at times.

    `scipy.interpolate.CubicHermiteSpline` is the same, and takes a tenth of a second to import.
    """
    row = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    step = np.diff(time)[row][:, None]
    t = (at - time[row])[:, None] / step
    first, rise = values[row], values[row + 1] - values[row]
    begin, end = slopes[row] * step, slopes[row + 1] * step
    bend, twist = 3.0 * rise - 2.0 * begin - end, begin + end - 2.0 * rise
    if order:
        found: Floats = (begin + t * (2.0 * bend + t * (3.0 * twist))) / step
    else:
        found = first + t * (begin + t * (bend + t * twist))
    return found
