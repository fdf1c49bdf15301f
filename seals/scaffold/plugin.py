"""``seals new effect`` and ``seals new sensor``: generate a plug-in package."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

from seals.scaffold.naming import free_name
from seals.scaffold.writing import rendered

_CLASS = {"effect": "", "sensor": "Sensor"}


def scaffold_plugin(kind: str, name: str, *, parent: Path) -> Iterator[str]:
    """Create the package ``seals-NAME``; yield a summary and the next steps.

    Args:
        kind: effect or sensor.
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
