"""Before a sweep begins, every value is composed once, and not every combination of values."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from typing import Any


@contextlib.contextmanager
def checked_by_value() -> Iterator[None]:
    """Let Hydra's sweepers compose fewer jobs beforehand.

    Hydra composes every job before the first one starts, in one process: with hundreds of them the
    others wait for that. A wrong value is wrong in whatever company, so a job is composed only for
    a value that none before it had. Two values that are wrong only together are refused when their
    job begins.
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


def newcomers(batch: Sequence[Sequence[str]]) -> list[Sequence[str]]:
    """Return the jobs with a word that no job before them had.

    Example:
        >>> newcomers([["a=1", "b=1"], ["a=1", "b=2"], ["a=2", "b=1"], ["a=2", "b=2"]])
        [['a=1', 'b=1'], ['a=1', 'b=2'], ['a=2', 'b=1']]
    """
    seen: set[str] = set()
    found = []
    for words in batch:
        if not seen.issuperset(words):
            found.append(words)
            seen.update(words)
    return found
