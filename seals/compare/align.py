"""Clock offset between a measured and a simulated channel, by correlation."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats


def clock_offset(
    time: Floats, measured: Floats, predicted: Floats, *, most: float
) -> tuple[float, float]:
    """Estimate the delay of a measurement against its prediction.

    Args:
        time: [s], shape (rows,).
        measured: one component, shape (rows,); NaN is skipped.
        predicted: the same of the model, shape (rows,).
        most: largest offset looked for [s].

    Returns:
        Lag [s], positive when the measurement is late, and the correlation at that lag [1]; (0,
        correlation) when the channel does not move enough to tell.
    """
    good = np.isfinite(measured)
    if good.sum() < 16:
        return 0.0, 0.0
    step = float(np.median(np.diff(time)))
    grid = np.arange(time[0], time[-1], step)
    y = _centred(np.interp(grid, time[good], measured[good]))
    x = _centred(np.interp(grid, time, predicted))
    if not y.any() or not x.any():
        return 0.0, 0.0
    reach = min(int(most / step), len(grid) // 3)
    lags = np.arange(-reach, reach + 1)
    match = np.array([_overlap(x, y, int(lag)) for lag in lags])
    best = int(np.argmax(match))
    fine = 0.0
    if 0 < best < len(lags) - 1:
        a, b, c = match[best - 1 : best + 2]
        curve = a - 2.0 * b + c
        fine = 0.5 * (a - c) / curve if curve < 0.0 else 0.0
    return float((lags[best] + fine) * step), float(match[best])


def _centred(values: Floats) -> Floats:
    return np.asarray(values - values.mean())


def _overlap(x: Floats, y: Floats, lag: int) -> float:
    """Correlation of x(t) with y(t + lag) over their common part."""
    a, b = (x[: len(x) - lag], y[lag:]) if lag >= 0 else (x[-lag:], y[:lag])
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0.0 else 0.0
