"""Filters: derivative of sampled signals, and first-order lag of drives."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.state_records import state_record

NONE = 1e-9
"""A lag of zero is one far shorter than any period [s]."""


@state_record
class Rate(NamedTuple):
    """Derivative of a signal, smoothed by a first-order low-pass.

    Args:
        value: last sample; None before the first.
        rate: of change, smoothed, shape as the samples.
    """

    value: Floats | None
    rate: Floats

    def next(self, value: Floats, step: float, time_constant: float) -> Rate:
        """Return the rate after one more sample.

        Example:
            >>> Rate(None, np.zeros(1)).next(np.zeros(1), 0.1, 0.0).next(np.ones(1), 0.1, 0.0).rate
            array([10.])
        """
        if self.value is None:
            return Rate(value, self.rate)
        keep = math.exp(-step / time_constant) if time_constant > 0.0 else 0.0
        return Rate(value, keep * self.rate + ((1.0 - keep) / step) * (value - self.value))


@state_record
class Trend(NamedTuple):
    """Derivative of a signal, extrapolated by its own derivative.

    Args:
        first: rate of the signal.
        second: rate of that rate.
    """

    first: Rate
    second: Rate

    @staticmethod
    def flat(size: int) -> Trend:
        """Return the trend of a signal of ``size`` numbers before its first sample."""
        none = Rate(None, np.zeros(size))
        return Trend(none, none)

    def next(self, value: Floats, step: float, time_constant: float) -> Trend:
        """Return the trend after one more sample."""
        first, second = self
        if first.value is None or second.value is None:
            grown = first.next(value, step, time_constant)
            return Trend(grown, second.next(grown.rate, step, time_constant))
        keep = math.exp(-step / time_constant) if time_constant > 0.0 else 0.0
        fresh = (1.0 - keep) / step
        rate = keep * first.rate + fresh * (value - first.value)
        change = keep * second.rate + fresh * (rate - second.value)
        return Trend(Rate(value, rate), Rate(rate, change))

    def ahead(self, time: float, first: int = 0, last: int | None = None) -> Floats:
        """Return the derivative extrapolated by a time [s], for all components or some."""
        now, change = self.first.rate[first:last], self.second.rate[first:last]
        expected: Floats = now + time * change
        return expected


class Lag:
    """First-order lag of drives, for compensation by a controller.

    Args:
        rise: time constants while the size of the state grows [s], shape (n,).
        fall: while it shrinks [s], shape (n,).
    """

    def __init__(self, rise: Floats, fall: Floats) -> None:
        rises, falls = np.maximum(rise, NONE).tolist(), np.maximum(fall, NONE).tolist()
        self._pairs = list(zip(rises, falls, strict=True))
        self._columns = np.array(rises), np.array(falls)

    def quickened(
        self, wanted: Array, state: Array, quicker: float, bounds: tuple[Array, Array]
    ) -> Array:
        """Return the command that makes the drives respond ``quicker`` times as fast.

        Equation:
            u = x + (w - x) lag quicker / rise: with x' = (u - x) / lag the state follows w with
            rise / quicker.

        Args:
            wanted: states w.
            state: x, as reckoned.
            quicker: at least 1 [1].
            bounds: lowest and highest commands.
        """
        if type(wanted) is not np.ndarray:
            return self._quickened(wanted, state, quicker, bounds)
        goals, states = wanted.tolist(), state.tolist()
        low, high = bounds[0].tolist(), bounds[1].tolist()
        out = []
        # a few numbers: faster one by one than as arrays
        for w, x, (rise, fall), a, b in zip(goals, states, self._pairs, low, high, strict=True):
            u = w
            if rise > NONE:
                u = x + quicker * (w - x) * ((fall if abs(w) < abs(x) else rise) / rise)
            out.append(min(max(u, a), b))
        return np.array(out)

    def _quickened(
        self, wanted: Array, state: Array, quicker: float, bounds: tuple[Array, Array]
    ) -> Array:
        """Do the same on any array library."""
        xp, (low, high) = namespace(wanted), bounds
        rise, _ = self._columns
        lag = self._lags(wanted, state)
        ahead = xp.where(rise > NONE, state + quicker * (wanted - state) * (lag / rise), wanted)
        return xp.minimum(xp.maximum(ahead, low), high)

    def _lags(self, goal: Array, state: Array) -> Array:
        """Lag of every drive on its way to a goal [s]."""
        rise, fall = self._columns
        xp = namespace(goal)
        return xp.where(xp.abs(goal) < xp.abs(state), fall, rise)

    def followed(self, state: Array, command: Array, step: float) -> Array:
        """Return the states after one period under a held command [s]."""
        if type(state) is not np.ndarray:
            kept = namespace(state).exp(-step / self._lags(command, state))
            return command + (state - command) * kept
        out = []
        for x, u, (rise, fall) in zip(state.tolist(), command.tolist(), self._pairs, strict=True):
            lag = fall if abs(u) < abs(x) else rise
            out.append(u + (x - u) * math.exp(-step / lag))
        return np.array(out)


def summed(total: Floats, error: Floats, step: float, most: float) -> Floats:
    """Return an integral after one more period, each component limited to ``most``."""
    more: Floats = np.minimum(np.maximum(total + step * error, -most), most)
    return more
