"""Innovations of residuals: each less its prediction from the preceding one.

Slow faults, such as a battery that sags, fill an error with samples that repeat each other. The
likelihood of such an error is that of its innovations e(t) = r(t) - rho r(t - 1): they
decide between fast effects that a slow fault hides.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from seals.arrays import Floats

Residuals = Mapping[str, Floats]
"""Errors of one run, channel to shape (rows, k); NaN where nothing was measured."""
_FEWEST = 8
"""Innovations below which a run says nothing."""


def autocorrelation(runs: Sequence[Residuals]) -> dict[str, float]:
    """Lag-one autocorrelation of the residuals, by channel, over all runs.

    Example:
        >>> autocorrelation([{"depth": np.array([[8.0], [4.0], [2.0], [1.0]])}])
        {'depth': 0.5}
    """
    out = {}
    for channel in dict.fromkeys(c for run in runs for c in run):
        pairs = [_pairs(run[channel]) for run in runs if channel in run]
        before = np.concatenate([p[0] for p in pairs])
        after = np.concatenate([p[1] for p in pairs])
        power = float(before @ before)
        out[channel] = float(np.clip(before @ after / power, 0.0, 1.0)) if power > 0.0 else 0.0
    return out


def innovations(run: Residuals, rho: Mapping[str, float]) -> dict[str, Floats]:
    """Compute the innovations by channel, shape (rows - 1, k).

    Example:
        >>> innovations({"depth": np.array([[8.0], [4.0], [3.0]])}, {"depth": 0.5})["depth"].T
        array([[0., 1.]])
    """
    return {c: r[1:] - rho[c] * r[:-1] for c, r in run.items()}


def gain(better: Residuals, worse: Residuals, rho: Mapping[str, float]) -> float:
    """Log ratio of the innovations of two models over one run, averaged over its channels.

    NaN where a run is too short to say.
    """
    new, old = innovations(better, rho), innovations(worse, rho)
    logs = []
    for channel in new:
        both = np.isfinite(new[channel]) & np.isfinite(old[channel])
        if both.sum() < _FEWEST:
            continue
        a, b = (float(np.mean(x[channel][both] ** 2)) for x in (new, old))
        if a > 0.0 and b > 0.0:
            logs.append(0.5 * float(np.log(b / a)))
    return float(np.mean(logs)) if logs else float("nan")


def _pairs(errors: Floats) -> tuple[Floats, Floats]:
    """Pairs of consecutive errors, both measured."""
    before, after = errors[:-1].ravel(), errors[1:].ravel()
    both = np.isfinite(before) & np.isfinite(after)
    return before[both], after[both]
