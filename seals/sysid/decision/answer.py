"""Answer of a diagnosis: verdict, named effects with confidences, reasons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision.verdict import Verdict
from seals.sysid.scores.hypothesis import Hypothesis

H = TypeVar("H", bound=Hypothesis)


@dataclass(frozen=True, kw_only=True)
class Claim(Generic[H]):
    """Effect named by an answer.

    Args:
        hypothesis: model in which it was fitted.
        index: of the effect among the candidates of the hypothesis.
        confidence: that it is this effect and no other.
        rivals: names that explain the measurements as well.
        alike: names that explain them nearly as well, rivals among them.
        settled: names that only their innovations rule out.
    """

    hypothesis: H
    index: int
    confidence: float
    rivals: tuple[str, ...] = ()
    alike: tuple[str, ...] = ()
    settled: tuple[str, ...] = ()

    @property
    def candidate(self) -> Candidate:
        """Effect in its variant."""
        return self.hypothesis.candidates[self.index]

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.candidate.name


@dataclass(frozen=True, kw_only=True)
class Answer(Generic[H]):
    """Verdict with its reasons.

    Args:
        verdict: of the diagnosis.
        claims: effects, best first.
        reasons: in words.
    """

    verdict: Verdict
    claims: tuple[Claim[H], ...]
    reasons: tuple[str, ...] = ()


def verdict_of(claims: Sequence[Claim[H]]) -> Verdict:
    """Return the verdict 'ambiguous' where every claim has rivals that fit equally well.

    One claim that stands alone makes the answer a name; the rivals of the others are its sets.

    Args:
        claims: effects of the answer, one at least.
    """
    return Verdict.ambiguous if all(claim.rivals for claim in claims) else Verdict.named
