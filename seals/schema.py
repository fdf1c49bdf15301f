"""Typed parameters, and the one reader of plain data.

Dataclass fields have unit, bounds, tolerance and source: the command line's help, the documentation
table, the range check and parameter identification all read the metadata written here. A dataclass
is also the format of a file: `read` builds it from plain data, `plain` makes plain data of it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import enum
import functools
import math
import types
import typing
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

from seals.errors import ConfigError, SealsError, printable, refuse_unlisted, suggestion

T = TypeVar("T")

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
        tolerance: one standard deviation of a stated value, in ``unit`` or, when ``relative``, as
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
    return dataclasses.field(default=default, metadata={_KEY: meta, **(LATER if later else {})})


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

    Example:
        >>> from dataclasses import dataclass
        >>> @dataclass(kw_only=True)
        ... class Wheel:
        ...     speed_gain: float = setting(2.5, "1/s", bounds=(0.0, 100.0), source="chosen")
        >>> Wheel().speed_gain
        2.5
    """
    return param(default, unit, bounds=bounds, tolerance=0.0, source=source, fit=False, later=later)


def count(default: int, *, bounds: tuple[int, int]) -> int:
    """Declare a whole number, which no fit changes: of iterations, threads, waves, pixels.

    What it counts takes time and memory: a configuration comes from a stranger, too.

    Args:
        default: value.
        bounds: lowest and highest admissible value.
    """
    return dataclasses.field(default=default, metadata={_SPAN: bounds})


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


def whole_numbers_of(plugin: type) -> dict[str, tuple[int, int]]:
    """Return the bounds of the whole numbers of a class that `count` declares, by field name."""
    fields = dataclasses.fields(cast(Any, plugin))
    return {f.name: f.metadata[_SPAN] for f in fields if _SPAN in f.metadata}


@functools.cache
def _declared(plugin: type) -> Mapping[str, Parameter]:
    fields = dataclasses.fields(cast(Any, plugin))
    return {f.name: f.metadata[_KEY] for f in fields if _KEY in f.metadata}


def check_value(key: str, value: Any, meta: Parameter) -> None:
    """Refuse one parameter value that is not a finite number within its bounds."""
    low, high = meta.bounds
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not math.isfinite(value) or not low <= value <= high:
        source = "" if meta.source == "chosen" else f" (default source: {meta.source})"
        raise ConfigError(
            f"{key}={value} is not allowed.\nAllowed: a finite number {meta.span}{source}"
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
    unit: str,
    *,
    bounds: tuple[float, float],
    tolerance: float = 0.0,
    source: str,
    later: bool = False,
) -> float | None:
    """Declare a physical float that may be absent; the default is None.

    Args:
        unit: SI unit as text.
        bounds: lowest and highest admissible value, in ``unit``.
        tolerance: one standard deviation, in ``unit``.
        source: where the law or the choice comes from.
        later: whether the class got this field later, see `LATER`.
    """
    meta = _metadata(bounds[0], unit, bounds=bounds, tolerance=tolerance, source=source)
    meta |= LATER if later else {}
    return cast("float | None", dataclasses.field(default=None, metadata=meta))


def vector(
    default: tuple[float, ...],
    unit: str,
    *,
    bounds: tuple[float, float],
    tolerance: float = 0.0,
    source: str,
    later: bool = False,
) -> list[float]:
    """Declare a list of physical floats; an empty default leaves the length free.

    Args:
        default: default components, in ``unit``; their number is the only admissible length.
        unit: SI unit as text.
        bounds: lowest and highest admissible value of each component, in ``unit``.
        tolerance: one standard deviation of a component, in ``unit``.
        source: where the law or the choice comes from.
        later: whether the class got this field later, see `LATER`.
    """
    anchor = default[0] if default else bounds[0]
    meta = _metadata(anchor, unit, bounds=bounds, tolerance=tolerance, source=source)
    meta |= {_LENGTH: len(default) or None, **(LATER if later else {})}
    return dataclasses.field(default_factory=lambda: list(default), metadata=meta)


def named(unit: str, *, bounds: tuple[float, float], source: str) -> dict[str, float]:
    """Declare a mapping from names to chosen floats, empty by default; see `LATER`.

    Args:
        unit: SI unit as text.
        bounds: lowest and highest admissible value of each.
        source: where the law or the choice comes from.
    """
    meta = _metadata(bounds[0], unit, bounds=bounds, tolerance=0.0, source=source)
    return dataclasses.field(default_factory=dict, metadata=meta | LATER)


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
    elif isinstance(thing, dict):
        for key, item in thing.items():
            if type(item) not in _SAFE:
                check_tree(item, where=f"{where}.{key}")
    elif isinstance(thing, list | tuple):
        for index, item in enumerate(thing):
            if type(item) not in _SAFE:
                check_tree(item, where=f"{where}[{index}]")


