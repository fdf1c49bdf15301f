"""Checks of a composed node before construction: unknown keys, missing values, ``_target_``.

Hydra makes an object of every mapping with ``_target_``, however deep it lies.
"""

from __future__ import annotations

import dataclasses
from typing import Any

from seals.errors import ConfigError, suggestion

TARGET = "_target_"
SPECIAL = (TARGET, "_args_", "_partial_", "_recursive_", "_convert_")
"""Keys that tell Hydra to call something, or how."""
_DEEPEST = 40


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


def refuse_targets(node: Any, *, where: str) -> None:
    """Refuse every ``_target_`` in a composed node that differs from its schema's.

    References are followed: what they lead to would be made, too.

    Raises:
        ConfigError: a mapping without a schema holds one of Hydra's special keys, one with a schema
            names another class, or the node leads back into itself.
    """
    _walk(node, where, 0)


def _empty(node: Any) -> bool:
    """Return whether a value has no entries to check: None, missing, or a reference."""
    return bool(node._is_none() or node._is_missing() or node._is_interpolation())


def _walk(node: Any, where: str, depth: int) -> None:
    from omegaconf import DictConfig, ListConfig, OmegaConf

    if not isinstance(node, DictConfig | ListConfig) or node._is_none() or node._is_missing():
        return
    if depth > _DEEPEST:
        raise ConfigError(
            f"{where:.80} is nested deeper than {_DEEPEST} levels.\nIt may refer to itself."
        )
    if isinstance(node, ListConfig):
        for index in range(len(node)):
            _walk(node[index], f"{where}[{index}]", depth + 1)
        return
    schema: Any = OmegaConf.get_type(node)
    typed = isinstance(schema, type) and dataclasses.is_dataclass(schema)
    own = {f.name: f.default for f in dataclasses.fields(schema)} if typed else {}
    for key in map(str, node):
        if key in SPECIAL:
            if key in own and node[key] == own[key]:
                continue
            allowed = own.get(key, "values; a plug-in is chosen by its group")
            raise ConfigError(
                f"{where}.{key}={node[key]!s:.80} is not allowed.\nAllowed: {allowed}"
            )
        if not OmegaConf.is_missing(node, key):
            _walk(node[key], f"{where}.{key}", depth + 1)
