"""Parameter values at which an effect is significant for a body of 1 kg and 0.1 m."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping
from typing import Any

from seals.effects.effect import Effect
from seals.schema import Parameter, parameters_of

# powers of (mass, length, time) of the units that laws of rigid bodies in fluids are written in
_UNITS: dict[str, tuple[int, int, int]] = {
    "1": (0, 0, 0),
    "rad": (0, 0, 0),
    "kg": (1, 0, 0),
    "m": (0, 1, 0),
    "s": (0, 0, 1),
    "N": (1, 1, -2),
    "Hz": (0, 0, -1),
    "J": (1, 2, -2),
    "W": (1, 2, -3),
    "Pa": (1, -1, -2),
}
MASS, LENGTH, TIME = 1.0, 0.1, 1.0
"""Size of the bodies in the checks [kg, m, s]."""
_STATED = {"m/s": 1.0, "m^3": 1e-4}
"""Speed of a flow, and change of a volume of a litre, that matter without ruling the motion."""

LARGE = 50.0
"""Tolerances of a number without unit that are more than enough to matter."""

_SPREAD = (1.0, 1.3, 0.8)


def material_effect(
    cls: type[Effect], values: Mapping[str, Any] | None = None, *, size: float = 1.0, **options: Any
) -> Effect:
    """Build an effect whose parameters are large enough to matter.

    A default that is not zero stays: its author chose it. A zero becomes the natural scale of its
    unit, for instance 1 N s/m, slightly different from axis to axis. A law for which these are no
    good states others in the class attribute ``material``.

    Args:
        cls: class of the effect.
        values: fields given by the caller, which rule.
        size: mass of the body against a kilogramme [1]; forces, masses and volumes shrink with it.
        **options: further fields, such as ``links``.
    """
    chosen = {**cls.material, **(values or {})}
    chosen.update({name: value for name, value in options.items() if name not in chosen})
    for number, (name, meta) in enumerate(parameters_of(cls).items()):
        default = next(f.default for f in dataclasses.fields(cls) if f.name == name)
        if name not in chosen and meta.fit and default == 0.0:
            chosen[name] = _inside(_natural_scale(meta, size=size) * _SPREAD[number % 3], meta)
    return cls(**chosen)


def _natural_scale(meta: Parameter, *, size: float = 1.0) -> float:
    """Return a typical value of a unit for a small body; three tolerances for unknown units.

    Args:
        meta: of the parameter.
        size: mass of the body against a kilogramme [1].

    Example:
        >>> from seals.schema import parameters_of
        >>> meta = Parameter(
        ...     unit="N s^2/m^2",
        ...     bounds=(0.0, 9.0),
        ...     tolerance=0.0,
        ...     relative=False,
        ...     source="",
        ...     fit=True,
        ... )
        >>> round(_natural_scale(meta), 12)
        10.0
    """
    powers = [0.0, 0.0, 0.0]
    sign = 1
    for token in re.findall(r"/|[A-Za-z0-9]+(?:\^-?\d+)?", meta.unit):
        if token == "/":
            sign = -1
            continue
        symbol, _, power = token.partition("^")
        if symbol not in _UNITS:
            low, high = meta.bounds
            return min(3.0 * meta.tolerance or 0.1 * (high - low), 0.5 * (high - low))
        powers = [
            p + sign * int(power or 1) * u for p, u in zip(powers, _UNITS[symbol], strict=True)
        ]
    if powers == [0.0, 0.0, 0.0] and meta.tolerance > 0.0 and not meta.relative:
        return min(1.0, LARGE * meta.tolerance)
    share = size if powers[0] or powers[1] >= 2 else 1.0
    natural: float = math.prod(
        scale**p for scale, p in zip((MASS, LENGTH, TIME), powers, strict=True)
    )
    return share * _STATED.get(meta.unit, natural)


def _inside(value: float, meta: Parameter) -> float:
    """Return the value; if out of bounds, the middle of the bounds or some tolerances."""
    low, high = meta.bounds
    if low <= value <= high:
        return value
    middle = 0.5 * (low + high)
    return middle if middle != 0.0 else min(LARGE * meta.tolerance or high, high)
