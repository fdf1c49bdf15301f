"""Typed parameters: dataclass fields with unit, bounds, tolerance and source.

The command line's help, the documentation table, the range check and parameter identification all
read the metadata written here.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, cast

from seals.errors import ConfigError

_KEY = "seals.parameter"
_LENGTH = "seals.length"
_SPAN = "seals.span"
_LATER = "seals.later"
LATER = {_LATER: True}
"""Metadata of a field that its class got later: hashes of worlds leave it out at its default, so
that worlds, demonstrations and policies made before keep theirs. `param` takes ``later``."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """Metadata of one physical parameter.

    Args:
        unit: SI unit as text, ``"1"`` for a pure number.
        bounds: lowest and highest admissible value, in ``unit``.
        tolerance: one standard deviation of a nominal value, in ``unit`` or, when ``relative``, as
            a share.
        relative: whether ``tolerance`` is a share of the value.
        source: where the default or the law comes from; ``"chosen"`` marks a choice.
        fit: whether identification may change it.
    """

    unit: str
    bounds: tuple[float, float]
    tolerance: float
    relative: bool
    source: str
    fit: bool

    @property
    def span(self) -> str:
        """Describe the bounds in words with their unit.

        Example:
            >>> known = {"tolerance": 0.0, "relative": False, "source": "chosen", "fit": False}
            >>> Parameter(unit="m/s", bounds=(0.0, 2.5), **known).span
            'from 0 to 2.5 m/s'
            >>> Parameter(unit="1", bounds=(0.0, 10.0), **known).span
            'from 0 to 10'
        """
        low, high = self.bounds
        return f"from {low:g} to {high:g}" + ("" if self.unit == "1" else f" {self.unit}")


def param(
    default: float,
    unit: str,
    *,
    bounds: tuple[float, float],
    tolerance: float,
    source: str,
    relative: bool = False,
    fit: bool = True,
    later: bool = False,
) -> float:
    """Declare a float field with unit, bounds, tolerance and source.

    Args:
        default: value, in ``unit``.
        unit: see `Parameter`, as for all others but ``later``.
        bounds: lowest and highest admissible value.
        tolerance: one standard deviation.
        source: where the default or the law comes from.
        relative: whether ``tolerance`` is a share of the value.
        fit: whether identification may change it.
        later: whether the class got this field later, see `LATER`.

    Raises:
        ConfigError: the bounds are empty, or exclude the default.

    Example:
        >>> from dataclasses import dataclass
        >>> @dataclass(kw_only=True)
        ... class Spring:
        ...     stiffness: float = param(
        ...         5.0, "N/m", bounds=(0.0, 1e6), tolerance=0.05, relative=True, source="chosen"
        ...     )
        >>> parameters_of(Spring)["stiffness"].unit
        'N/m'
    """
    low, high = bounds
    if not low < high or not low <= default <= high:
        raise ConfigError(f"bounds {bounds} must be increasing and contain the default {default}.")
    meta = Parameter(
        unit=unit, bounds=bounds, tolerance=tolerance, relative=relative, source=source, fit=fit
    )
    field: float = dataclasses.field(
        default=default, metadata={_KEY: meta, **(LATER if later else {})}
    )
    return field


def setting(
    default: float, unit: str, *, bounds: tuple[float, float], source: str, later: bool = False
) -> float:
    """Declare a float field that somebody chose: exact, and no fit changes it.

    Args:
        default: value, in ``unit``.
        unit: SI unit as text.
        bounds: lowest and highest admissible value.
        source: why this value.
        later: whether the class got this field later, see `LATER`.

    Raises:
        ConfigError: the bounds are empty, or exclude the default.
    """
    return param(default, unit, bounds=bounds, tolerance=0.0, source=source, fit=False, later=later)


def count(default: int, *, bounds: tuple[int, int]) -> int:
    """Declare a whole number, which no fit changes: of iterations, threads, waves, pixels.

    What it counts takes time and memory: a configuration comes from a stranger, too.

    Args:
        default: value.
        bounds: lowest and highest admissible value.
    """
    field: int = dataclasses.field(default=default, metadata={_SPAN: bounds})
    return field


def later_defaults(plugin: type) -> dict[str, Any]:
    """Return the defaults of the fields that a class got later, by name; see `LATER`.

    Example:
        >>> @dataclass(kw_only=True)
        ... class Spring:
        ...     kind: str = dataclasses.field(default="linear", metadata=LATER)
        >>> later_defaults(Spring)
        {'kind': 'linear'}
    """
    late = (f for f in dataclasses.fields(cast(Any, plugin)) if _LATER in f.metadata)
    missing = dataclasses.MISSING
    return {
        f.name: f.default if f.default_factory is missing else f.default_factory() for f in late
    }


def parameters_of(plugin: type | object) -> dict[str, Parameter]:
    """Return the physical parameters of a plug-in class or object, by field name, in order."""
    return dict(_declared(plugin if isinstance(plugin, type) else type(plugin)))


@functools.cache
def _declared(plugin: type) -> Mapping[str, Parameter]:
    fields = dataclasses.fields(cast(Any, plugin))
    return {f.name: f.metadata[_KEY] for f in fields if _KEY in f.metadata}


def check_value(key: str, value: Any, meta: Parameter) -> None:
    """Refuse one parameter value that is not a finite number within its bounds."""
    low, high = meta.bounds
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not math.isfinite(value) or not low <= value <= high:
        raise ConfigError(
            f"{key}={value} is not allowed.\n"
            f"Allowed: a finite number {meta.span} (default source: {meta.source})"
        )


def vector_groups(names: Mapping[str, Any]) -> dict[str, tuple[str, str, str]]:
    """Group names of the form ``stem_x, stem_y, stem_z`` by stem.

    Example:
        >>> vector_groups({"drag_x": 0, "drag_y": 0, "drag_z": 0, "area": 0})
        {'drag': ('drag_x', 'drag_y', 'drag_z')}
    """
    stems = [name[:-2] for name in names if name.endswith("_x")]
    return {
        stem: (f"{stem}_x", f"{stem}_y", f"{stem}_z")
        for stem in stems
        if f"{stem}_y" in names and f"{stem}_z" in names
    }


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


def named(unit: str, *, bounds: tuple[float, float], source: str) -> dict[str, float]:
    """Declare a mapping from names to chosen floats, empty by default; see `LATER`.

    Args:
        unit: SI unit as text.
        bounds: lowest and highest admissible value of each.
        source: where the law or the choice comes from.
    """
    meta = _metadata(bounds[0], unit, bounds=bounds, tolerance=0.0, source=source)
    field: dict[str, float] = dataclasses.field(default_factory=dict, metadata=meta | LATER)
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
    elif isinstance(thing, dict | list | tuple):
        for key, item in _items(thing, where):
            check_tree(item, where=key)


def check_fields(cls: type, values: dict[str, Any], *, where: str) -> None:
    """Check field values of a dataclass, before or after construction."""
    declared = parameters_of(cls)
    fields = {field.name: field for field in dataclasses.fields(cast(Any, cls))}
    for name, value in values.items():
        key = f"{where}.{name}" if where else name
        length = fields[name].metadata.get(_LENGTH) if name in fields else None
        if length is not None and value is not None and len(value) != length:
            raise ConfigError(
                f"{key}={value} has {len(value)} numbers.\nAllowed: {length} numbers."
            )
        span = fields[name].metadata.get(_SPAN) if name in fields else None
        if span is not None and isinstance(value, int) and not span[0] <= value <= span[1]:
            allowed = "a whole number from {} to {}".format(*span)
            raise ConfigError(f"{key}={value} is not allowed.\nAllowed: {allowed}")
        if name not in declared:
            check_tree(value, where=key)
        elif isinstance(value, list | tuple):
            for index, item in enumerate(value):
                check_value(f"{key}[{index}]", item, declared[name])
        elif isinstance(value, dict):
            for item, number in value.items():
                check_value(f"{key}.{item}", number, declared[name])
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
