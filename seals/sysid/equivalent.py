"""Fitted factors as the catalogue of effects states them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from seals.arrays import Floats
from seals.sysid.factors import Candidate, Factor, Library

ADDING = ("command_delay.delay", "sensor_delay.delay")
"""Factors whose tolerance can only add, although a fit may take off from them: latencies."""
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
    if factor.bounds[0] == 0.0 or factor.key in ADDING:
        return max(value - _MEAN * factor.tolerance, 0.0), _REST * factor.tolerance
    return value, factor.tolerance


def friction_as_catalogued(
    coulomb: float, viscous: float, threshold: float, rates: Floats
) -> tuple[float, float]:
    """Return the Coulomb and viscous parts of the law with a jump at rest.

    Equation:
        least squares over the log of C sign(q') + B q' against
        coulomb tanh(q' / threshold) + viscous q'.

    Args:
        coulomb: [N m].
        viscous: [N m s/rad].
        threshold: rate at which dry friction turns over [rad/s].
        rates: of the joint, q' [rad/s], shape (T,).

    Example:
        >>> friction_as_catalogued(0.1, 0.02, 1e-6, np.array([-0.3, 0.2, 0.5]))
        (0.1, 0.02)
    """
    torque = coulomb * np.tanh(rates / threshold) + viscous * rates
    laws = np.stack((np.sign(rates), rates), axis=1)
    found = np.linalg.lstsq(laws, torque, rcond=None)[0]
    return float(np.round(found[0], 12)), float(np.round(found[1], 12))


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
    if candidate.name == "joint_friction" and rates.shape[1]:
        dry, wet = candidate.keys
        stem = dry.partition(".")[0]
        law = library.effects[stem]
        turn = float(getattr(law, "threshold", 0.0)) + float(values.get(f"{stem}.threshold", 0.0))
        joint = int(candidate.variant["joint"]) - 1
        out[dry], out[wet] = friction_as_catalogued(out[dry], out[wet], turn, rates[:, joint])
    return out, {k: s for k, (_, s) in own.items()}
