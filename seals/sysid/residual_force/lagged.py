"""Correlation of the residual force with the delayed actuator wrench."""

from __future__ import annotations

import itertools
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.sysid.residual_force.conditions import Conditions
from seals.sysid.residual_force.evidence import Evidence
from seals.sysid.residual_force.regress import Table, gain
from seals.sysid.residual_force.residual import Residual

_LAGS = 10
"""Lags on either side, in knots."""
_BAND = 2.576
"""99 % of a normal distribution."""
AXES = ("force x", "force y", "force z", "torque x", "torque y", "torque z")


@dataclass(frozen=True, kw_only=True)
class Following:
    """Regression of the residual wrench on the delayed wrench of the actuators.

    Args:
        lag: of the residual behind the commanded wrench [s], shape (l,).
        correlation: on the axis where it is strongest, shape (l,).
        band: 99 % band of two unrelated series of the same colour.
        axis: that axis.
        peak: strongest correlation.
        peak_lag: where it is [s].
        delay: time by which a later response of the actuators would explain the residual [s].
        delay_sd: its standard error [s].
        delay_share: of the excess that it explains on held-out windows.
        scale: relative change of the actuators' wrench that explains most.
        scale_sd: its standard error.
        scale_share: of the excess that it explains.
    """

    lag: Floats
    correlation: Floats
    band: float
    axis: str
    peak: float
    peak_lag: float
    delay: float
    delay_sd: float
    delay_share: float
    scale: float
    scale_sd: float
    scale_share: float

    def to_dict(self) -> dict[str, Any]:
        """Return the figures."""
        out = asdict(self)
        out["lag"] = np.round(self.lag, 5).tolist()
        out["correlation"] = np.round(self.correlation, 5).tolist()
        return out


def following(found: Evidence, around: Conditions, left: Residual) -> Following | None:
    """Correlate the residual with the actuator wrench over delays; None without actuators."""
    if around.drive is None or around.drive_rate is None:
        return None
    step = float(np.median(np.diff(around.time[: found.knots])))
    runs = [run for run in _runs(around.time) if np.ptp(around.time[run]) >= 4 * _LAGS * step]
    wrench = np.concatenate([left.force, left.torque], axis=1)
    best: tuple[float, Floats, float, int] | None = None
    for axis in range(6):
        drive = around.drive[:, axis]
        if not runs or np.std(drive) < 1e-6 * (1.0 + np.abs(drive).max()):
            continue
        curve, band = _pooled(around.time, wrench[:, axis], drive, runs, step)
        stands = float(np.abs(curve).max()) / band
        if best is None or stands > best[0]:
            best = stands, curve, band, axis
    if best is None:
        return None
    _, curve, band, axis = best
    at = int(np.argmax(np.abs(curve)))
    lags: Floats = np.arange(-_LAGS, _LAGS + 1).astype(float) * step
    delay = _share(found, -around.drive_rate[:, :, None])
    scale = _share(found, around.drive[:, :, None])
    return Following(
        lag=lags,
        correlation=curve,
        band=band,
        axis=AXES[axis],
        peak=float(curve[at]),
        peak_lag=float(lags[at]),
        delay=delay[0],
        delay_sd=delay[1],
        delay_share=delay[2],
        scale=scale[0],
        scale_sd=scale[1],
        scale_share=scale[2],
    )


def _share(found: Evidence, basis: Floats) -> tuple[float, float, float]:
    table = Table(found, basis)
    won = gain(found.before, table.held_out([0]), found)
    return float(table.solve([0])[0]), float(np.sqrt(table.covariance([0])[0, 0])), won.share


def _runs(time: Floats) -> list[slice]:
    """Runs of rising time: logs that are read together have separate clocks."""
    cuts = [0, *(np.flatnonzero(np.diff(time) <= 0.0) + 1).tolist(), len(time)]
    return [slice(first, last) for first, last in itertools.pairwise(cuts)]


def _pooled(
    time: Floats, x: Floats, y: Floats, runs: list[slice], step: float
) -> tuple[Floats, float]:
    """Correlation and band of all runs together, each weighted by its length."""
    curve, variance, total = np.zeros(2 * _LAGS + 1), 0.0, 0
    for run in runs:
        even = np.arange(time[run][0], time[run][-1], step)
        seen, driven = np.interp(even, time[run], x[run]), np.interp(even, time[run], y[run])
        own, band = _correlation(seen, driven)
        curve += len(even) * own
        variance += (len(even) * band) ** 2
        total += len(even)
    return curve / total, float(np.sqrt(variance)) / total


def _correlation(x: Floats, y: Floats) -> tuple[Floats, float]:
    """Correlation of x with y some lags before, and its 99 % band by Bartlett's formula."""
    x, y = x - x.mean(), y - y.mean()
    count = len(x)
    scale = max(float(np.sqrt((x**2).sum() * (y**2).sum())), 1e-300)
    curve = np.correlate(x, y, "full")[count - 1 - _LAGS : count + _LAGS] / scale
    own = [np.correlate(s, s, "full")[count - 1 :] / max(float(s @ s), 1e-300) for s in (x, y)]
    reach = min(count - 1, 4 * _LAGS)
    colour = 1.0 + 2.0 * float((own[0][1:reach] * own[1][1:reach]).sum())
    return curve, _BAND * float(np.sqrt(max(colour, 1.0) / count))
