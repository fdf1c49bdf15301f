"""Effects tried at the times of another one, and the share that one for a time must explain."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from seals.effects.identification import Identification
from seals.sysid.candidates.activity import Activity, Moment, Span
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision import evidence
from seals.sysid.decision.answer import Rival, claim_against, reported
from seals.sysid.decision.evidence import score_without
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.selection import onsets
from seals.sysid.selection.onsets import in_place_of_timed, of_one_cause
from seals.sysid.selection.search import Search
from tests.unit.test_diagnose_decision import model

STARTS = ((0.1,), (0.2,))
LATE = Activity(spans=(Span(log=0, start=Moment(value=5.0, low90=4.9, high90=5.1), end=None),))


def load(link: int) -> Candidate:
    """A load on one link, which no screen about zero can judge."""
    return Candidate(
        name="load", keys=(f"load_{link}.mass",), variant={"link": link}, starts=STARTS
    )


BIAS = Candidate(name="bias", keys=("bias.x",), identification=Identification(may_begin=True))


def jobs(*candidates: Candidate) -> list[tuple[tuple[str, ...], float]]:
    """Labels of the models that are tried, and where the mass of each starts."""
    problem: Any = SimpleNamespace(
        plant=SimpleNamespace(candidate_set=SimpleNamespace(candidates=(load(0), load(4), BIAS)))
    )
    values = {k: 7.0 for c in candidates for k in c.all_keys}
    best: Any = SimpleNamespace(candidates=candidates, fit=SimpleNamespace(values=values))
    best.names = tuple(c.name for c in candidates)
    return [
        (tuple(c.label for c in model), start[model[-1].keys[0]])
        for model, start in in_place_of_timed(problem, best)
    ]


def test_another_variant_of_an_effect_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """A load on the body beside a bias for a time may both be the shadow of one on a hand."""
    monkeypatch.setattr(onsets, "may_act_for_a_time", lambda problem, candidate: True)
    tried = jobs(BIAS.acting(LATE), load(0))
    assert tried == [(("load (link 4, for a time)",), s[0]) for s in STARTS]


def test_other_effects_stay_beside_the_one_in_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """The drag that was found keeps its values."""
    monkeypatch.setattr(onsets, "may_act_for_a_time", lambda problem, candidate: True)
    drag = Candidate(name="drag", keys=("drag.x",))
    labels = {names for names, _ in jobs(BIAS.acting(LATE), drag)}
    assert labels == {("drag", f"load (link {k}, for a time)") for k in (0, 4)}


def test_the_score_of_the_other_effects_is_the_best_known() -> None:
    """Models with the effect itself, or with strangers, say nothing of the others."""
    best = model(["wind", "payload"], misfit=1.0, score=900.0)
    alone = [model([n], misfit=1.2, score=s) for n, s in (("wind", 700.0), ("payload", 100.0))]
    rounds = (tuple(alone), (model(["wind", "tether"], misfit=1.0, score=800.0),))
    search = Search(nominal=model((), misfit=2.0, score=0.0), best=best, rounds=rounds)
    assert score_without(search, best, 1) == 700.0
    assert score_without(search, best, 0) == 100.0
    assert score_without(search, alone[0], 0) == 0.0


@pytest.mark.parametrize(("timed", "sure"), [(True, True), (False, False)])
def test_a_rival_for_a_time_must_explain_a_share(
    monkeypatch: pytest.MonkeyPatch, timed: bool, sure: bool
) -> None:
    """One that explains less than a share of the rest fits flaws of its law, not a cause."""
    best = model(["wind", "payload"], misfit=1.0, score=1e6)
    alone = model(["wind"], misfit=1.2, score=9e5)
    other = model(["wind", "tether"], misfit=1.0, score=1e6 + 10.0)
    if timed:
        wind, tether = other.candidates
        other = replace(other, candidates=(wind, tether.acting(LATE)))
    search: Search[Any] = Search(nominal=alone, best=best, rounds=((alone,),))
    monkeypatch.setattr(evidence, "rivals_of", lambda *given, processes: (other,))
    claim = evidence._claim(search, best, 1, 2.0, DecisionPolicy().evidence_ties(), processes=1)
    assert (claim.confidence > 0.9) is sure


@pytest.mark.parametrize("processes", [1, 2])
def test_finer_times_may_be_those_of_the_complement(
    monkeypatch: pytest.MonkeyPatch, processes: int
) -> None:
    """All other times are tried once more when the times are fine."""
    monkeypatch.setattr(onsets, "sharpened", lambda nominal, best: ("fine", best))
    monkeypatch.setattr(onsets, "_complemented", lambda nominal, best: ("other", best))
    best: Any = SimpleNamespace(candidates=())
    none: Any = None
    found = onsets.retimed(none, none, best, processes=processes)
    assert found == ("other", ("fine", ("other", best)))


@pytest.mark.parametrize(
    ("other", "together"), [(5.15, True), (5.5, False), (None, False)], ids=["near", "later", "all"]
)
def test_effects_that_end_together_may_have_one_cause(
    monkeypatch: pytest.MonkeyPatch, other: float | None, together: bool
) -> None:
    """A weight that is dropped is a lift and a centre of gravity until then; drags stay out."""
    monkeypatch.setattr(onsets, "may_act_for_a_time", lambda problem, c: c.name != "drag")
    drag = Candidate(name="drag", keys=("drag.x",))
    candidates = (load(0), BIAS, drag)
    problem: Any = SimpleNamespace(
        plant=SimpleNamespace(candidate_set=SimpleNamespace(candidates=candidates)),
        policy=DecisionPolicy(),
    )
    lift, centre = (Candidate(name=n, keys=(f"{n}.x",)) for n in ("lift", "centre"))
    if other is not None:
        at = Moment(value=other, low90=other, high90=other)
        centre = centre.acting(Activity(spans=(Span(log=0, start=at),)))
    best: Any = SimpleNamespace(candidates=(lift.acting(LATE), centre))
    tried = of_one_cause(problem, best)
    assert {model[0].name for model, _ in tried} == ({"load", "bias"} if together else set())
    assert all(len(model) == 1 and model[0].activity is LATE for model, _ in tried)
    assert not together or sorted(v for _, start in tried for v in start.values()) == [0, 0.1, 0.2]


@pytest.mark.parametrize(
    ("gap", "assumed", "told"),
    [(0.7, False, True), (3.0, False, False), (3.0, True, True), (6.0, True, False)],
)
def test_two_names_of_a_further_effect_do_not_hide_it(
    gap: float, assumed: bool, told: bool
) -> None:
    """A payload and a weaker thrust halve each other's confidence; one of them is there.

    Where tolerances are rules of thumb, they may lie further apart.
    """
    rule = DecisionPolicy().evidence_ties(assumed=assumed)
    best = model(["drag", "thrust"], misfit=1.0, score=900.0)
    first = claim_against(best, 0, [], rule)
    second = claim_against(best, 1, [Rival("payload", gap, 1.0, 0.7)], rule)
    assert second.confidence == pytest.approx(1.0 / 1.7)
    assert second.confidence < rule.further
    assert reported([first, second], rule) == ((first, second) if told else (first,))
