"""Validation of names, and filling in of the templates of ``seals new``."""

from __future__ import annotations

import keyword
import re
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from seals import registry
from seals.errors import ConfigError, printable


def flow(value: Any) -> str:
    """Return a value as YAML in one line.

    Example:
        >>> flow({"type": "box", "size": [1.0, 0.5]})
        '{type: box, size: [1.0, 0.5]}'
    """
    import yaml

    text: str = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10**6)
    return text.removesuffix("...\n").strip()


def rendered(template: str, facts: Mapping[str, Any]) -> str:
    """Return a template of ``seals/scaffold/templates`` filled with values."""
    import jinja2

    source = (files("seals.scaffold.templates") / template).read_text(encoding="utf-8")
    environment = jinja2.Environment(
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
        autoescape=False,
        # no name of a file, a link or a plug-in begins a line of its own
        finalize=lambda value: printable(value) if isinstance(value, str) else value,
    )
    environment.filters["flow"] = flow
    return environment.from_string(source).render(**facts)


def free_name(kind: str, name: str, parent: Path, *, folder: str = "") -> Path:
    """Return the folder to create, or refuse the name.

    Args:
        kind: robot, effect or sensor.
        name: as the user gave it.
        parent: folder in which the new one is made.
        folder: its name, where it is not that of the thing itself.

    Raises:
        ConfigError: the name is misspelt, installed already, or its folder exists.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or keyword.iskeyword(name):
        better = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_").lstrip("0123456789_")
        hint = f"  For instance: {better}" if better and better != name else ""
        raise ConfigError(
            f"'{name}' cannot be the name of {'an' if kind[0] in 'aeiou' else 'a'} {kind}.\n"
            f"Allowed: small letters, digits and '_', a letter first.{hint}"
        )
    # an animal is asked for as a robot is
    for taken in ("robot", "animal") if kind == "robot" else (kind,):
        if name in registry.names(taken):
            origin = registry.get(taken, name).origin
            raise ConfigError(
                f"{taken} '{name}' is installed already, by {origin}.\n"
                f"Choose another name: my_{name}"
            )
    target = parent / (folder or name)
    if target.exists():
        raise ConfigError(
            f"'{target}' exists already.\nChoose another name, or move that folder away."
        )
    if not parent.is_dir():
        raise ConfigError(f"there is no folder '{parent}'.\nMake it first, or go to another one.")
    return target


def plain(name: str) -> str:
    """Return the name of a link as a name of an effect can hold it.

    Example:
        >>> plain("wamv/base_link")
        'wamv_base_link'
    """
    return re.sub(r"[^\w-]", "_", name)
