"""Pages that lie outside of ``docs/`` and belong to the site: their place there."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path

ALONE = {"CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md"}
ROOMS = ("experiments", "robots", "animals")
PICTURES = (".png", ".webp")


@functools.cache
def places(root: Path) -> Mapping[str, str]:
    """Return the place on the site of each page and picture, by its path in the repository.

    Taken are the readme and the pictures beside it of each folder of experiments, robots and
    animals, and the pages that lie alone at the top.

    Args:
        root: folder of the repository.
    """
    found = dict(ALONE)
    for room in ROOMS:
        for page in sorted((root / room).glob("**/README.md")):
            beside = [p for p in sorted(page.parent.iterdir()) if p.suffix in PICTURES]
            for path in (page, *beside):
                there = path.relative_to(root).as_posix()
                found[there] = there
    return found
