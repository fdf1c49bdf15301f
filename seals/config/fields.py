"""Parameter fields beyond a single float: optional ones and vectors, with the same metadata."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any, cast

from seals.errors import ConfigError
from seals.schema import check_value, param, parameters_of

_LENGTH = "seals.length"


def optional(
    unit: str, *, bounds: tuple[float, float], tolerance: float = 0.0, source: str
) -> float | None:
    """Declare a physical float that may be absent; the default is None.

    Args:
        unit: SI unit as text.
        bounds: lowest and highest admissible value, in ``unit``.
        tolerance: one standard deviation, in ``unit``.
        source: where the law or the choice comes from.
    """
    meta = _metadata(bounds[0], unit, bounds=bounds, tolerance=tolerance, source=source)
    return cast("float | None", dataclasses.field(default=None, metadata=meta))


def vector(
    default: tuple[float, ...],
    unit: str,
    *,
    bounds: tuple[float, float],
    tolerance: float = 0.0,
    source: str,
) -> list[float]:
    """Declare a list of physical floats; an empty default leaves the length free.

    Args:
        default: default components, in ``unit``; their number is the only admissible length.
        unit: SI unit as text.
        bounds: lowest and highest admissible value of each component, in ``unit``.
        tolerance: one standard deviation of a component, in ``unit``.
        source: where the law or the choice comes from.
    """
    anchor = default[0] if default else bounds[0]
    meta = _metadata(anchor, unit, bounds=bounds, tolerance=tolerance, source=source)
    meta[_LENGTH] = len(default) or None
    field: list[float] = dataclasses.field(default_factory=lambda: list(default), metadata=meta)
    return field


def check_tree(thing: object, *, where: str) -> None:
    """Refuse values not finite or out of bounds, in a dataclass and all those inside it.

    Args:
        thing: a dataclass instance, a container of them, or a plain value.
        where: full config key, named in the message.

    Raises:
        ConfigError: a value is not allowed; the message names the full key.
    """
    if isinstance(thing, float) and not math.isfinite(thing):
        raise ConfigError(f"{where}={thing} is not allowed.\nAllowed: a finite number.")
    if dataclasses.is_dataclass(thing) and not isinstance(thing, type):
        check_fields(type(thing), vars_of(thing), where=where)
    else:
        for key, item in _items(thing, where):
            check_tree(item, where=key)


def check_fields(cls: type, values: dict[str, Any], *, where: str) -> None:
    """Check the values of a dataclass's fields before, or after, it is constructed."""
    declared = parameters_of(cls)
    fields = {field.name: field for field in dataclasses.fields(cast(Any, cls))}
    for name, value in values.items():
        key = f"{where}.{name}" if where else name
        length = fields[name].metadata.get(_LENGTH) if name in fields else None
        if length is not None and value is not None and len(value) != length:
            raise ConfigError(
                f"{key}={value} has {len(value)} numbers.\nAllowed: {length} numbers."
            )
        if name not in declared:
            check_tree(value, where=key)
        elif isinstance(value, list | tuple):
            for index, item in enumerate(value):
                check_value(f"{key}[{index}]", item, declared[name])
        elif value is not None or fields[name].default is not None:
            check_value(key, value, declared[name])


def vars_of(thing: Any) -> dict[str, Any]:
    """Return the field values of a dataclass instance by name, not copied."""
    return {field.name: getattr(thing, field.name) for field in dataclasses.fields(thing)}


def _items(thing: object, where: str) -> Iterator[tuple[str, object]]:
    if isinstance(thing, dict):
        yield from ((f"{where}.{key}", item) for key, item in thing.items())
    elif isinstance(thing, list | tuple):
        yield from ((f"{where}[{index}]", item) for index, item in enumerate(thing))


def _metadata(default: float, unit: str, **physics: Any) -> dict[str, Any]:
    field = cast("dataclasses.Field[float]", param(default, unit, fit=False, **physics))
    return dict(field.metadata)