def check_fields(cls: type, values: dict[str, Any], *, where: str) -> None:
    """Check field values of a dataclass, before or after construction."""
    declared = _declared(cls)
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
            if type(value) not in _SAFE:
                check_tree(value, where=key)
        elif isinstance(value, list | tuple):
            for index, item in enumerate(value):
                check_value(f"{key}[{index}]", item, declared[name])
        elif isinstance(value, dict):
            for item, number in value.items():
                check_value(f"{key}.{item}", number, declared[name])
        elif value is not None or fields[name].default is not None:
            check_value(key, value, declared[name])


def check_order(thing: object, low: str, high: str, *, where: str, equal: bool = False) -> None:
    """Refuse two numbers of a dataclass of which the first is not below the second.

    Args:
        thing: that has the fields.
        low: field of the lower number.
        high: field of the higher one.
        where: what the fields belong to, named in the message.
        equal: whether they may be equal.

    Raises:
        ConfigError: they are not in order.

    Example:
        >>> check_order(Within(2.0, 1.0), "low", "high", where="band")
        Traceback (most recent call last):
        seals.errors.ConfigError: band.low=2.0 is not below band.high=1.0.
        Allowed: low below high.
    """
    first, last = getattr(thing, low), getattr(thing, high)
    if not (first < last or (equal and first == last)):
        wrong, right = ("above", "up to") if equal else ("not below", "below")
        raise ConfigError(
            f"{where}.{low}={first} is {wrong} {where}.{high}={last}.\n"
            f"Allowed: {low} {right} {high}."
        )


def vars_of(thing: Any) -> dict[str, Any]:
    """Return the field values of a dataclass instance by name, not copied."""
    return {field.name: getattr(thing, field.name) for field in dataclasses.fields(thing)}


def _metadata(default: float, unit: str, **physics: Any) -> dict[str, Any]:
    field = cast("dataclasses.Field[float]", param(default, unit, fit=False, **physics))
    return dict(field.metadata)


class Within(NamedTuple):
    """Bounds of an annotated number, or of the entries of an annotated list or mapping.

    Args:
        low: lowest value, or fewest entries.
        high: highest value, or most entries.
        above: whether ``low`` itself is not allowed.
    """

    low: float
    high: float
    above: bool = False

    @property
    def words(self) -> str:
        """Describe the bounds of a number in words."""
        low, high = (f"{end:,}" if isinstance(end, int) else f"{end:g}" for end in self[:2])
        if self.high == math.inf:
            return f"a number above {low}" if self.above else f"a number from {low} on"
        return f"{'above' if self.above else 'from'} {low} to {high}"


_WORDS: dict[Any, tuple[str, str]] = {
    bool: ("true or false", "truth values"),
    int: ("a whole number", "whole numbers"),
    float: ("a finite number", "finite numbers"),
    str: ("text", "texts"),
    type(None): ("nothing", "nothing"),
    list: ("a list", "lists"),
}
_MAPPING = ("a mapping of names to values", "mappings of names to values")


@typing.overload
def read(
    kind: type[T], raw: Any, *, where: str, error: type[SealsError] = ..., extra: bool = ...
) -> T: ...
@typing.overload
def read(
    kind: Any, raw: Any, *, where: str, error: type[SealsError] = ..., extra: bool = ...
) -> Any: ...
def read(
    kind: Any,
    raw: Any,
    *,
    where: str,
    error: type[SealsError] = ConfigError,
    extra: bool = False,
) -> Any:
    """Build a typed value from plain data, as YAML, JSON and configurations hold them.

    Whole numbers become floats where the annotation says so, and text that is a number, too
    (YAML takes ``1e-3`` for text). In a dataclass or NamedTuple, null counts as left out where a
    field has a default and does not take None; values are checked by `check_fields`.

    Args:
        kind: annotation: scalars, None, ``Any``, unions, ``Literal``, enumerations by their names,
            lists, tuples, mappings, dataclasses, NamedTuples, nested in any way, and
            ``Annotated[..., Within(low, high)]``. Any other takes every value.
        raw: plain data; instances of ``kind`` stay as they are.
        where: full key, named in every refusal; the name of a file ends in a colon.
        error: class of the refusals.
        extra: whether keys that a dataclass does not know are passed over.

    Raises:
        SealsError: ``error``, which says what was given, and what is allowed.

    Example:
        >>> read(dict[str, float], {"mass": 2}, where="body")
        {'mass': 2.0}
        >>> read(list[float], [1.0, "far"], where="body.position")
        Traceback (most recent call last):
        seals.errors.ConfigError: body.position[1]=far is not allowed.
        Allowed: a finite number
    """
    try:
        return _read(kind, raw, where, extra)
    except ConfigError as cause:
        if error is ConfigError:
            raise
        raise error(str(cause)) from cause


