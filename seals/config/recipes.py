"""YAML groups of the installed conf packages, such as ``experiment`` and ``water``."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from pathlib import Path

from seals import registry
from seals.config.roots import VERBS
from seals.errors import BrokenPlugin


def conf_folders() -> Iterator[tuple[registry.Plugin, Path]]:
    """Yield the conf packages with their folders, but for those that cannot be imported.

    ``seals doctor`` names them: a list must not fail for one package.
    """
    for plugin in registry.plugins("conf").values():
        with contextlib.suppress(BrokenPlugin):
            yield plugin, plugin.folder()


def recipe_groups() -> dict[str, list[Path]]:
    """Return the YAML files of every configuration group by group, without composing them."""
    found: dict[str, list[Path]] = {}
    for _, folder in conf_folders():
        for path in sorted(folder.glob("*/*.yaml")):
            found.setdefault(path.parent.name, []).append(path)
    return found


def roots_choosing(group: str) -> list[str]:
    """Return the verbs whose root configurations choose an option of a group.

    Example:
        >>> roots_choosing("learner")
        ['train']
    """
    found = []
    for _, folder in conf_folders():
        for path in sorted(folder.glob("*.yaml")):
            chosen = re.findall(r"^  - (\w+):", path.read_text(encoding="utf-8"), re.MULTILINE)
            if group in chosen and path.stem in VERBS:
                found.append(path.stem)
    return found


def experiments() -> dict[str, str]:
    """Return the installed experiments and the verb each is for.

    An experiment that chooses a reader compares with a measurement; any other one runs.
    """
    return {
        path.stem: "compare" if "/reader" in path.read_text(encoding="utf-8") else "run"
        for path in recipe_groups().get("experiment", [])
    }
