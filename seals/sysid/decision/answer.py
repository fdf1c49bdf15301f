"""Answer of a diagnosis: verdict, named effects with confidences, reasons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision.policy import TieRule
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
        shared: odds of these names together against the effect's own.
        alike: names that explain them nearly as well, rivals among them.
        settled: names that only their innovations rule out.
    """

    hypothesis: H
    index: int
    confidence: float
    rivals: tuple[str, ...] = ()
    alike: tuple[str, ...] = ()
    settled: tuple[str, ...] = ()
    shared: float = 0.0

    @property
    def confidence_of_set(self) -> float:
        """Confidence that it is this effect or one of its rivals."""
        return self.confidence * (1.0 + self.shared)

    @property
    def candidate(self) -> Candidate:
        """Effect in its variant."""
        return self.hypothesis.candidates[self.index]

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.candidate.name


class Rival(NamedTuple):
    """Effect in the place of a claimed one.

    Args:
        name: in the answer.
        gap: distance to the best model.
        unit: uncertainty of the gap.
        odds: against the claimed effect.
        close: whether it explains enough to be named beside it.
    """

    name: str
    gap: float
    unit: float
    odds: float
    close: bool = True


def claim_against(
    hypothesis: H,
    index: int,
    rivals: Sequence[Rival],
    rule: TieRule,
    *,
    settled: Sequence[str] = (),
) -> Claim[H]:
    """Claim an effect against its rivals, of which the closest ones make a set with it.

    Equation:
        confidence = 1 / (1 + sum of the odds of all other names)

    Args:
        hypothesis: best model.
        index: of the effect among its candidates.
        rivals: in any order; of one name the closest counts.
        rule: distances that decide.
        settled: names that only their innovations rule out.
    """
    closest: dict[str, Rival] = {}
    for rival in rivals:
        if rival.odds > closest.get(rival.name, rival._replace(odds=0.0)).odds:
            closest[rival.name] = rival
    ordered = sorted((r for r in closest.values() if r.close), key=lambda r: r.gap)
    near = [r.name for r in ordered if r.gap <= rule.tied * r.unit]
    alike = [r.name for r in ordered if r.gap <= rule.alike * r.unit]
    return Claim(
        hypothesis=hypothesis,
        index=index,
        confidence=1.0 / (1.0 + sum(r.odds for r in closest.values())),
        rivals=tuple(near[: rule.listed]),
        alike=tuple(alike[: rule.listed]),
        settled=tuple(settled),
        shared=sum(closest[name].odds for name in near[: rule.listed]),
    )


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


def reported(claims: Sequence[Claim[H]], rule: TieRule) -> tuple[Claim[H], ...]:
    """Return the first claim and the further ones that are confident enough, as sets.

    Two names that explain a further effect equally well halve each other's confidence, and the
    effect is there all the same.
    """
    return (claims[0], *(c for c in claims[1:] if c.confidence_of_set > rule.further))


def verdict_of(claims: Sequence[Claim[H]]) -> Verdict:
    """Return the verdict 'ambiguous' where a claim has rivals that fit equally well.

    The others of the answer are certain then, but the answer as a whole is not one model.

    Args:
        claims: effects of the answer, one at least.
    """
    return Verdict.ambiguous if any(claim.rivals for claim in claims) else Verdict.named