def _read(kind: Any, raw: Any, where: str, extra: bool) -> Any:
    base, inner = typing.get_origin(kind) or kind, typing.get_args(kind)
    found = raw
    if base is typing.Annotated:
        found = _bounded(_read(inner[0], raw, where, extra), inner[1], where)
    elif base in (typing.Union, types.UnionType):
        found = _one_of(inner, raw, where, extra)
    elif base is typing.Literal:
        refuse_unlisted(
            str(raw), [str(one) for one in inner], f"{_given(where, raw)} is not allowed"
        )
    elif base in (bool, int, float, str, type(None)):
        found = _scalar(base, raw, where)
    elif not isinstance(base, type):
        pass
    elif dataclasses.is_dataclass(base) or hasattr(base, "_fields"):
        found = raw if isinstance(raw, base) else _record(base, raw, where, extra)
    elif issubclass(base, enum.Enum) and not isinstance(raw, base):
        refuse_unlisted(str(raw), base.__members__, f"{_given(where, raw)} is not allowed")
        found = base[str(raw)]
    elif issubclass(base, Mapping):
        found = _mapping(inner, raw, where, extra)
    elif issubclass(base, Sequence) or base is Collection:
        found = _sequence(kind, raw, where, extra)
    return found


def _mapping(inner: Sequence[Any], raw: Any, where: str, extra: bool) -> dict[Any, Any]:
    key, value = inner or (Any, Any)
    if not isinstance(raw, Mapping):
        raise _refusal(where, raw, _MAPPING[0])
    given = {str(k) if key is str else k: v for k, v in raw.items()}
    if value is Any:
        return given
    return {k: _read(value, v, _at(where, k), extra) for k, v in given.items()}


def _scalar(kind: type, raw: Any, where: str) -> Any:
    value = raw
    taken = {float: int | str, int: str}.get(kind)
    if taken is not None and isinstance(raw, taken) and not isinstance(raw, bool):
        # a whole number may be longer than a float
        with contextlib.suppress(ValueError, OverflowError):
            value = kind(raw)
    fits = isinstance(value, kind) and (kind is bool or not isinstance(value, bool))
    if not fits or (kind is float and not math.isfinite(value)):
        raise _refusal(where, raw, words(kind))
    return value


def _bounded(value: Any, span: Within, where: str) -> Any:
    many = isinstance(value, list | tuple | dict)
    size = len(value) if many else value
    if value is None or (span.low <= size <= span.high and (size > span.low or not span.above)):
        return value
    if many:
        raise ConfigError(f"{where.rstrip(':')} has {size:,} entries.\nAllowed: {span.words}")
    raise _refusal(where, value, span.words)


def _one_of(kinds: Sequence[Any], raw: Any, where: str, extra: bool) -> Any:
    refusals = []
    for kind in sorted(kinds, key=lambda kind: kind is not type(raw)):
        try:
            return _read(kind, raw, where, extra)
        except ConfigError as cause:
            refusals += [] if kind is type(None) else [cause]
    if len(refusals) == 1:
        raise refusals[0]
    raise _refusal(where, raw, " or ".join(dict.fromkeys(map(words, kinds))))


def _sequence(kind: Any, raw: Any, where: str, extra: bool) -> Any:
    base, inner = typing.get_origin(kind) or kind, typing.get_args(kind)
    if not isinstance(raw, list | tuple):
        raise _refusal(where, raw, words(kind))
    free = base is not tuple or len(inner) < 1 or inner[-1] is Ellipsis
    if not free and len(raw) != len(inner):
        raise ConfigError(
            f"{_given(where, raw)} has {len(raw)} entries.\nAllowed: {len(inner)} entries."
        )
    kinds = [inner[0] if inner else Any] * len(raw) if free else inner
    found = [
        _read(kind, row, f"{where.rstrip(':')}[{k}]", extra)
        for k, (kind, row) in enumerate(zip(kinds, raw, strict=True))
    ]
    return tuple(found) if base is tuple else found


