"""Fewer compositions before a start: of the mode of a command, and of the jobs of a sweep."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Sequence
from typing import Any

from seals.config.recipes import conf_folders

WHOLE, REAL = re.compile(r"[-+]?\d+"), re.compile(r"[-+]?(\d+\.\d*|\.?\d+)([eE][-+]?\d+)?")


@contextlib.contextmanager
def checked_by_value() -> Iterator[None]:
    """Reduce the jobs that Hydra's sweepers compose beforehand.

    Hydra composes every job before the first one starts, in one process: with hundreds of them the
    others wait for that. A wrong value is wrong in whatever company, so a job is composed only for
    a value that none before it had; and where one whole number can be composed, so can another.
    What is wrong only together, or out of its bounds, is refused when its job begins.
    """
    from hydra.plugins.sweeper import Sweeper

    before = Sweeper.validate_batch_is_legal

    def check(self: Any, batch: Sequence[Sequence[str]]) -> None:
        before(self, newcomers(batch))

    Sweeper.validate_batch_is_legal = check  # type: ignore[method-assign]
    try:
        yield
    finally:
        Sweeper.validate_batch_is_legal = before  # type: ignore[method-assign]


def sets_mode(words: Sequence[str]) -> bool:
    """Return whether a word, or a file of an installed package, may set ``hydra.mode``."""
    if any(re.search(r"hydra(/|=|\.mode|\.searchpath)", word) for word in words):
        return True
    return any(
        re.search(rb"\bmode\s*:\s*\W?MULTIRUN\b", file.read_bytes())
        for _, folder in conf_folders()
        for file in folder.rglob("*.yaml")
    )


def newcomers(batch: Sequence[Sequence[str]]) -> list[Sequence[str]]:
    """Return the jobs with an override of a kind that no earlier job has.

    Example:
        >>> newcomers([["a=x", "b=1"], ["a=x", "b=2"], ["a=y", "b=1"], ["a=y", "b=2.5"]])
        [['a=x', 'b=1'], ['a=y', 'b=1'], ['a=y', 'b=2.5']]
    """
    seen: set[str] = set()
    found = []
    for words in batch:
        kinds = {kind(word) for word in words}
        if not seen.issuperset(kinds):
            found.append(words)
            seen |= kinds
    return found


def kind(word: str) -> str:
    """Return an override with a number in it replaced by its type, as a key for comparison.

    Example:
        >>> kind("seed=12"), kind("a.b=-1.5e3"), kind("robot=crab"), kind("+x@y=z")
        ('seed=whole', 'a.b=real', 'robot=crab', '+x@y=z')
    """
    key, equals, value = word.partition("=")
    for pattern, name in ((WHOLE, "whole"), (REAL, "real")):
        if pattern.fullmatch(value):
            return f"{key}{equals}{name}"
    return word
