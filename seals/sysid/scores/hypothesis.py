"""Hypothesis of a search: the nominal model with some candidate effects."""

from __future__ import annotations

from dataclasses import dataclass

from seals.sysid.candidates.parameters import Candidate


@dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """Nominal model with some candidates.

    Args:
        candidates: that were added; none for the nominal model.

    Example:
        >>> Hypothesis(candidates=()).label
        'nominal model'
    """

    candidates: tuple[Candidate, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects in the catalogue."""
        return tuple(c.name for c in self.candidates)

    @property
    def label(self) -> str:
        """Names with their variants."""
        return " + ".join(c.label for c in self.candidates) or "nominal model"
