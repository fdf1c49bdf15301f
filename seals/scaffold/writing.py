"""Names, templates and packages of ``seals new effect``, ``sensor``, ``controller`` and others."""

from __future__ import annotations

import keyword
import re
import secrets
import shutil
from collections.abc import Iterator, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from seals import registry
from seals.errors import ConfigError, printable
from seals.file_names import refuse_taken
from seals.logs.atomic import rename_new

_CLASS = {
    "effect": "",
    "sensor": "Sensor",
    "controller": "",
    "guide": "",
    "task": "Task",
    "reader": "Reader",
}
_ROBOT = {"controller": "auv", "guide": "auv", "task": "auv"}
"""Robot on which the contract of a new plug-in is checked; others need none."""
_PROMISE = {
    "effect": "Units, pure hooks, batch dynamics and simulator alike",
    "sensor": "Readings when due, the same log for the same seed",
    "controller": "Deterministic, memory not modified, commands within limits",
    "guide": "Deterministic, memory not modified, finite references",
    "task": "The same start for the same seed, pure functions, one finite row per episode",
    "reader": "Files that are not logs are refused with a message",
}
_UNDER_WATER = "robot=auv water=fossen initial.position=[0,0,-2]"
_FIRST_USE = {
    "effect": "seals run robot=ball +effect@effects.{0}={0}",
    "sensor": f"seals run {_UNDER_WATER} +sensor@sensors.{{0}}={{0}}",
    "controller": f"seals run {_UNDER_WATER} guide=hover controller={{0}}",
    "guide": f"seals run {_UNDER_WATER} guide={{0}} controller=station",
    "task": "seals train env=hover task={0}",
    "reader": "seals convert FILE out=log",
}
"""Command that uses a new plug-in, by kind, with a place for its name."""
PLUGINS = tuple(_CLASS)
"""Kinds of plug-ins that can be generated."""


def flow(value: Any) -> str:
    """Return a value as YAML in one line.

    Example:
        >>> flow({"type": "box", "size": [1.0, 0.5]})
        '{type: box, size: [1.0, 0.5]}'
    """
    import yaml

    text: str = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10**6)
    return text.removesuffix("...\n").strip()


def beside_of(parent: Path, name: str) -> Path:
    """Make a folder in which a new one is prepared; nobody can know its name beforehand."""
    beside = parent / f".{name}.{secrets.token_hex(8)}.part"
    beside.mkdir(parents=True)
    return beside


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
        kind: ``robot``, or one of `PLUGINS`.
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
            f"Allowed: lower-case letters, digits and '_', beginning with a letter.{hint}"
        )
    # an animal is asked for as a robot is
    for taken in ("robot", "animal") if kind == "robot" else (kind,):
        if name in registry.names(taken):
            origin = registry.get(taken, name).origin
            raise ConfigError(
                f"{taken} '{name}' is already installed, by {origin}.\n"
                f"Choose another name: my_{name}"
            )
    target = parent / (folder or name)
    refuse_taken(target)
    if not parent.is_dir():
        raise ConfigError(
            f"there is no folder '{parent}'.\nCreate it first, or choose another one."
        )
    return target


def plain(name: str) -> str:
    """Return the name of a link as a name of an effect can hold it.

    Example:
        >>> plain("wamv/base_link")
        'wamv_base_link'
    """
    return re.sub(r"[^\w-]", "_", name)


def scaffold_plugin(kind: str, name: str, *, parent: Path) -> Iterator[str]:
    """Create the package ``seals-NAME``; yield a summary and the next steps.

    Args:
        kind: one of `PLUGINS`.
        name: of the plug-in, as configurations will say it.
        parent: folder in which the package is made.

    Raises:
        ConfigError: the name is misspelt or taken.
    """
    title = name.replace("_", "-")
    package = f"seals_{name}"
    folder = free_name(kind, name, parent, folder=f"seals-{title}")
    cls = _CLASS[kind] + "".join(word.capitalize() for word in name.split("_"))
    facts = {"kind": kind, "name": name, "title": title, "package": package, "class": cls}
    use = _FIRST_USE[kind].format(name)
    facts |= {"robot": _ROBOT.get(kind, ""), "promise": _PROMISE[kind], "use": use}
    files = {
        "pyproject.toml": "pyproject.toml.jinja",
        "README.md": "plugin.md.jinja",
        f"{package}/__init__.py": "package.py.jinja",
        f"{package}/{name}.py": f"{kind}.py.jinja",
        f"tests/test_{name}.py": "test.py.jinja",
    }
    beside = beside_of(parent, f"seals-{title}")
    try:
        for path, template in files.items():
            (beside / path).parent.mkdir(parents=True, exist_ok=True)
            (beside / path).write_text(rendered(template, facts), encoding="utf-8")
        rename_new(beside, folder)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    yield f"{folder}/{package}/{name}.py: {kind} '{name}', class {cls}"
    yield "Next:"
    yield f"  pip install -e './{folder}[test]'"
    yield f"  seals describe {kind} {name}"
    yield f"  pytest {folder}"
    yield f"  {use}"
