"""Conversion of fitted parameters to the quantities and units that a report shows."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from seals.arrays import Floats
from seals.sysid.candidates.parameters import Candidate, CandidateSet, Parameter

NORMAL90 = 1.6449
"""Half width of a 90 % interval in standard deviations."""
_LAW = 0.03
"""1-sigma by which real laws differ from those of the library, as a share."""
_MEAN, _REST = float(np.sqrt(2.0 / np.pi)), float(np.sqrt(1.0 - 2.0 / np.pi))
"""Mean and spread of the absolute value of a unit normal variable."""


def own_part(parameter: Parameter, value: float) -> tuple[float, float]:
    """Separate a fitted value into effect and tolerance; return the effect's value and its 1-sigma.

    The vehicle's own share of the same quantity is of zero mean, unless it can only add, as
    friction and latency do: then it is the absolute value of a normal variable.

    Args:
        parameter: with its tolerance and bounds.
        value: effect and tolerance together.
    """
    if parameter.bounds[0] == 0.0 or parameter.adds:
        return max(value - _MEAN * parameter.tolerance, 0.0), _REST * parameter.tolerance
    return value, parameter.tolerance


def reported_values(
    candidate: Candidate, candidate_set: CandidateSet, values: Mapping[str, float], rates: Floats
) -> tuple[dict[str, float], dict[str, float]]:
    """Return a candidate's parameters as reported, and their 1-sigma.

    Args:
        candidate: effect in one variant.
        candidate_set: it comes from.
        values: fitted changes by key.
        rates: of the joints along the trajectory [rad/s], shape (T, J).

    Returns:
        Values by key, and the 1-sigma by key of what belongs to the vehicle's own tolerance.
    """
    own = {k: own_part(candidate_set.parameters[k], float(values[k])) for k in candidate.keys}
    out = {k: v for k, (v, _) in own.items()}
    stem, known = candidate.instance, candidate_set.parameters
    law = candidate_set.effects.get(stem)
    if law is not None:
        named = {known[k].parameter: v for k, v in out.items()}
        moved = {known[k].parameter: v for k, v in values.items() if k.startswith(f"{stem}.")}
        stated = law.as_stated(named, moved | named, rates)
        out = {k: stated[known[k].parameter] for k in out}
    return out, {k: s for k, (_, s) in own.items()}


def with_interval(value: float, spread: float, unit: str) -> dict[str, float | str]:
    """Return a value with its 90 % interval, widened by the model error of the law.

    Args:
        value: estimate.
        spread: its 1-sigma.
        unit: of both.

    Example:
        >>> with_interval(2.0, 0.0, "kg")["low90"]
        1.901306
    """
    half = NORMAL90 * float(np.hypot(spread, _LAW * value))
    return {
        "value": float(value),
        "low90": float(value - half),
        "high90": float(value + half),
        "unit": unit,
    }


def at_bound(interval: Mapping[str, float | str]) -> dict[str, float | str]:
    """Return mean and 90 % interval of a number that lies at or above an estimate at its bound.

    Equation:
        that of bound + s abs(z), z a unit normal variable: mean sqrt(2 / pi) s.

    Args:
        interval: symmetric one about the bound.

    Example:
        >>> found = at_bound(with_interval(0.0, 1.0, "N"))
        >>> [round(found[k], 3) for k in ("value", "low90", "high90")]
        [0.798, 0.063, 1.96]
    """
    bound, spread = float(interval["value"]), deviation(interval)
    parts = (("value", _MEAN), ("low90", 0.062707), ("high90", 1.959964))
    return {**interval, **{name: bound + spread * size for name, size in parts}}


def deviation(interval: Mapping[str, float | str]) -> float:
    """Return the 1-sigma of a reported 90 % interval.

    Example:
        >>> round(deviation(with_interval(0.0, 0.3, "N")), 6)
        0.3
    """
    return abs(float(interval["high90"]) - float(interval["low90"])) / (2.0 * NORMAL90)
