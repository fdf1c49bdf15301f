"""Filters: derivative of sampled signals, and first-order lag of drives."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace
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
        # exact for a rate that is steady over the step; the step's own difference is the new sample
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
        """Return the trend of a signal of the shape (1, size) before its first sample."""
        none = Rate(None, np.zeros((1, size)))
        return Trend(none, none)

    def next(self, value: Floats, step: float, time_constant: float) -> Trend:
        """Return the trend after one more sample."""
        first, second = self
        if first.value is None or second.value is None:
            grown = first.next(value, step, time_constant)
            return Trend(grown, second.next(grown.rate, step, time_constant))
        # twice `Rate.next` with one exponential: the second takes the rate of the first
        keep = math.exp(-step / time_constant) if time_constant > 0.0 else 0.0
        fresh = (1.0 - keep) / step
        rate = keep * first.rate + fresh * (value - first.value)
        change = keep * second.rate + fresh * (rate - second.value)
        return Trend(Rate(value, rate), Rate(rate, change))

    def ahead(self, time: float, first: int = 0, last: int | None = None) -> Floats:
        """Return the derivative extrapolated by a time [s], for all components or some."""
        now, change = self.first.rate[:, first:last], self.second.rate[:, first:last]
        return now + time * change


class Lag:
    """First-order lag of drives, for compensation by a controller; shapes (n,) or (B, n).

    Args:
        rise: time constants while the size of the state grows [s], shape (n,).
        fall: while it shrinks [s], shape (n,).
        like: array whose library, type and device to use; None for NumPy.
    """

    def __init__(self, rise: Floats, fall: Floats, like: Array | None = None) -> None:
        like = np.zeros(1) if like is None else like
        self._rise, self._fall = (as_like(np.maximum(x, NONE), like) for x in (rise, fall))

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
        xp, (low, high) = namespace(wanted), bounds
        lag = self._lags(wanted, state)
        ahead = state + quicker * (wanted - state) * (lag / self._rise)
        ahead = xp.where(self._rise > NONE, ahead, wanted)
        return xp.minimum(xp.maximum(ahead, low), high)

    def followed(self, state: Array, command: Array, step: float) -> Array:
        """Return the states after one period under a held command [s]."""
        kept = namespace(state).exp(-step / self._lags(command, state))
        return command + (state - command) * kept

    def _lags(self, goal: Array, state: Array) -> Array:
        """Lag of every drive on its way to a goal [s]."""
        xp = namespace(goal)
        return xp.where(xp.abs(goal) < xp.abs(state), self._fall, self._rise)


def summed(total: Array, error: Array, step: float, most: Any) -> Array:
    """Return an integral after one more period, each component limited to ``most``."""
    xp = namespace(total)
    return xp.minimum(xp.maximum(total + step * error, -most), most)
