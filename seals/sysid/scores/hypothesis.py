"""Hypothesis of a search: the stated model with some candidate effects."""

from __future__ import annotations

from dataclasses import dataclass

from seals.sysid.candidates.parameters import Candidate


@dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """Stated model with some candidates.

    Args:
        candidates: that were added; none for the stated model.

    Example:
        >>> Hypothesis(candidates=()).label
        'stated model'
    """

    candidates: tuple[Candidate, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects in the catalogue."""
        return tuple(c.name for c in self.candidates)

    @property
    def label(self) -> str:
        """Names with their variants."""
        return " + ".join(c.label for c in self.candidates) or "stated model"
