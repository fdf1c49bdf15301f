"""Search for the set of effects that explains a log: forward, exchange, pair, backward steps.

One driver serves all predictors and scores. A family of models says how its models are fitted and
compared; the stages say which refinements follow a forward step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Generic, Protocol, TypeVar

from seals.sysid.scores.hypothesis import Hypothesis

H = TypeVar("H", bound=Hypothesis)


class Refinement(Enum):
    """Kind of refinement: pairs, exchanges, or dropping of effects."""

    exchange = "other effects instead of each one except the last"
    pairs = "the most probable effects in pairs"
    backward = "the same without one of its effects"


@dataclass(frozen=True, kw_only=True)
class SearchStages:
    """Stages of a search.

    Args:
        effects: that are added at most.
        alone: refinement where no second effect is accepted; None for none.
        second: refinement after the second effect; None for none.
        further: refinement after every later effect; None for none.
        last: refinements at the end, in order.
    """

    effects: int
    alone: Refinement | None = None
    second: Refinement | None = None
    further: Refinement | None = None
    last: tuple[Refinement, ...] = ()

    def after(self, count: int) -> Refinement | None:
        """Return the refinement that follows the addition of an effect.

        Example:
            >>> SearchStages(effects=3, second=Refinement.pairs).after(2).name
            'pairs'
        """
        if count < 2:
            return None
        return self.second if count == 2 else self.further


class ModelFamily(Protocol[H]):
    """Interface of the search to models of one predictor and score; lists are best first."""

    @property
    def nominal(self) -> H:
        """Model without any candidate."""
        ...

    def extended(self, base: H, singles: Sequence[H]) -> Sequence[H]:
        """Fit all models with one more effect than ``base``.

        Args:
            base: model to extend.
            singles: models with one effect; empty in the first round.
        """
        ...

    def settled(self, base: H) -> bool:
        """Return true if a model leaves nothing for a further effect to explain."""
        ...

    def accepted(self, base: H, tried: Sequence[H]) -> tuple[H | None, Sequence[H]]:
        """Return the extension that is significantly better than ``base``; None without one.

        And all extensions as they then stand, best first: rivals may be fitted further.
        """
        ...

    def refined(self, best: H, singles: Sequence[H], step: Refinement) -> tuple[H, Sequence[H]]:
        """Return the best model after a refinement, and the models that were tried."""
        ...


@dataclass(frozen=True, kw_only=True)
class Search(Generic[H]):
    """Result of a search.

    Args:
        nominal: model without any candidate.
        best: chosen model, the nominal one when no effect is significant.
        rounds: models of every forward step, best first.
        refinements: models of every refinement.
    """

    nominal: H
    best: H
    rounds: tuple[tuple[H, ...], ...] = ()
    refinements: tuple[tuple[H, ...], ...] = ()


def search(
    family: ModelFamily[H],
    stages: SearchStages,
    *,
    tell: Callable[[int], None] = lambda rounds: None,
) -> Search[H]:
    """Add effects one at a time while they are significant, and refine the set of effects.

    Args:
        family: models that are fitted and compared.
        stages: of the search.
        tell: called with the number of forward steps done.
    """
    best = family.nominal
    rounds: list[tuple[H, ...]] = []
    refinements: list[tuple[H, ...]] = []
    owed: H | None = None

    def refine(now: H, step: Refinement) -> H:
        after, tried = family.refined(now, rounds[0], step)
        refinements.append(tuple(tried))
        return after

    while len(rounds) < stages.effects and len(best.candidates) < stages.effects:
        if rounds and family.settled(best):
            owed = best
            break
        rounds.append(tuple(family.extended(best, rounds[0] if rounds else ())))
        tell(len(rounds))
        # the first round may move the trajectory on which the stated model stands, too
        best = best if best.candidates else family.nominal
        chosen, stand = family.accepted(best, rounds[-1])
        rounds[-1] = tuple(stand)
        if chosen is None:
            if stages.alone is None or len(best.candidates) != 1:
                break
            chosen = refine(best, stages.alone)
            if chosen is best:
                break
            best = chosen
            continue
        best = chosen
        step = stages.after(len(best.candidates))
        best = best if step is None else refine(best, step)
    before = best
    for step in stages.last:
        best = refine(best, step)
    if 0 < len(best.candidates) < len(before.candidates) and not family.settled(best):
        # what was dropped had hidden the others of its round: they are tried once without it
        dropped = {c.label for c in before.candidates} - {c.label for c in best.candidates}
        rounds.append(tuple(family.extended(best, rounds[0])))
        left = [h for h in rounds[-1] if h.candidates[-1].label not in dropped]
        chosen, _ = family.accepted(best, left)
        if chosen is not None:
            best = chosen
            for step in stages.last:
                best = refine(best, step)
    if owed is not None and len(best.candidates) > 1:
        # none of them is accepted: they are the rivals of several effects
        rounds.append(tuple(family.extended(owed, rounds[0])))
    return Search(
        nominal=family.nominal, best=best, rounds=tuple(rounds), refinements=tuple(refinements)
    )
