"""Derivation of a plug-in's structured config from its own dataclass."""

from __future__ import annotations

import dataclasses
import functools
import types
import typing
from typing import Any, TypeVar

from seals.field_roles import carried
from seals.registry import Plugin

T = TypeVar("T")


def schema_of(plugin: Plugin) -> type:
    """Return the structured config class of an installed plug-in.

    Raises:
        BrokenPlugin: the plug-in cannot be imported, or is not a keyword-only dataclass.
    """
    found = plugin.load()
    if not (isinstance(found, type) and dataclasses.is_dataclass(found)):
        raise plugin.broken(TypeError(f"{plugin.value} is not a dataclass"))
    positional = [
        field.name for field in dataclasses.fields(found) if field.init and not field.kw_only
    ]
    if positional:
        raise plugin.broken(TypeError(f"fields {', '.join(positional)} are not keyword-only"))
    try:
        return derive(found)
    except (NameError, TypeError) as cause:
        raise plugin.broken(cause) from cause


@functools.cache
def derive(cls: type) -> type:
    """Return a new, unfrozen dataclass with the fields of ``cls`` and its path in ``_target_``.

    A frozen class would make the composed node read-only, and ``cls`` itself may compute and refuse
    in ``__post_init__``: the derived class holds data only.

    Example:
        >>> from dataclasses import dataclass
        >>> @dataclass(frozen=True, kw_only=True)
        ... class Spring:
        ...     stiffness: float = 5.0
        >>> derive(Spring)().stiffness
        5.0
    """
    hints = typing.get_type_hints(cls)
    columns: list[tuple[str, Any, Any]] = [
        (field.name, _derived_type(hints[field.name]), _default(field))
        for field in dataclasses.fields(typing.cast(Any, cls))
        if field.init
    ]
    target = f"{cls.__module__}.{cls.__qualname__}"
    columns.append(("_target_", str, dataclasses.field(default=target)))
    return dataclasses.make_dataclass(
        f"{cls.__name__}Config",
        columns,
        kw_only=True,
        namespace={"__doc__": cls.__doc__, "__module__": cls.__module__, **carried(cls)},
    )


def _derived_type(hint: Any, depth: int = 0) -> Any:
    """Replace dataclasses inside a type by their derived ones.

    Numbers of nested lists and mappings are checked when they are built: OmegaConf refuses whole
    numbers in them.
    """
    if hint is float and depth > 1:
        return Any
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        return derive(hint)
    origin = typing.get_origin(hint)
    deeper = depth + 1 if origin in (list, dict) else depth
    arguments = tuple(_derived_type(argument, deeper) for argument in typing.get_args(hint))
    if origin in (typing.Union, types.UnionType):
        return typing.Union[arguments]  # noqa: UP007  built at run time
    if origin in (list, tuple, dict):
        return origin[arguments]
    return hint


def _default(field: dataclasses.Field[Any]) -> Any:
    """Copy a field with its metadata; one without default becomes OmegaConf's mandatory value."""
    factory, default = field.default_factory, field.default
    if factory is not dataclasses.MISSING:
        made: dict[str, Any] = {"default_factory": lambda: _as_config(factory())}
    elif default is dataclasses.MISSING:
        made = {"default": "???"}
    else:
        made = {"default_factory": lambda: _as_config(default)}
    return dataclasses.field(**made, metadata=field.metadata)


def _as_config(value: T) -> Any:
    """Convert default values to types that a structured config may hold."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {
            field.name: _as_config(getattr(value, field.name))
            for field in dataclasses.fields(value)
            if field.init
        }
        return derive(type(value))(**fields)
    if isinstance(value, list | tuple):
        return [_as_config(item) for item in value]
    if isinstance(value, dict):
        return {key: _as_config(item) for key, item in value.items()}
    return value
