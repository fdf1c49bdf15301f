"""The errors of a reading: scale, bias, drift, white noise, range, quantisation."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats


@dataclass(kw_only=True)
class Noise:
    """Errors of one quantity, in its unit; numbers, or one per component.

    Equation:
        y = x (1 + gain) + bias + d + n, clipped to low and high, rounded to whole steps. n is white
        with the deviation sqrt(sigma^2 + (share x)^2) a reading. d drifts: d' = -d / drift_time
        + white noise, with the deviation ``drift`` in the long run and the correlation
        exp(-t / drift_time). It is solved exactly from reading to reading and starts as in the long
        run.

    Args:
        sigma: standard deviation of the white noise.
        share: standard deviation of white noise that goes with the value [1].
        bias: constant error.
        gain: error of the scale [1].
        drift: standard deviation of the drift.
        drift_time: its time constant [s].
        step: quantisation, 0 for none.
        low: least reading.
        high: largest reading.

    References:
        Gelb 1974, Applied Optimal Estimation, section 2.2 (first-order Gauss-Markov process).

    Example:
        >>> rng = np.random.default_rng(0)
        >>> Noise(bias=0.02, step=0.25).read(np.array([1.2]), None, 0.1, rng)[0]
        array([1.25])
    """

    sigma: float | Floats = 0.0
    share: float = 0.0
    bias: float | Floats = 0.0
    gain: float = 0.0
    drift: float | Floats = 0.0
    drift_time: float = 1.0
    step: float = 0.0
    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self) -> None:
        """Determine which error terms are active."""
        self._drifts, self._noisy = bool(np.any(self.drift)), bool(np.any(self.sigma))
        self._noisy = self._noisy or self.share > 0.0
        self._ends = self.low > -math.inf or self.high < math.inf

    @property
    def spread(self) -> float:
        """Standard deviation of a reading by white noise and quantisation, the largest component.

        What goes with the value is left out.
        """
        return math.hypot(float(np.max(self.sigma)), self.step / math.sqrt(12.0))

    def read(
        self, true: Floats, drift: Floats | None, span: float, rng: np.random.Generator
    ) -> tuple[Floats, Floats | None]:
        """Return the reading and the drift in it.

        Args:
            true: exact values, shape (k,); those that are not numbers stay so.
            drift: at the last reading, shape (k,); None for the first.
            span: time since then [s].
            rng: random state.
        """
        out = true * (1.0 + self.gain) + self.bias
        if self._drifts:
            fresh = self.drift * rng.standard_normal(true.shape)
            if drift is None:
                drift = fresh
            else:
                keep = math.exp(-span / self.drift_time)
                drift = keep * drift + math.sqrt(-math.expm1(-2.0 * span / self.drift_time)) * fresh
            out = out + drift
        if self._noisy:
            sigma = np.hypot(self.sigma, self.share * true) if self.share else self.sigma
            out = out + sigma * rng.standard_normal(true.shape)
        if self._ends:
            out = np.minimum(np.maximum(out, self.low), self.high)
        return (np.rint(out / self.step) * self.step if self.step > 0.0 else out), drift
