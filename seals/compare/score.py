"""Scores of a comparison: root mean square error, also in units of the noise floor.

They are split by channel, regime and horizon.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from seals.arrays import Floats
from seals.compare.case import Case, Regime
from seals.compare.predict import residuals
from seals.logs.channels import unit_of


@dataclass(frozen=True, kw_only=True)
class Score:
    """Misfit of some samples.

    Args:
        rms: root mean square of the residual, in the unit of the channel.
        ratio: root mean square of the residual divided by the noise floor [1].
        samples: number of samples.
    """

    rms: float
    ratio: float
    samples: int


@dataclass(frozen=True, kw_only=True)
class CaseScore:
    """Misfit of one case.

    Args:
        name: of the case.
        held_out: whether it only judged.
        channels: by channel.
        regimes: by regime, all channels whitened together.
        total: all channels together, as a multiple of the noise floor.
    """

    name: str
    held_out: bool
    channels: dict[str, Score]
    regimes: dict[str, float]
    total: float


def unit_words(channel: str) -> str:
    """Return the unit of a channel's errors; empty for none."""
    return "rad" if channel == "orientation" else unit_of(channel) or ""


def score_case(case: Case, predicted: dict[str, Floats]) -> CaseScore:
    """Return the misfit of one case."""
    parts = residuals(case, predicted)
    whitened = {c: r / case.sigma[c] for c, r in parts.items()}
    channels = {c: _score(parts[c], whitened[c]) for c in parts}
    regimes = {}
    for regime in Regime:
        rows = case.regime == regime
        if rows.any():
            squares = np.concatenate(
                [np.square(w[rows][np.isfinite(w[rows])]) for w in whitened.values()]
            )
            if squares.size:
                regimes[regime.name] = float(np.sqrt(squares.mean()))
    total = np.concatenate([np.square(w[np.isfinite(w)]) for w in whitened.values()])
    return CaseScore(
        name=case.name,
        held_out=case.held_out,
        channels=channels,
        regimes=regimes,
        total=float(np.sqrt(total.mean())),
    )


def pooled(scores: Sequence[CaseScore], *, held_out: bool) -> dict[str, Score]:
    """Pool the samples of several cases, channel by channel."""
    chosen = [s for s in scores if s.held_out == held_out]
    out = {}
    for channel in {c for s in chosen for c in s.channels}:
        parts = [s.channels[channel] for s in chosen if channel in s.channels]
        parts = [p for p in parts if p.samples]
        count = sum(p.samples for p in parts)
        if count:
            out[channel] = Score(
                rms=float(np.sqrt(sum(p.rms**2 * p.samples for p in parts) / count)),
                ratio=float(np.sqrt(sum(p.ratio**2 * p.samples for p in parts) / count)),
                samples=count,
            )
    return out


def by_horizon(case: Case, predicted: dict[str, Floats]) -> dict[str, tuple[Floats, Floats]]:
    """Residual against the time since the start.

    Returns:
        Channel to (time at the middle of each bin [s], root mean square in the unit of the
        channel).
    """
    edges = np.linspace(0.0, float(case.time[-1]) + 1e-12, 13)
    out = {}
    for channel, r in residuals(case, predicted).items():
        times, sizes = [], []
        for a, b in pairwise(edges):
            values = r[(case.time >= a) & (case.time < b)]
            values = values[np.isfinite(values)]
            if values.size:
                times.append(0.5 * (a + b))
                sizes.append(float(np.sqrt(np.mean(values**2))))
        out[channel] = (np.array(times), np.array(sizes))
    return out


def _score(residual: Floats, whitened: Floats) -> Score:
    good = np.isfinite(residual)
    if not good.any():
        return Score(rms=float("nan"), ratio=float("nan"), samples=0)
    return Score(
        rms=float(np.sqrt(np.mean(residual[good] ** 2))),
        ratio=float(np.sqrt(np.mean(whitened[good] ** 2))),
        samples=int(good.sum()),
    )
