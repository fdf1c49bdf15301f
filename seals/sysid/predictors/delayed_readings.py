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
    from scipy.interpolate import CubicHermiteSpline

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
        curve = CubicHermiteSpline(time, seen, np.gradient(seen, step, axis=0))
        out[first:last] = curve(np.clip(time - delay, time[0], time[-1]), order)
    return out
