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


class Lag(NamedTuple):
    """First-order lag of drives, as a controller reckons with it.

    Args:
        rise: time constants while the size of the state grows [s], shape (n,).
        fall: while it shrinks [s], shape (n,).
    """

    rise: Floats
    fall: Floats

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
        lagging = self.rise > 0.0
        share = self._of(wanted, state) / np.where(lagging, self.rise, 1.0)
        eager = np.where(lagging, state + quicker * share * (wanted - state), wanted)
        command: Floats = np.minimum(np.maximum(eager, bounds[0]), bounds[1])
        return command

    def followed(self, state: Floats, command: Floats, step: float) -> Floats:
        """Return the states after one period under a held command [s]."""
        lag = self._of(command, state)
        left = np.where(lag > 0.0, np.exp(-step / np.where(lag > 0.0, lag, 1.0)), 0.0)
        after: Floats = command + (state - command) * left
        return after

    def _of(self, goal: Floats, state: Floats) -> Floats:
        found: Floats = np.where(np.abs(goal) < np.abs(state), self.fall, self.rise)
        return found
