"""Refusal of unknown keys added by ``+``, and of keys without a value."""

from __future__ import annotations

import dataclasses
from typing import Any

from seals.errors import ConfigError, suggestion


def refuse_unknown(node: Any, *, where: str) -> None:
    """Refuse keys of a composed node that its schema lacks, or that have no value.

    Args:
        node: a composed node; untyped parts are walked through.
        where: its full key, empty for the root.

    Raises:
        ConfigError: a key is unknown or without value; the message holds the full key.
    """
    from omegaconf import DictConfig, ListConfig, OmegaConf

    if isinstance(node, ListConfig) and not _empty(node):
        for index in range(len(node)):
            refuse_unknown(node._get_node(index), where=f"{where}[{index}]")
    if not isinstance(node, DictConfig) or _empty(node):
        return
    schema: Any = OmegaConf.get_type(node)
    typed = isinstance(schema, type) and dataclasses.is_dataclass(schema)
    allowed = [field.name for field in dataclasses.fields(schema)] if typed else []
    for key in map(str, node):
        full_key = f"{where}.{key}" if where else key
        if typed and key not in allowed:
            shown = [name for name in allowed if not name.startswith("_")]
            place = f"of {where}" if where else "of the configuration"
            raise ConfigError(
                f"{full_key}: '{key}' is not a key {place}.\n{suggestion(key, shown)}"
            )
        if OmegaConf.is_missing(node, key):
            raise ConfigError(f"{full_key} has no value.\nGive it: {full_key}=VALUE")
        refuse_unknown(node._get_node(key), where=full_key)


def _empty(node: Any) -> bool:
    """Return whether a value has no entries to check: None, missing, or a reference."""
    return bool(node._is_none() or node._is_missing() or node._is_interpolation())
