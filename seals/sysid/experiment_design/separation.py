"""Expected separation of effects by a manoeuvre: the misfit of the best-fitting rival."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from seals.arrays import Floats
from seals.least_squares import bounded_step
from seals.sysid.candidates.parameters import Candidate, Parameter, prior_widths
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.predictors.whitened import Whitened
from seals.sysid.predictors.windows import Windows
from seals.sysid.predictors.windows_fit import WIDE, Fitter

NOTHING = "nothing"
"""Name of the stated model among the rivals of a single effect."""
_POLICY = DecisionPolicy()
_NODES = 24
"""Nodes of the quadrature over the noise."""


@dataclass(frozen=True, kw_only=True)
class Supposed:
    """Effect with assumed parameter values.

    Args:
        candidate: of the library; None for nothing.
        values: changes by parameter key.
    """

    candidate: Candidate | None
    values: Mapping[str, float]

    @property
    def name(self) -> str:
        """Name of the effect."""
        return NOTHING if self.candidate is None else self.candidate.name

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the parameters that the effect frees."""
        return () if self.candidate is None else self.candidate.all_keys


@dataclass(frozen=True, kw_only=True)
class Gram:
    """Inner products of responses and signals, marginalised over start states and gusts.

    It keeps no more of the linearised model than a ranking needs: the model itself is several times
    as large.

    Args:
        parameters: with their priors, by key.
        tolerances: keys of the tolerances.
        windows: of the flight.
        keys: of the responses.
        supposed: whose signals follow the responses.
        outputs: whitened responses and signals of every window, shape (W, n, c).
        table: of every window, shape (W, c, c), c = len(keys) + len(supposed).
    """

    parameters: Mapping[str, Parameter]
    tolerances: tuple[str, ...]
    windows: Windows
    keys: tuple[str, ...]
    supposed: tuple[Supposed, ...]
    outputs: Floats
    table: Floats


@dataclass(frozen=True, kw_only=True)
class Contest:
    """Expected outcome when one effect acts and a rival is fitted.

    Args:
        truth: name of the effect that acts.
        rival: name of the one that is fitted.
        separation: chi-square that the best-fitting rival leaves.
        gap: difference of the scores that the diagnosis would see, on average.
    """

    truth: str
    rival: str
    separation: float
    gap: float

    def odds(self, deviate: Floats) -> Floats:
        """Odds of the rival against the truth at a deviation of the noise in sigmas."""
        asked = _POLICY.evidence if self.rival == NOTHING else 0.0
        gap = self.gap - asked + 2.0 * np.sqrt(max(self.separation, 0.0)) * deviate
        odds: Floats = np.exp(-np.clip(gap / _POLICY.temperature, -50.0, 50.0))
        return odds


def gram_of(fitter: Fitter, supposed: Sequence[Supposed], base: Mapping[str, float]) -> Gram:
    """Linearise the assumed effects along a flight.

    Args:
        fitter: of the stated model along the flight.
        supposed: effects at their sizes.
        base: changes that are known to be there, such as a known load.
    """
    candidate_set = fitter.candidate_set
    extra: list[str] = []
    parts = [fitter.fixed]
    zero = fitter.misfit(base).outputs
    signals = []
    for one in supposed:
        values = {**base, **{k: v + base.get(k, 0.0) for k, v in one.values.items()}}
        fresh = [k for k in one.keys if k not in candidate_set.tolerances and k not in extra]
        if fresh:
            parts.append(fitter.whitened(fresh, values))
            extra += fresh
        signals.append(zero - fitter.misfit(values).outputs)
    parts.append(fitter.windows.whiten(np.concatenate(signals, axis=2)))
    both = reduce(Whitened.beside, parts)
    keys = (*fitter.tolerances, *extra)
    return Gram(
        parameters=candidate_set.parameters,
        tolerances=fitter.tolerances,
        windows=fitter.windows,
        keys=keys,
        supposed=tuple(supposed),
        outputs=both.outputs,
        table=both.product(both),
    )


