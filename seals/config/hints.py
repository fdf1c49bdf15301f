"""Where a name that is out of place belongs: another group or section, an effect, a sensor."""

from __future__ import annotations

from typing import Any

from seals import registry
from seals.config.recipes import recipe_groups
from seals.config.roots import VERBS, root_schema

_ADDED = ("effect", "sensor")
"""Kinds of plug-ins that are added under a name."""


def added(name: str, *, section: str = "") -> str | None:
    """Return the word that adds an effect or a sensor; None for other names.

    Args:
        name: of a plug-in.
        section: under which it is added, by default the plug-in's own name.

    Example:
        >>> added("wind")
        '+effect@effects.wind=wind'
    """
    kinds = [kind for kind in _ADDED if name in registry.names(kind)]
    return f"+{kinds[0]}@{kinds[0]}s.{section or name}={name}" if kinds else None


def group_of(option: str, group: str) -> str | None:
    """Return another group of recipes that has an option of this name, or None.

    Example:
        >>> group_of("fossen", "fluid")
        'water'
    """
    found = (name for name, paths in recipe_groups().items() if option in {p.stem for p in paths})
    return next((name for name in sorted(found) if name != group), None)


def verbs_with(key: str) -> list[str]:
    """Return the verbs of which a name is a key by itself.

    Example:
        >>> verbs_with("span")
        ['convert']
    """
    return [name for name in VERBS if key in root_schema(name).__dataclass_fields__]


def home_of(key: str, node: Any, *, depth: int = 2) -> str | None:
    """Return the full key of a value that has this last name in a configuration, or None.

    Args:
        key: last part of a key.
        node: configuration to look in.
        depth: of sections below it.
    """
    from omegaconf import OmegaConf

    if depth == 0 or not OmegaConf.is_dict(node):
        return None
    for name in node:
        if OmegaConf.is_missing(node, name) or OmegaConf.is_interpolation(node, name):
            continue
        below = node[name]
        if name == key and not OmegaConf.is_dict(below):
            return str(key)
        found = home_of(key, below, depth=depth - 1)
        if found is not None:
            return f"{name}.{found}"
    return None
