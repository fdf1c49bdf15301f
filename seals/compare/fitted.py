"""Parameters that a comparison may fit: keys, bounds, and the effects that they set."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from seals.effects.effect import Effect
from seals.errors import ConfigError, refuse_unlisted
from seals.schema import Parameter, parameters_of


@dataclass(frozen=True, kw_only=True)
class FitKey:
    """Number to fit: one parameter, or several axes tied to one value.

    Args:
        key: as written by the user.
        targets: ``"effect.parameter"`` values that it sets, tied together.
        parameter: unit and bounds.
        start: configured value.
    """

    key: str
    targets: tuple[str, ...]
    parameter: Parameter
    start: float

    @property
    def effect(self) -> str:
        """Name of the effect."""
        return self.targets[0].partition(".")[0]


def fit_keys(keys: list[str], effects: Mapping[str, Effect]) -> list[FitKey]:
    """Resolve keys such as ``effects.drag.coefficient_x+coefficient_y``.

    Raises:
        ConfigError: an effect or parameter does not exist, or may not be fitted.
    """
    return [_resolve(key, effects) for key in keys]


_ELSEWHERE = ("robot", "mass", "inertia", "hulls", "actuators")
"""Heads of keys that a comparison does not fit."""


def _resolve(key: str, effects: Mapping[str, Effect]) -> FitKey:
    name, _, rest = key.removeprefix("effects.").partition(".")
    if name in _ELSEWHERE:
        raise ConfigError(
            f"fit: '{key}' is no parameter of an effect, and a comparison fits those alone.\n"
            "Masses, inertia, hulls, actuators: seals calibrate log=FOLDER parameters=[mass]"
        )
    refuse_unlisted(name, effects, f"fit: there is no effect '{name}' in '{key}'")
    known = {n: p for n, p in parameters_of(effects[name]).items() if p.fit}
    tied = rest.split("+")
    for parameter in tied:
        refuse_unlisted(
            parameter,
            known,
            f"fit: effect '{name}' has no parameter '{parameter}' that may be fitted",
        )
    return FitKey(
        key=key,
        targets=tuple(f"{name}.{parameter}" for parameter in tied),
        parameter=known[tied[0]],
        start=float(getattr(effects[name], tied[0])),
    )
