"""Sliders: adjustable values of a run and their ranges."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

from seals.errors import ConfigError, suggestion
from seals.schema import Parameter, parameters_of

REACH = 4.0
"""How many times its value a slider goes up to, within the bounds of the parameter [1]."""
MOST = 3
"""Sliders of a run whose user names none."""
STEPS = 400
"""Positions of a slider."""


class Slider(NamedTuple):
    """One value of a run and its range.

    Args:
        key: in the configuration, such as ``effects.drag.coefficient``.
        low: smallest value.
        high: largest value.
        value: at the start.
        unit: of the three, empty when not known.
    """

    key: str
    low: float
    high: float
    value: float
    unit: str

    @property
    def step(self) -> float:
        """Step between two positions: 1, 2 or 5 times a power of ten.

        Example:
            >>> Slider("a", 0.0, 2.0, 1.0, "m").step
            0.005
        """
        least = (self.high - self.low) / STEPS
        power = 10.0 ** math.floor(math.log10(least))
        return float(next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= 0.999 * least))


def sliders_of(config: Any, words: Sequence[str], idle: Collection[str] = ()) -> list[Slider]:
    """Return the sliders of a run.

    Args:
        config: composed configuration of the run.
        words: ``KEY`` or ``KEY:LOW:HIGH``; empty chooses parameters of the run's effects.
        idle: effects that rest in this run, and are not chosen.

    Raises:
        ConfigError: a key is unknown or holds no number, or its range is none.
    """
    return [_named(config, word) for word in words] if words else _chosen(config, idle)


def _named(config: Any, word: str) -> Slider:
    from omegaconf import OmegaConf

    key, _, ends = str(word).partition(":")
    value = _value(config, key)
    parent, _, field = key.rpartition(".")
    meta = _declared(OmegaConf.select(config, parent) if parent else config).get(field)
    unit = "" if meta is None else meta.unit
    if ends:
        low, high = _stated(word, ends)
        if not low <= value <= high:
            raise ConfigError(
                f"sliders: {word} does not include the value of the run, {key}={value:g}.\n"
                "Give a range that includes it, or change the value."
            )
        return Slider(key, low, high, value, unit)
    found = _range(value, meta)
    if found is None:
        raise ConfigError(f"sliders: the range of {key} is not known.\nGive it: {key}:LOW:HIGH")
    return Slider(key, *found, value, unit)


def _value(config: Any, key: str) -> float:
    from omegaconf import OmegaConf
    from omegaconf.errors import OmegaConfBaseException

    try:
        value = OmegaConf.select(config, key, throw_on_missing=True)
    except OmegaConfBaseException:
        value = None
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    known = [s.key for s in _every(config)]
    raise ConfigError(
        f"sliders: {key} is not a numeric setting.\n{suggestion(key, known, label='Numbers')}"
    )


def _stated(word: str, ends: str) -> tuple[float, float]:
    try:
        low, high = (float(part) for part in ends.split(":"))
    except ValueError:
        low = high = math.nan
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise ConfigError(f"sliders: {word} has no range.\nWrite KEY:LOW:HIGH with LOW below HIGH.")
    return low, high


def _chosen(config: Any, idle: Collection[str]) -> list[Slider]:
    """First coefficient of every effect, ordered: drag in water, other drag, others."""
    first: dict[str, Slider] = {}
    for slider in _every(config):
        effect = slider.key.split(".")[1]
        if slider.key.startswith("effects.") and effect not in ("gravity", *idle):
            first.setdefault(effect, slider)

    def rank(slider: Slider) -> tuple[bool, bool]:
        medium = str(config.effects[slider.key.split(".")[1]].get("medium"))
        return "drag" not in slider.key, not medium.endswith("water")

    ranked = sorted(first.values(), key=rank)
    return ranked[:MOST] or [s for s in _every(config) if s.key.startswith("effects.")][:1]


def _every(config: Any) -> list[Slider]:
    """All nonzero coefficients of effects and actuators that a fit may change."""
    found = []
    for section in ("effects", "actuators"):
        for name, node in (config.get(section) or {}).items():
            for field, meta in _declared(node).items():
                value = node.get(field)
                number = isinstance(value, int | float) and not isinstance(value, bool)
                span = _range(float(value), meta) if number and value and meta.fit else None
                if span is not None:
                    key = f"{section}.{name}.{field}"
                    found.append(Slider(key, *span, float(value), meta.unit))
    return found


def _declared(node: Any) -> Mapping[str, Parameter]:
    from omegaconf import OmegaConf

    schema = OmegaConf.get_type(node) if OmegaConf.is_config(node) else None
    if isinstance(schema, type) and dataclasses.is_dataclass(schema):
        return parameters_of(schema)
    return {}


def _range(value: float, meta: Parameter | None) -> tuple[float, float] | None:
    """Ends of a slider: multiples of the value, within the bounds."""
    if meta is None:
        return None
    low, high = meta.bounds
    if value == 0.0:
        return (low, high) if high - low <= 1e3 else None
    far = REACH * value
    ends = (max(low, 0.0), min(high, far)) if value > 0.0 else (max(low, far), min(high, 0.0))
    return ends if ends[0] < ends[1] else None
