"""Mappings of named entries of one type, such as objects and obstacles."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar, cast

from seals.config.refusal import refusals
from seals.errors import ConfigError, suggestion

T = TypeVar("T")


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
    return {
        str(name): _typed(cls, entry, where=f"{where}.{name}")
        for name, entry in _mapping(raw, where).items()
    }


def _typed(cls: type[T], entry: Any, *, where: str) -> T:
    """One entry; values already of the class pass."""
    from omegaconf import OmegaConf

    if isinstance(entry, cls):
        return entry
    allowed = [field.name for field in dataclasses.fields(cast(Any, cls))]
    for key in _mapping(entry, where):
        if key not in allowed:
            raise ConfigError(
                f"{where}.{key}: '{key}' is not a key of {where}.\n{suggestion(str(key), allowed)}"
            )
    with refusals(()):
        node = OmegaConf.merge(OmegaConf.structured(cls), OmegaConf.create(entry))
        return cast(T, OmegaConf.to_object(node))


def _mapping(raw: Any, where: str) -> dict[Any, Any]:
    if raw is None:
        return {}
    if not isinstance(raw, dict):
        raise ConfigError(
            f"{where}={raw} is a {type(raw).__name__}.\nAllowed: a mapping of names to values."
        )
    return raw
