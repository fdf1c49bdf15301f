"""Rates of sampled signals, and the state of lagging drives."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats


class Rate(NamedTuple):
    """Rate of change of a signal, smoothed by a first-order low-pass.

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
        fresh = (value - self.value) / step
        return Rate(value, keep * self.rate + (1.0 - keep) * fresh)


class Trend(NamedTuple):
    """Rate of a signal, carried ahead in time by its own rate.

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
        first = self.first.next(value, step, time_constant)
        return Trend(first, self.second.next(first.rate, step, time_constant))

    def ahead(self, time: float) -> Floats:
        """Return the rate expected some time [s] from now."""
        expected: Floats = self.first.rate + time * self.second.rate
        return expected


class Lag:
    """First-order lag of drives, as a controller reckons with it.

    Args:
        rise: time constants while the size of the state grows [s], shape (n,).
        fall: while it shrinks [s], shape (n,).
    """

    def __init__(self, rise: Floats, fall: Floats) -> None:
        """Find out whether there is any lag, and whether it differs."""
        # a lag of zero is one far shorter than any period
        self._rise, self._fall = np.maximum(rise, 1e-9), np.maximum(fall, 1e-9)
        self._two = bool(np.any(rise != fall))
        self._lagging = rise > 0.0
        self._all = bool(self._lagging.all())

    def quickened(
        self, wanted: Floats, state: Floats, quicker: float, bounds: tuple[Floats, Floats]
    ) -> Floats:
        """Return the command that makes the drives follow ``quicker`` times as fast as they rise.

        Equation:
            u = x + (w - x) lag quicker / rise: with x' = (u - x) / lag the state follows w with
            rise / quicker.

        Args:
            wanted: states w.
            state: x, as reckoned.
            quicker: at least 1 [1].
            bounds: lowest and highest commands.
        """
        away = wanted - state
        if self._two:
            away = away * (self._of(wanted, state) / self._rise)
        eager = state + quicker * away
        if not self._all:
            eager = np.where(self._lagging, eager, wanted)
        command: Floats = np.minimum(np.maximum(eager, bounds[0]), bounds[1])
        return command

    def followed(self, state: Floats, command: Floats, step: float) -> Floats:
        """Return the states after one period under a held command [s]."""
        after: Floats = command + (state - command) * np.exp(-step / self._of(command, state))
        return after

    def _of(self, goal: Floats, state: Floats) -> Floats:
        if not self._two:
            return self._rise
        found: Floats = np.where(np.abs(goal) < np.abs(state), self._fall, self._rise)
        return found
