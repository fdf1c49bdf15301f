"""Construction of a plug-in from a composed configuration node, with checks."""

from __future__ import annotations

import dataclasses
import functools
import types
import typing
from collections.abc import Mapping
from typing import Any, TypeVar, cast

from seals import registry
from seals.config.checks import refuse_unknown
from seals.config.derive import schema_of
from seals.config.refusal import refusals
from seals.errors import ConfigError, SealsError, refuse_unlisted, suggestion
from seals.registry import get
from seals.schema import check_fields

T = TypeVar("T")


def build(node: Any, *, where: str) -> Any:
    """Construct the plug-in that a configuration node describes.

    Args:
        node: a composed node with ``_target_``, for instance ``cfg.effects.hull``.
        where: its full key, for instance ``effects.hull``; every refusal names it.

    Returns:
        An instance of the plug-in's dataclass, its values checked against their bounds.

    Raises:
        ConfigError: a value is missing, unknown, not finite or out of bounds.
    """
    from hydra.utils import instantiate

    with refusals(()):
        _refuse_untyped(node, where)
        maker: functools.partial[Any] = instantiate(node, _partial_=True, _convert_="object")
    cls: Any = maker.func
    values = _converted(cls, dict(maker.keywords), where)
    check_fields(cls, values, where=where)
    try:
        return cls(**values)
    except SealsError:
        raise
    except (TypeError, ValueError) as cause:
        fields = suggestion("", [field.name for field in dataclasses.fields(cls)])
        raise ConfigError(f"{where} cannot be built: {cause}.\n{fields}") from cause


def build_from_values(
    kind: str, plugin: str, values: Mapping[str, Any], more: Mapping[str, Any], *, where: str
) -> Any:
    """Construct an installed plug-in from plain values instead of a composed node.

    Args:
        kind: of plug-in.
        plugin: its name.
        values: by field, such as those of a robot folder.
        more: values that override them.
        where: full key, named in every refusal.

    Raises:
        SealsError: it is not installed, or a value cannot be used.
    """
    from omegaconf import OmegaConf

    schema = schema_of(get(kind, plugin))
    with refusals(()):
        node = OmegaConf.merge(
            OmegaConf.structured(schema),
            OmegaConf.create(dict(values)),
            OmegaConf.create(dict(more)),
        )
    return build(node, where=where)


def _refuse_untyped(node: Any, where: str) -> None:
    """Refuse nodes without a plug-in, and keys that its schema does not have."""
    from omegaconf import DictConfig, OmegaConf

    if not isinstance(node, DictConfig) or node.get("_target_") is None:
        name = where.rpartition(".")[2]
        meant = name if name in registry.names("effect") else "quadratic_drag"
        raise ConfigError(
            f"{where} names no plug-in.\n"
            f"Choose one by its group, for instance: +effect@{where}={meant}"
        )
    schema = OmegaConf.get_type(node)
    if not (schema and dataclasses.is_dataclass(schema)):
        raise ConfigError(
            f"{where} has a _target_ but no plug-in's schema behind it.\n"
            f"Choose a plug-in by its group, for instance: +effect@{where}=quadratic_drag"
        )
    refuse_unknown(node, where=where, made=True)


def _converted(cls: type, values: dict[str, Any], where: str) -> dict[str, Any]:
    """Convert lists of the configuration to tuples, and what they hold to numbers, as annotated."""
    hints = typing.get_type_hints(cls)
    for name, value in values.items():
        if isinstance(value, list | dict):
            values[name] = _as_annotated(hints.get(name), value, f"{where}.{name}")
        arguments = typing.get_args(hints.get(name))
        if typing.get_origin(hints.get(name)) is not tuple or not isinstance(value, list):
            continue
        if Ellipsis not in arguments and len(arguments) != len(value):
            raise ConfigError(
                f"{where}.{name}={value} has {len(value)} entries.\n"
                f"Allowed: {len(arguments)} entries."
            )
        values[name] = tuple(value)
    return values


def _as_annotated(hint: Any, value: Any, where: str, depth: int = 0) -> Any:
    """Numbers of nested lists and mappings; whole ones are numbers, too."""
    if hint is float and depth > 1:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ConfigError(f"{where}: '{value}' is no number.\nAllowed: numbers in brackets")
        return float(value)
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType) and value is not None:
        inner = [argument for argument in arguments if argument is not type(None)]
        return _as_annotated(inner[0], value, where, depth) if len(inner) == 1 else value
    if origin is list and isinstance(value, list):
        rows = enumerate(value)
        return [_as_annotated(arguments[0], row, f"{where}[{k}]", depth + 1) for k, row in rows]
    if origin is dict and isinstance(value, dict):
        items = value.items()
        return {k: _as_annotated(arguments[1], v, f"{where}.{k}", depth + 1) for k, v in items}
    return value


def typed_entries(cls: type[T], node: Any, *, where: str) -> dict[str, T]:
    """Return the entries of a mapping as settings of one class.

    A mapping of a typed class would not let ``+objects.cube.robot=ball`` in.

    Args:
        cls: dataclass of the settings.
        node: mapping of names to mappings, or None.
        where: its full key, named in every refusal.

    Raises:
        ConfigError: an entry holds an unknown key or a value of another type.
    """
    from omegaconf import OmegaConf

    raw = OmegaConf.to_container(node) if OmegaConf.is_config(node) else node
    allowed = [field.name for field in dataclasses.fields(cast(Any, cls))]
    found = {}
    for name, entry in _mapping(raw, where).items():
        place = f"{where}.{name}"
        if isinstance(entry, cls):
            found[str(name)] = entry
            continue
        for key in _mapping(entry, place):
            refuse_unlisted(str(key), allowed, f"{place}.{key}: '{key}' is not a key of {place}")
        with refusals(()):
            node = OmegaConf.merge(OmegaConf.structured(cls), OmegaConf.create(entry))
            found[str(name)] = cast(T, OmegaConf.to_object(node))
    return found


def _mapping(raw: Any, where: str) -> dict[Any, Any]:
    if raw is None:
        return {}
    if not isinstance(raw, dict):
        raise ConfigError(
            f"{where}={raw} is a {type(raw).__name__}.\nAllowed: a mapping of names to values."
        )
    return raw
