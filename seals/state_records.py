"""Registry of the classes that a stored state may contain.

A stored state is read as data: a name in it is looked up in this registry and nowhere else, nothing
is imported for its sake, and building a registered class runs no code but checks of its values.
"""

from __future__ import annotations

import dataclasses
import difflib
import functools
import types
import typing
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

Record = TypeVar("Record", bound=type)

_CLASSES: dict[str, type] = {}


def state_record(cls: Record) -> Record:
    """Register a class whose instances a checkpoint may contain; used as a decorator.

    Args:
        cls: a ``NamedTuple``, which is rebuilt as a plain tuple of its fields, or a dataclass whose
            ``__post_init__``, if any, does nothing but check values.

    Raises:
        TypeError: it is neither, or has fields that its constructor does not take.

    Example:
        >>> @state_record
        ... class Memory(typing.NamedTuple):
        ...     level: float
        >>> fields_of(Memory(2.0))
        {'level': 2.0}
    """
    named = issubclass(cls, tuple) and hasattr(cls, "_fields")
    plain = dataclasses.is_dataclass(cls) and all(f.init for f in dataclasses.fields(cls))
    if not (named or plain):
        raise TypeError(
            f"{cls.__qualname__} cannot be a record of a state.\n"
            "Allowed: a NamedTuple, or a dataclass whose constructor takes all of its fields."
        )
    _CLASSES[name_of(cls)] = cls
    return cls


def name_of(cls: type) -> str:
    """Return the name under which a class is stored: module and qualified name."""
    return f"{cls.__module__}:{cls.__qualname__}"


def is_record(value: object) -> bool:
    """Return whether a value is of a registered class."""
    return _CLASSES.get(name_of(type(value))) is type(value)


def fields_of(record: Any) -> dict[str, Any]:
    """Return the fields of a record by name."""
    if isinstance(record, tuple):
        return dict(zip(_names(type(record)), record, strict=True))
    return {name: getattr(record, name) for name in _names(type(record))}


def rebuilt(name: str, values: Mapping[str, Any]) -> Any:
    """Return a record of a registered class.

    Raises:
        ValueError: the class is not registered, fields are missing or strange, or a value is not of
            the kind that its field declares.
    """
    # registered classes only: nothing is imported
    cls = _CLASSES.get(name)
    if cls is None:
        near = difflib.get_close_matches(name, _CLASSES, n=1)
        hint = f" (the nearest is '{near[0]}')" if near else ""
        raise ValueError(f"it names '{name[:120]}', which is not a registered record{hint}")
    names = _names(cls)
    if set(values) != set(names):
        odd = sorted(set(values) ^ set(names))
        raise ValueError(f"'{name}' has different fields in this version: {', '.join(odd)[:200]}")
    kinds = _kinds(cls)
    for field in names:
        if field in kinds and not fits(values[field], kinds[field]):
            found = type(values[field]).__name__
            raise ValueError(f"field '{field}' of '{name}' holds a {found}")
    if issubclass(cls, tuple):
        # past any constructor of its own
        return tuple.__new__(cls, [values[field] for field in names])
    return cls(**values)


def fits(value: Any, kind: Any) -> bool:
    """Return whether a value has a declared type; unknown types accept everything.

    Example:
        >>> fits((1.0, 2), tuple[float, ...]), fits("a", float | None), fits(None, float | None)
        (True, False, True)
    """
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        return any(fits(value, one) for one in inner)
    if origin is np.ndarray:
        return isinstance(value, np.ndarray | np.generic)
    if isinstance(origin, type):
        return _container_fits(value, origin, inner)
    if kind in _SCALARS:
        return isinstance(value, _SCALARS[kind])
    return not (isinstance(kind, type) and kind in _CLASSES.values()) or isinstance(value, kind)


def _container_fits(value: Any, origin: type, inner: tuple[Any, ...]) -> bool:
    if issubclass(origin, tuple):
        return isinstance(value, tuple) and (
            all(fits(part, inner[0]) for part in value)
            if len(inner) == 2 and inner[1] is Ellipsis
            else len(value) == len(inner) and all(map(fits, value, inner))
        )
    if issubclass(origin, Mapping):
        return isinstance(value, Mapping) and all(
            fits(k, inner[0]) and fits(v, inner[1]) for k, v in value.items()
        )
    if issubclass(origin, Sequence):
        return isinstance(value, list | tuple) and all(fits(v, inner[0]) for v in value)
    return True


_SCALARS: dict[Any, tuple[type, ...]] = {
    bool: (bool, np.bool_),
    int: (int, np.integer),
    # arrays without axes are what many laws return
    float: (int, float, np.integer, np.floating),
    str: (str,),
    type(None): (type(None),),
    None: (type(None),),
}


def _names(cls: Any) -> tuple[str, ...]:
    if issubclass(cls, tuple):
        return tuple(cls._fields)
    return tuple(field.name for field in dataclasses.fields(cls))


@functools.cache
def _kinds(cls: type) -> Mapping[str, Any]:
    """Return the declared types of the fields; none when they cannot be read."""
    try:
        return typing.get_type_hints(cls)
    except (NameError, TypeError):
        # a name imported for type checking alone
        return {}
