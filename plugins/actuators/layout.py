"""Validation of an actuator's lists and conversion to arrays, one row or number per drive."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError


def numbers(
    key: str, values: Sequence[float], count: int, *, sign: str = "any", what: str = "drive"
) -> Floats:
    """Return one number per drive, shape (count,); a single number applies to all.

    Args:
        key: full name, for the refusal.
        values: as given.
        count: number of drives.
        sign: ``any``, ``positive`` or ``not negative``.
        what: the numbers belong to, for the refusal.

    Raises:
        ConfigError: another length, a number that is not finite or of the wrong sign.

    Example:
        >>> numbers("rotors.radius", [0.1], 2)
        array([0.1, 0.1])
    """
    array = np.asarray(values, dtype=float)
    if array.shape not in ((1,), (count,)):
        raise ConfigError(
            f"{key}={list(values)} has {len(values)} numbers.\n"
            f"Allowed: {count}, one per {what}, or one number for all."
        )
    wrong = {"positive": array <= 0.0, "not negative": array < 0.0}.get(sign, ~np.isfinite(array))
    if not np.all(np.isfinite(array)) or np.any(wrong):
        words = "finite" if sign == "any" else f"finite and {sign}"
        raise ConfigError(f"{key}={list(values)} is not allowed.\nAllowed: numbers {words}.")
    return np.array(np.broadcast_to(array, (count,)))


def vectors(key: str, values: Sequence[Sequence[float]], count: int) -> Floats:
    """Return one vector per drive, shape (count, 3); a single vector applies to all.

    Raises:
        ConfigError: there is none, another number of rows, or a row is not three finite numbers.

    Example:
        >>> vectors("rotors.axis", [[0, 0, 1]], 2).shape
        (2, 3)
    """
    rows = [list(row) for row in values]
    if not rows or len(rows) not in (1, count) or any(len(row) != 3 for row in rows):
        raise ConfigError(
            f"{key}={rows} is not allowed.\n"
            f"Allowed: rows of three numbers [x, y, z], one for each of {max(count, 1)} drives."
        )
    array = np.asarray(rows, dtype=float)
    if not np.all(np.isfinite(array)):
        raise ConfigError(f"{key}={rows} is not allowed.\nAllowed: finite numbers.")
    return np.array(np.broadcast_to(array, (count, 3)))


def unit_axes(key: str, values: Sequence[Sequence[float]], count: int) -> Floats:
    """Return one unit vector per drive, shape (count, 3); the link's z axis by default.

    Raises:
        ConfigError: as `vectors`, or an axis has no length.

    Example:
        >>> unit_axes("thrusters.axis", [[2, 0, 0]], 1)
        array([[1., 0., 0.]])
    """
    array = vectors(key, values or [[0.0, 0.0, 1.0]], count)
    length = np.sqrt(np.sum(array * array, axis=1, keepdims=True))
    if np.any(length < 1e-9):
        raise ConfigError(
            f"{key}={[list(row) for row in values]} has an axis of no length.\n"
            "Allowed: directions of positive thrust, such as [0, 0, 1]."
        )
    axes: Floats = array / length
    return axes


def check_first(key: str, first: int) -> None:
    """Refuse an index of the first command column that is negative or beyond all drives.

    Raises:
        ConfigError: it is not between 0 and 10,000.
    """
    if not 0 <= first <= 10_000:
        raise ConfigError(
            f"{key}={str(first)[:20]} is not allowed.\nAllowed: 0 to 10,000, the column of a drive."
        )
