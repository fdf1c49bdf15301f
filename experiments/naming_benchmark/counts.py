"""True, false and missed declarations."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Counts:
    """True, false and missed declarations.

    Args:
        true: declared and there.
        false: declared and not there.
        missed: there and not declared.
    """

    true: int = 0
    false: int = 0
    missed: int = 0

    def __add__(self, other: Counts) -> Counts:
        """Add up."""
        return Counts(
            true=self.true + other.true,
            false=self.false + other.false,
            missed=self.missed + other.missed,
        )

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall; 1 where there is nothing, and nothing is said.

        Example:
            >>> Counts(true=2, false=1, missed=1).f1
            0.6666666666666666
        """
        total = 2 * self.true + self.false + self.missed
        return 2.0 * self.true / total if total else 1.0

    @property
    def false_discovery(self) -> float:
        """Share of what is declared that is not there; 0 where nothing is declared.

        Example:
            >>> Counts(true=2, false=1).false_discovery
            0.3333333333333333
        """
        said = self.true + self.false
        return self.false / said if said else 0.0


def compared(there: set[str], said: set[str]) -> Counts:
    """Count what is declared against what is there."""
    return Counts(true=len(there & said), false=len(said - there), missed=len(there - said))
