"""Tempering: a model that is far off is fitted with the tolerances held as much tighter.

Readings that a model misses by many times their noise say nothing about numbers known to a per
cent. At full weight they move these by a thousand tolerances, which then stand in for the missing
effect, and the fit goes on from there. So their priors count as many times more as the misfit is
above its floor (annealing of the likelihood, with a temperature that the fit itself sets).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from seals.sysid.predictors.normal_equations import Fit

_FAR_OFF = 10.0
"""Misfit in noise floors above which a model is far off."""
_ROUNDS = 4
"""Temperatures at most."""


def temperature(misfit: float, observed: float) -> float:
    """Return the misfit in noise floors where a model is far off, else 1.

    Args:
        misfit: sum over all windows [chi2].
        observed: numbers that were read.

    Example:
        >>> temperature(5e5, 1e3), temperature(5e3, 1e3)
        (500.0, 1.0)
    """
    floors = misfit / max(observed, 1.0)
    return floors if _FAR_OFF < floors < np.inf else 1.0


def tempered(fit: Fit, factor: float) -> Fit:
    """Return the same point with priors of tolerances that count more.

    Args:
        fit: at its values.
        factor: on the prior precision of all keys that are not free.
    """
    precision = fit.precision * np.array([1.0 if k in fit.free else factor for k in fit.keys])
    penalty = float(np.sum(precision * (fit.at - fit.centre) ** 2))
    cost = fit.cost - fit.penalty + penalty
    return replace(fit, precision=precision, penalty=penalty, cost=cost)


def approached(now: Fit, observed: float, descend: Callable[[Fit, Sequence[str]], Fit]) -> Fit:
    """Lower the cost of a model that is far off at falling temperatures.

    Args:
        now: where the fit starts.
        observed: numbers that were read.
        descend: minimises the cost of a fit over some of its keys.

    Returns:
        A fit of no higher cost with the priors of `now`; itself where the model is not far off.
    """
    for _ in range(_ROUNDS):
        factor = temperature(float(now.misfit.sum()), observed)
        if factor == 1.0:
            break
        hot = descend(descend(tempered(now, factor), now.free), now.keys)
        found, before = tempered(replace(hot, precision=now.precision), 1.0), now.cost
        if not found.cost < before:
            break
        now = found
        if found.cost > 0.5 * before:
            break
    return now
