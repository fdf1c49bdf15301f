"""The search over sets of effects, on families whose scores are written down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.scores.hypothesis import Hypothesis
from seals.sysid.selection.search import Refinement, SearchStages, search

ASKED = 1.0


@dataclass(frozen=True, kw_only=True)
class Scored(Hypothesis):
    """Hypothesis with a score from a table."""

    score: float


class Table:
    """Family of models whose score depends on their names alone; what is missing scores zero.

    Args:
        scores: by names.
        enough: score from which on nothing is left to explain.
    """

    def __init__(self, scores: Mapping[str, float], *, enough: float = np.inf) -> None:
        self.scores = {frozenset(k): v for k, v in scores.items()}
        self.enough = enough
        self.letters = sorted(set("".join(scores)))
        self.nominal = self.model("")

    def model(self, names: str) -> Scored:
        """Score a set of names, one letter each."""
        candidates = tuple(Candidate(name=n, keys=(f"{n}.size",)) for n in names)
        return Scored(candidates=candidates, score=self.scores.get(frozenset(names), 0.0))

    def extended(self, base: Scored, singles: Sequence[Scored]) -> list[Scored]:
        """Add every other letter."""
        own = "".join(base.names)
        return self._ranked([own + x for x in self.letters if x not in own])

    def settled(self, base: Scored) -> bool:
        """Nothing is left of a model with enough."""
        return base.score >= self.enough

    def accepted(
        self, base: Scored, tried: Sequence[Scored]
    ) -> tuple[Scored | None, Sequence[Scored]]:
        """Ask for a gain of one."""
        return next((h for h in tried if h.score >= base.score + ASKED), None), tried

    def refined(
        self, best: Scored, singles: Sequence[Scored], step: Refinement
    ) -> tuple[Scored, Sequence[Scored]]:
        """Try pairs, exchanges of all but the last, or smaller sets of nearly the same score."""
        own = "".join(best.names)
        if step is Refinement.pairs:
            tried = self._ranked(["".join(p) for p in combinations(self.letters, 2)])
        elif step is Refinement.exchange:
            places = range(len(own) - 1)
            others = [s.names[0] for s in singles]
            tried = self._ranked([own[:k] + own[k + 1 :] + x for k in places for x in others])
        else:
            tried = self._ranked([own[:k] + own[k + 1 :] for k in range(len(own))])
            spare = [h for h in tried if best.score < h.score + ASKED]
            return (spare[0] if spare else best), tried
        return max([best, *tried], key=lambda h: h.score), tried

    def _ranked(self, names: Sequence[str]) -> list[Scored]:
        return sorted((self.model(n) for n in names), key=lambda h: -h.score)


HIDDEN = {"a": 4.0, "b": 4.0, "c": 5.0, "ac": 6.5, "bc": 6.0, "ab": 12.0}
"""A pair hides behind a third effect that looks like both."""


def test_forward_steps_end_where_no_effect_gains_enough() -> None:
    """Steps of 5 and 1.5 are taken, the next one gains nothing."""
    found = search(Table(HIDDEN), SearchStages(effects=3))
    assert set(found.best.names) == {"a", "c"}
    assert [len(r) for r in found.rounds] == [3, 2, 1]
    assert found.refinements == ()


def test_pairs_bring_out_what_hides_behind_a_third_effect() -> None:
    """After the second effect, or at the end, the pair replaces the decoy."""
    for stages in (
        SearchStages(effects=3, second=Refinement.pairs),
        SearchStages(effects=3, last=(Refinement.pairs,)),
    ):
        found = search(Table(HIDDEN), stages)
        assert set(found.best.names) == {"a", "b"}
        assert len(found.refinements) == 1


def test_an_exchange_follows_the_third_effect_only() -> None:
    """The first choice d is exchanged for a once three effects are there."""
    scores = {"d": 5.0, "a": 4.0, "db": 7.0, "dbc": 9.0, "bca": 14.0}
    table = Table(scores)
    found = search(table, SearchStages(effects=3, further=Refinement.exchange))
    assert set(found.best.names) == {"a", "b", "c"}
    assert set(search(table, SearchStages(effects=3)).best.names) == {"b", "c", "d"}
    assert set(search(table, SearchStages(effects=2)).best.names) == {"b", "d"}


def test_backward_drops_what_is_not_worth_its_place() -> None:
    """The decoy of the first step goes where it is worth 0.5, and stays where it is worth 1.5."""
    stages = SearchStages(effects=3, last=(Refinement.backward,))
    dropped = search(Table({**HIDDEN, "abc": 12.5}), stages)
    assert set(dropped.best.names) == {"a", "b"}
    kept = search(Table({**HIDDEN, "abc": 13.5}), stages)
    assert set(kept.best.names) == {"a", "b", "c"}


def test_what_was_hidden_by_a_dropped_effect_is_tried_without_it() -> None:
    """The first effect does not pay in the end; without it a third one does."""
    scores = {"a": 5.0, "ab": 7.0, "abc": 8.5, "abd": 8.2, "bc": 8.0}
    stages = SearchStages(effects=3, last=(Refinement.backward,))
    assert set(search(Table(scores), stages).best.names) == {"b", "c"}
    assert set(search(Table({**scores, "bcd": 9.5}), stages).best.names) == {"b", "c", "d"}


def test_one_effect_at_most() -> None:
    """Without a second step the best single stands, and the stated model where none suffices."""
    assert search(Table(HIDDEN), SearchStages(effects=1)).best.names == ("c",)
    none = search(Table({"a": 0.5}), SearchStages(effects=3, last=(Refinement.pairs,)))
    assert none.best is none.nominal


def test_two_effects_that_hide_each_other_are_tried_as_a_pair() -> None:
    """Beside the decoy nothing gains: pairs are tried where that is asked; a third may follow."""
    scores = {"c": 5.0, "a": 4.0, "b": 4.0, "ab": 12.0, "ac": 5.5, "bc": 5.5}
    assert search(Table(scores), SearchStages(effects=3)).best.names == ("c",)
    found = search(Table(scores), SearchStages(effects=3, alone=Refinement.pairs))
    assert set(found.best.names) == {"a", "b"}
    assert len(found.refinements) == 1
    more = search(Table({**scores, "abc": 14.0}), SearchStages(effects=3, alone=Refinement.pairs))
    assert set(more.best.names) == {"a", "b", "c"}
    one = search(Table({"c": 5.0}), SearchStages(effects=3, alone=Refinement.pairs))
    assert one.best.names == ("c",)


def test_a_model_that_leaves_nothing_is_extended_for_the_rivals_of_two_effects_alone() -> None:
    """The round that cannot add anything is left out where one effect remains, and made for two."""
    stages = SearchStages(effects=3, last=(Refinement.backward,))
    one = search(Table(HIDDEN, enough=6.0), stages)
    assert set(one.best.names) == {"a", "c"}
    assert [len(r) for r in one.rounds] == [3, 2, 1]
    single = search(Table(HIDDEN, enough=5.0), stages)
    assert single.best.names == ("c",)
    assert [len(r) for r in single.rounds] == [3]
