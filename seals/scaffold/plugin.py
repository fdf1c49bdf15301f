"""``seals new effect``, ``sensor``, ``controller``, ``guide``, ``task``: plug-in packages."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

from seals.scaffold.writing import free_name, rendered

_CLASS = {"effect": "", "sensor": "Sensor", "controller": "", "guide": "", "task": "Task"}
_ROBOT = {"controller": "auv", "guide": "auv", "task": "auv"}
"""Robot on which the contract of a new plug-in is checked; others need none."""
_PROMISE = {
    "effect": "Units, pure hooks, twin and simulator alike",
    "sensor": "Due readings, one seed one record",
    "controller": "Equal answers, memory left alone, commands within limits",
    "guide": "Equal answers, memory left alone, finite references",
    "task": "One seed one start, pure laws, one finite row an episode",
}
PLUGINS = tuple(_CLASS)
"""Kinds of plug-ins that can be generated."""


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
    facts |= {"robot": _ROBOT.get(kind, ""), "promise": _PROMISE[kind]}
    files = {
        "pyproject.toml": "pyproject.toml.jinja",
        "README.md": "plugin.md.jinja",
        f"{package}/__init__.py": "package.py.jinja",
        f"{package}/{name}.py": f"{kind}.py.jinja",
        f"tests/test_{name}.py": "test.py.jinja",
    }
    beside = parent / f".seals-{title}.part"
    shutil.rmtree(beside, ignore_errors=True)
    try:
        for path, template in files.items():
            (beside / path).parent.mkdir(parents=True, exist_ok=True)
            (beside / path).write_text(rendered(template, facts), encoding="utf-8")
        beside.rename(folder)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    yield f"{folder}/{package}/{name}.py: {kind} '{name}', class {cls}"
    yield "Next:"
    yield f"  pip install -e ./{folder}"
    yield f"  seals describe {kind} {name}"
    yield f"  pytest {folder}"
