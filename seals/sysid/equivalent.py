"""Fitted factors as the catalogue of effects states them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from seals.arrays import Floats
from seals.sysid.factors import Candidate, Factor, Library

_MEAN, _REST = float(np.sqrt(2.0 / np.pi)), float(np.sqrt(1.0 - 2.0 / np.pi))
"""Mean and spread of the absolute value of a unit normal variable."""


def own_part(factor: Factor, value: float) -> tuple[float, float]:
    """Return what of a fitted value is the effect's own, and the 1-sigma of that division.

    The vehicle's own share of the same quantity is of zero mean, unless it can only add, as
    friction and latency do: then it is the absolute value of a normal variable.

    Args:
        factor: with its tolerance and bounds.
        value: effect and tolerance together.
    """
    if factor.bounds[0] == 0.0 or factor.adds:
        return max(value - _MEAN * factor.tolerance, 0.0), _REST * factor.tolerance
    return value, factor.tolerance


def catalogued(
    candidate: Candidate, library: Library, values: Mapping[str, float], rates: Floats
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the values of a candidate's factors as the catalogue means them, and their divisions.

    Args:
        candidate: effect in one variant.
        library: it comes from.
        values: fitted changes by key.
        rates: of the joints along the course [rad/s], shape (T, J).

    Returns:
        Values by key, and the 1-sigma by key of what belongs to the vehicle's own tolerance.
    """
    own = {k: own_part(library.factors[k], float(values[k])) for k in candidate.keys}
    out = {k: v for k, (v, _) in own.items()}
    stem = candidate.keys[0].partition(".")[0]
    law = library.effects.get(stem)
    if law is not None:
        named = {k.partition(".")[2]: v for k, v in out.items()}
        moved = {k.partition(".")[2]: v for k, v in values.items() if k.startswith(f"{stem}.")}
        stated = law.as_stated(named, moved, rates)
        out = {k: stated[k.partition(".")[2]] for k in out}
    return out, {k: s for k, (_, s) in own.items()}
