"""Construction of a plug-in from a composed configuration node, with checks."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any, TypeVar

from seals import registry
from seals.config.checks import refuse_unknown
from seals.config.derive import schema_of
from seals.config.refusal import refusals
from seals.errors import ConfigError
from seals.registry import get
from seals.schema import read

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
    return read(maker.func, maker.keywords, where=where)


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
            f"{where} has a _target_ without the schema of a plug-in.\n"
            f"Choose a plug-in by its group, for instance: +effect@{where}=quadratic_drag"
        )
    refuse_unknown(node, where=where, made=True)


def typed_entries(cls: type[T], node: Any, *, where: str, lone: str | None = None) -> dict[str, T]:
    """Return the entries of a mapping as settings of one class.

    A mapping of a typed class would not let ``objects.cube.robot=ball`` in.

    Args:
        cls: dataclass of the settings.
        node: mapping of names to mappings, or None.
        where: its full key, named in every refusal.
        lone: field that an entry sets which is a text; None where none may be.

    Raises:
        ConfigError: an entry holds an unknown key or a value of another type.
    """
    from omegaconf import OmegaConf

    raw = OmegaConf.to_container(node) if OmegaConf.is_config(node) else node
    entries: dict[str, Any] = read(dict[str, Any] | None, raw, where=where) or {}
    if lone is not None:
        entries = {k: {lone: e} if isinstance(e, str) else e for k, e in entries.items()}
    return {name: read(cls, entry, where=f"{where}.{name}") for name, entry in entries.items()}