def expected_odds(gram: Gram, table: Floats, truth: int, rival: int) -> Contest:
    """Return the odds expected when one effect is true and another one is fitted.

    Args:
        gram: keys and priors.
        table: inner products summed over the windows of a manoeuvre.
        truth: index of the effect that acts.
        rival: index of the effect that is fitted; beyond the last for nothing.
    """
    names = [s.name for s in gram.supposed]
    own, own_price, _ = _fitted(gram, table, truth, truth)
    other, other_price, _ = _fitted(gram, table, truth, rival)
    return Contest(
        truth=names[truth],
        rival=names[rival] if rival < len(names) else NOTHING,
        separation=max(other - own, 0.0),
        gap=other - own - (own_price - other_price),
    )


def _fitted(gram: Gram, table: Floats, truth: int, model: int) -> tuple[float, float, Floats]:
    """Fit one model to the signal of another.

    Returns:
        Cost of the best fit, price of its freedom, and the weights of responses and signals that
        make up what it leaves, shape (c,).
    """
    parameters, tolerances = gram.parameters, gram.tolerances
    one = (
        gram.supposed[model] if model < len(gram.supposed) else Supposed(candidate=None, values={})
    )
    keys = (*tolerances, *(k for k in one.keys if k not in tolerances))
    use = [gram.keys.index(k) for k in keys]
    signal = len(gram.keys)
    precision = 1.0 / prior_widths(parameters, keys, one.keys, WIDE) ** 2
    begin = np.array([float(one.values.get(k, 0.0)) for k in keys])
    bounds = np.array([parameters[k].bounds for k in keys])
    # what is left at the values about which the rival was made linear
    mark = np.zeros(table.shape[0])
    mark[signal + truth] = 1.0
    if model < len(gram.supposed):
        mark[signal + model] -= 1.0
    normal = table[np.ix_(use, use)]
    right, left = table[use] @ mark, float(mark @ table @ mark)
    step = bounded_step(
        normal + np.diag(precision),
        right - precision * begin,
        bounds[:, 0] - begin,
        bounds[:, 1] - begin,
    )
    cost = left - 2.0 * right @ step + step @ normal @ step
    cost += float(np.sum(precision * (begin + step) ** 2))
    widths = prior_widths(parameters, keys, one.keys, 1.0)
    scaled = normal * widths[:, None] * widths[None, :]
    occam_factor = float(np.linalg.slogdet(scaled + np.eye(len(keys)))[1])
    mark[use] -= step
    return max(float(cost), 0.0), occam_factor, mark


def difference(
    gram: Gram, table: Floats, chosen: Floats, pair: tuple[int, int]
) -> dict[str, tuple[float, float]]:
    """Return the misfit of the best-fitting rival by channel.

    Args:
        gram: keys and priors.
        table: inner products summed over the windows of a manoeuvre.
        chosen: those windows, shape (W,).
        pair: indices of truth and rival.

    Returns:
        Root mean square in units of the channel's noise, and the share of the chi-square.
    """
    windows = gram.windows
    _, _, mark = _fitted(gram, table, *pair)
    square = windows.cells(windows.leftover(gram.outputs @ mark))[chosen] ** 2
    seen = windows.weight[chosen] > 0.0
    out = {}
    for name in dict.fromkeys(windows.channel_of):
        use = [i for i, n in enumerate(windows.channel_of) if n == name]
        sum_of = float(square[:, :, use].sum())
        rms = float(np.sqrt(sum_of / max(1, int(seen[:, :, use].sum()))))
        out[name] = (rms, sum_of / max(float(square.sum()), 1e-12))
    return out


def confidence(contests: Sequence[Contest]) -> float:
    """Mean confidence of the diagnosis in the true effect, over the noise.

    Args:
        contests: of one truth against all its rivals.
    """
    nodes, weights = np.polynomial.hermite_e.hermegauss(_NODES)
    odds = np.sum([c.odds(nodes) for c in contests], axis=0)
    return float(np.sum(weights / (1.0 + odds)) / np.sum(weights))


def chance(against_nothing: Contest) -> float:
    """Return the probability that the diagnosis detects the effect."""
    from math import erf, sqrt

    spread = 2.0 * sqrt(max(against_nothing.separation, 1e-9))
    return 0.5 * (1.0 + erf((against_nothing.gap - _POLICY.evidence) / spread / sqrt(2.0)))
