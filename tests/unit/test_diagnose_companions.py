"""Companions of a found effect: fitted beside it where something is left over, and not named."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from seals.effects.identification import Identification
from seals.sysid.candidates.parameters import Candidate, CandidateSet, Parameter
from seals.sysid.decision import evidence
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.scores.disturbance_level import DisturbanceLevel
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection import companions
from seals.sysid.selection.companions import comes_with, unnamed_companions, with_companion
from tests.unit.test_diagnose_decision import NAMES, answer, model

AIR, WATER = {"medium": 0.0}, {"medium": 1.0}
DRAG = Candidate(
    name="drag",
    keys=("drag.size",),
    variant=AIR,
    identification=Identification(companions=("turning",)),
)
TURNING = Candidate(name="turning", keys=("turning.size",), variant=AIR)


def found(*candidates: Candidate, size: float = 0.0, score: float = 100.0) -> EvidenceHypothesis:
    """A model whose companion has a size, beside a plausible one of 1."""
    keys = {k: Parameter(key=k, scale=1.0) for c in (DRAG, TURNING) for k in c.keys}
    made = model((), misfit=1.0, score=score)
    fitter: Any = made.fitter
    fitter.candidate_set = CandidateSet(
        effects={}, parameters=keys, candidates=(DRAG, TURNING), policy=DecisionPolicy()
    )
    values = {"drag.size": 1.0, "turning.size": size}
    return replace(made, candidates=candidates, fit=replace(made.fit, values=values))


def extended(
    monkeypatch: pytest.MonkeyPatch, *, left: float, rise: float
) -> tuple[EvidenceHypothesis, EvidenceHypothesis]:
    """Model without and with what a search adds where gusts are left and a companion brings so."""
    best, level = found(DRAG), SimpleNamespace(between=left)
    more = found(DRAG, TURNING, size=1e-3, score=best.score + rise)
    monkeypatch.setattr(companions, "disturbance_level", lambda model: level)
    monkeypatch.setattr(companions, "fitted", lambda *given, processes: [more])
    return best, with_companion(found(), best, lambda base, added: 20.0)


@pytest.mark.parametrize(
    ("left", "rise", "names"),
    [
        (9.0, 50.0, ("drag", "turning")),
        (9.0, 5.0, ("drag",)),
        (1.0, 50.0, ("drag",)),
    ],
)
def test_a_companion_is_added_where_it_pays_and_the_model_would_be_refused(
    monkeypatch: pytest.MonkeyPatch, left: float, rise: float, names: tuple[str, ...]
) -> None:
    """Neither without need nor without evidence."""
    _, more = extended(monkeypatch, left=left, rise=rise)
    assert more.names == names


def test_what_acts_in_another_medium_is_no_companion() -> None:
    """Drag in air says nothing of rotation in water."""
    assert comes_with(TURNING, (DRAG,))
    assert not comes_with(replace(TURNING, variant=WATER), (DRAG,))
    assert not comes_with(DRAG, (TURNING,))


@pytest.mark.parametrize(("size", "places"), [(1e-3, [1]), (0.9, [])])
def test_a_small_companion_is_not_named(size: float, places: list[int]) -> None:
    """One of a plausible size is an effect of its own."""
    assert unnamed_companions(found(DRAG, TURNING, size=size)) == places


@pytest.mark.parametrize(("others", "names"), [(("payload",), ["wind"]), ((), ["payload", "wind"])])
def test_a_small_companion_of_an_effect_is_fitted_and_not_claimed(
    monkeypatch: pytest.MonkeyPatch, others: tuple[str, ...], names: list[str]
) -> None:
    """What comes along with an effect in small size is none of its own; what does not, is."""
    level = DisturbanceLevel(level=1.0, gain=0.0, allowance=0.0, between=1.0)
    monkeypatch.setattr(evidence, "disturbance_level", lambda best: level)
    monkeypatch.setattr(evidence, "self_check", lambda best: None)
    monkeypatch.setattr(evidence, "expected_gains", lambda base: dict.fromkeys(NAMES, 1e3))
    monkeypatch.setattr(evidence, "rivals_of", lambda *given, processes: ())
    both = model(["wind", "payload"], misfit=1.0, score=200.0)
    wind, load = both.candidates
    wind = replace(wind, identification=Identification(companions=others))
    values = {"wind.size": 1.0, "payload.size": 1e-3}
    best = replace(both, candidates=(wind, load), fit=replace(both.fit, values=values))
    assert sorted(c.name for c in answer(best, nominal=1.5).claims) == names
