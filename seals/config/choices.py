"""What files of configuration choose among each other: how often, how deep, and without circles."""

from __future__ import annotations

import posixpath
from collections.abc import Iterator, Mapping
from typing import Any

MOST_CHOSEN, DEEPEST = 2_000, 40
"""Files that one may have read with all that it chooses; levels between them."""


def wrong_choices(defaults: Mapping[str, Any]) -> tuple[str, str] | None:
    """Return a file whose choices have no end, and what is wrong; None where all have.

    A file is read once for each way that leads to it, so that a few that choose each other twice
    are read a million times.

    Args:
        defaults: list of defaults of each file, by its path in the folder without suffix.

    Example:
        >>> wrong_choices({"experiment/a": ["b"], "experiment/b": ["a"]})
        ('experiment/a', 'chooses itself')
        >>> wrong_choices({"experiment/a": ["b"], "experiment/b": ["_self_"]})
    """
    sizes: dict[str, tuple[int, int]] = {}
    for name in defaults:
        wrong = _measure(name, defaults, sizes, ())
        if wrong:
            return name, wrong
    return None


def _measure(
    name: str,
    defaults: Mapping[str, Any],
    sizes: dict[str, tuple[int, int]],
    above: tuple[str, ...],
) -> str:
    """Note how many files are read for one, and levels of them; return what is wrong with it."""
    if name in above:
        return "chooses itself"
    if name in sizes:
        return ""
    count = levels = 1
    for chosen in _chosen(name, defaults):
        wrong = "" if len(above) > DEEPEST else _measure(chosen, defaults, sizes, (*above, name))
        if wrong:
            return wrong
        files, deep = sizes.get(chosen, (1, DEEPEST))
        count, levels = count + files, max(levels, 1 + deep)
        if levels > DEEPEST:
            return f"chooses files over more than {DEEPEST} levels"
        if count > MOST_CHOSEN:
            return f"has more than {MOST_CHOSEN:,} files read"
    sizes[name] = (count, levels)
    return ""


def _chosen(name: str, defaults: Mapping[str, Any]) -> Iterator[str]:
    """Yield the files of the folder that one chooses, as often as it does."""
    group = posixpath.dirname(name)
    entries = defaults[name]
    for entry in entries if isinstance(entries, list) else [entries]:
        for key, options in entry.items() if isinstance(entry, Mapping) else [("", entry)]:
            place = posixpath.join("/", group, _bare(str(key)))
            for option in options if isinstance(options, list) else [options]:
                full = posixpath.normpath(posixpath.join(place, _bare(str(option))))
                full = full.removesuffix(".yaml")
                # a reference may lead to any file of its group
                begin = full.partition("${")[0]
                yield from (
                    other
                    for other in defaults
                    if f"/{other}" == full or ("${" in full and f"/{other}".startswith(begin))
                )


def _bare(word: str) -> str:
    """Return a word of a list of defaults without its package and what stands before it."""
    return (word.partition("@")[0].split() or [""])[-1]