def _record(cls: Any, raw: Any, where: str, extra: bool) -> Any:
    hints, needed = _form(cls)
    given = _mapping((str, Any), raw, where, extra)
    place = where.rstrip(":")
    for key in () if extra else [key for key in given if key not in hints]:
        refuse_unlisted(key, hints, f"{place}: '{key}' is not allowed here")
    values = {}
    for name, hint in hints.items():
        value = given.get(name)
        empty = value is None and hint is not Any and type(None) not in typing.get_args(hint)
        if name not in needed and (name not in given or empty):
            continue
        refuse_unlisted(name, given, f"{place} has no '{name}'", label="Given")
        values[name] = _read(hint, value, _at(where, name), extra)
    if dataclasses.is_dataclass(cls):
        check_fields(cast(Any, cls), values, where=where)
    try:
        return cls(**values)
    except SealsError:
        raise
    except (TypeError, ValueError) as cause:
        raise ConfigError(f"{place} cannot be built: {cause}.\n{suggestion('', hints)}") from cause


@functools.cache
def _form(cls: Any) -> tuple[Mapping[str, Any], frozenset[str]]:
    """Return the annotations of the fields that a constructor takes, and which ones it needs."""
    hints = typing.get_type_hints(cls, include_extras=True)
    if not dataclasses.is_dataclass(cls):
        names = cls._fields
        return {n: hints[n] for n in names}, frozenset(names) - set(cls._field_defaults)
    fields = [field for field in dataclasses.fields(cls) if field.init]
    missing = dataclasses.MISSING
    needed = [f.name for f in fields if f.default is missing and f.default_factory is missing]
    return {field.name: hints[field.name] for field in fields}, frozenset(needed)


def words(kind: Any, many: bool = False) -> str:
    """Return the values that an annotation allows, in words.

    Args:
        kind: annotation, see `read`.
        many: whether in the plural.

    Example:
        >>> words(list[float]), words(typing.Annotated[float, Within(0.0, math.inf, above=True)])
        ('a list of finite numbers', 'a number above 0')
    """
    base, inner = typing.get_origin(kind) or kind, typing.get_args(kind)
    if base is typing.Annotated:
        scalar = inner[0] in (int, float) and not many
        return inner[1].words if scalar else words(inner[0], many)
    if isinstance(base, type) and issubclass(base, Sequence) and inner:
        fixed = base is tuple and inner[-1] is not Ellipsis
        lists = "lists of " if many else "" if fixed else "a list of "
        return f"{lists}{f'{len(inner)} ' if fixed else ''}{words(inner[0], True)}"
    return _WORDS.get(base, _MAPPING)[many]


def _at(where: str, name: Any) -> str:
    return f"{where}{' ' if where.endswith(':') else '.'}{name}" if where else str(name)


def _given(where: str, raw: Any) -> str:
    sign = "" if not where else " " if where.endswith(":") else "="
    return f"{where}{sign}{printable(f'{raw!s:.60}')}"


def _refusal(where: str, raw: Any, allowed: str) -> ConfigError:
    return ConfigError(f"{_given(where, raw)} is not allowed.\nAllowed: {allowed}")


_SAFE = frozenset({int, str, bool, type(None)})
"""Types of values that are never out of bounds."""
_PLAIN = _SAFE | {float}
"""Types of nearly all that is written."""


def plain(value: Any) -> Any:
    """Return plain data of a value: `read` backwards, for YAML and JSON.

    Dataclasses and NamedTuples become mappings, enumerations their names, paths text; sets, tuples
    and arrays become lists, NumPy scalars numbers.

    Example:
        >>> import numpy as np
        >>> plain({"mass": np.float64(1.5), "axis": np.array([0, 1]), "file": Path("a")})
        {'mass': 1.5, 'axis': [0, 1], 'file': 'a'}
        >>> plain(Within(0, 1))
        {'low': 0, 'high': 1, 'above': False}
    """
    if type(value) in _PLAIN:
        return value
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = vars_of(value)
    elif hasattr(value, "_asdict"):
        value = value._asdict()
    elif hasattr(value, "tolist"):
        value = value.tolist()
    elif isinstance(value, set | frozenset):
        value = sorted(plain(child) for child in value)
    if isinstance(value, Mapping):
        return {str(key): plain(child) for key, child in value.items()}
    if isinstance(value, list | tuple):
        return [plain(child) for child in value]
    if isinstance(value, enum.Enum):
        return value.name
    return str(value) if isinstance(value, Path) else value
