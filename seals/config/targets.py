"""Restriction of ``_target_`` to the class of the chosen plug-in.

Hydra makes an object of every mapping with ``_target_``, however deep it lies.
"""

from __future__ import annotations

import dataclasses
from typing import Any

from seals.errors import ConfigError

TARGET = "_target_"
SPECIAL = (TARGET, "_args_", "_partial_", "_recursive_", "_convert_")
"""Keys that tell Hydra to call something, or how."""
_DEEPEST = 40


def refuse_targets(node: Any, *, where: str) -> None:
    """Refuse every ``_target_`` in a composed node that differs from its schema's.

    References are followed: what they lead to would be made, too.

    Args:
        node: a composed node.
        where: its full key.

    Raises:
        ConfigError: a mapping without a schema holds one of Hydra's special keys, one with a schema
            names another class, or the node leads back into itself.
    """
    _walk(node, where, 0)


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
