"""Decision on one log: names, sets and refusals, on models whose fits are written down."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.effects.identification import Identification
from seals.sysid import diagnosis
from seals.sysid.candidates.parameters import Candidate, CandidateSet, Parameter
from seals.sysid.decision import data_sheet, evidence, reasons_against
from seals.sysid.decision.answer import Claim, verdict_of
from seals.sysid.decision.data_sheet import with_data_sheet
from seals.sysid.decision.evidence import EvidenceAnswer, decide
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.decision.verdict import Verdict
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.report.sentence import sentence
from seals.sysid.scores.channels import ChannelErrors
from seals.sysid.scores.disturbance_level import DisturbanceLevel
from seals.sysid.scores.held_out import explained_by_log, held_out_by_log
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, is_significant
from seals.sysid.scores.self_check import SelfCheck
from seals.sysid.selection.search import Search
from seals.sysid.selection.shortlist import better_known

OBSERVED = 1000
NAMES = ("wind", "payload", "tether", "buoyancy")
POLICY = DecisionPolicy()


def model(names: Sequence[str], *, misfit: float, score: float) -> EvidenceHypothesis:
    """A model with a misfit per number observed, and its score against the nominal one."""
    keys = {f"{n}.size": Parameter(key=f"{n}.size") for n in NAMES}
    candidates = tuple(Candidate(name=n, keys=(f"{n}.size",)) for n in NAMES)
    fit = Fit(
        free=(),
        keys=(),
        values={},
        cost=misfit * OBSERVED,
        misfit=np.full(10, misfit * OBSERVED / 10.0),
        normal=np.zeros((10, 0, 0)),
        right=np.zeros((10, 0)),
        precision=np.zeros(0),
        centre=np.zeros(0),
        penalty=0.0,
    )
    fitter: Any = SimpleNamespace(
        windows=SimpleNamespace(observed=OBSERVED, count=10),
        plant=SimpleNamespace(vehicle=SimpleNamespace(written=False)),
        candidate_set=CandidateSet(effects={}, parameters=keys, candidates=candidates),
    )
    chosen = tuple(c for n in names for c in candidates if c.name == n)
    return EvidenceHypothesis(candidates=chosen, fit=fit, fitter=fitter, score=score)


@pytest.fixture(autouse=True)
def calm(monkeypatch: pytest.MonkeyPatch) -> None:
    """Gusts as stated, and a log that shows everything."""
    level = DisturbanceLevel(level=1.0, gain=0.0, allowance=0.0, between=1.0)
    monkeypatch.setattr(evidence, "disturbance_level", lambda best: level)
    monkeypatch.setattr(evidence, "self_check", lambda best: None)
    monkeypatch.setattr(evidence, "channel_errors", lambda *given: ChannelErrors())
    monkeypatch.setattr(evidence, "stated_misfit", lambda nominal: nominal.misfit)
    monkeypatch.setattr(evidence, "held_out_misfit", lambda best: best.misfit)
    monkeypatch.setattr(evidence, "holds_zero", lambda claim: False)
    monkeypatch.setattr(
        evidence, "expected_gains", lambda base, more=1.0: dict.fromkeys(NAMES, 1e3)
    )


def answer(
    best: EvidenceHypothesis,
    *,
    nominal: float,
    others: Sequence[EvidenceHypothesis] = (),
    logs: Sequence[Any] = (),
) -> EvidenceAnswer:
    """Decide on a search whose stated model has a given misfit."""
    base = model((), misfit=nominal, score=0.0)
    rounds = (tuple(sorted((best, *others), key=lambda h: -h.score)),)
    found = Search(nominal=base, best=best, rounds=rounds if best.candidates else ())
    problem: Any = SimpleNamespace(
        policy=POLICY,
        impact=False,
        samples=SimpleNamespace(posed=True, logs=logs),
        vehicle=SimpleNamespace(simulated_step=None, assumed=False),
    )
    return decide(problem, found)


def test_an_effect_far_ahead_is_named() -> None:
    """Fifty points ahead of every other."""
    best = model(["wind"], misfit=1.0, score=200.0)
    said = answer(best, nominal=1.3, others=[model(["tether"], misfit=1.06, score=150.0)])
    assert said.verdict is Verdict.named
    assert [c.name for c in said.claims] == ["wind"]
    assert said.claims[0].confidence > 0.99
    assert said.claims[0].alike == ()


def test_a_smaller_model_is_known_by_its_best_fit() -> None:
    """What it reached on its own counts, of the same effects only."""
    worse, other = (
        model(["wind"], misfit=1.2, score=68.0),
        model(["tether"], misfit=1.0, score=99.0),
    )
    better = model(["wind"], misfit=1.1, score=92.0)
    assert better_known(worse, [other, better]) is better
    assert better_known(better, [other, worse]) is better
    assert better_known(worse, [other]) is worse


def test_a_rival_within_the_gap_makes_a_set_of_both() -> None:
    """Two points between them: odds of e to one, and neither is named alone."""
    best = model(["payload"], misfit=1.0, score=200.0)
    rival = model(["buoyancy"], misfit=1.0, score=198.0)
    said = answer(best, nominal=1.3, others=[rival])
    assert said.verdict is Verdict.ambiguous
    assert said.claims[0].rivals == ("buoyancy",)
    assert said.claims[0].confidence == pytest.approx(math.e / (1.0 + math.e))


def test_a_rival_beyond_the_gap_is_mentioned_beside_the_name() -> None:
    """Six points: told apart, and listed as similar."""
    best = model(["payload"], misfit=1.0, score=200.0)
    said = answer(best, nominal=1.3, others=[model(["buoyancy"], misfit=1.0, score=194.0)])
    assert said.verdict is Verdict.named
    assert said.claims[0].rivals == ()
    assert said.claims[0].alike == ("buoyancy",)


def test_a_set_holds_four_names_at_most() -> None:
    """A set that names everything says nothing."""
    best = model(["payload"], misfit=1.0, score=200.0)
    others = [model([n], misfit=1.0, score=199.0) for n in NAMES if n != "payload"]
    assert len({"payload", *answer(best, nominal=1.3, others=others).claims[0].rivals}) == 4


@pytest.mark.parametrize(
    ("rivals", "verdict"),
    [
        ([(), ()], Verdict.named),
        ([("tether",), ()], Verdict.ambiguous),
        ([("tether",), ("payload",)], Verdict.ambiguous),
    ],
)
def test_one_tie_rule_for_one_log_and_for_several(
    rivals: list[tuple[str, ...]], verdict: Verdict
) -> None:
    """Ambiguous where a claim has rivals; evidence and cross-validation share the rule."""
    from seals.sysid.decision import cross_validation

    best = model(["wind", "buoyancy"], misfit=1.0, score=200.0)
    claims = [
        Claim(hypothesis=best, index=k, confidence=0.5, rivals=r) for k, r in enumerate(rivals)
    ]
    assert verdict_of(claims) is verdict
    assert evidence.verdict_of is cross_validation.verdict_of is verdict_of


def test_no_name_while_many_floors_of_misfit_remain() -> None:
    """A buoy in waves: an effect ten thousands of points ahead at 7,350 floors explains nothing."""
    best = model(["payload"], misfit=7350.0, score=5e4)
    said = answer(best, nominal=99600.0)
    assert said.verdict is Verdict.none_of_these
    assert not said.claims
    assert "7.35e+03 times the noise floor" in said.reasons[0]


@pytest.mark.parametrize(
    ("along_axes", "whole", "verdict"),
    [
        ((0.3, 0.1), (0.2, 0.1), Verdict.named),
        ((0.9, 0.3), (0.4, 0.3), Verdict.named),
        ((0.1, 0.2), (1.2, 0.1), Verdict.none_of_these),
        ((0.9, 0.1), (0.4, 0.1), Verdict.none_of_these),
    ],
)
def test_a_drag_of_a_third_power_is_not_named(
    monkeypatch: pytest.MonkeyPatch,
    along_axes: tuple[float, float],
    whole: tuple[float, float],
    verdict: Verdict,
) -> None:
    """Half a power more than the second, in the speed along each axis or in that of the whole."""
    found = iter([along_axes, whole])
    monkeypatch.setattr(reasons_against, "_own_squares", lambda best, candidate: None)
    monkeypatch.setattr(reasons_against, "_by_axis", lambda best, candidate: True)
    monkeypatch.setattr(reasons_against, "fitted_change", lambda *given: next(found))
    best = model(["wind"], misfit=1.0, score=500.0)
    law = Identification(family="drag", power=2)
    drag = replace(best.candidates[0], identification=law)
    told = answer(replace(best, candidates=(drag,)), nominal=2.0)
    assert told.verdict is verdict
    assert told.verdict is Verdict.named or "with the power" in told.reasons[0]


def test_an_error_without_any_effect_is_not_nothing_missing() -> None:
    """Where no effect is accepted the misfit itself decides."""
    assert answer(model((), misfit=1.02, score=0.0), nominal=1.02).verdict is (
        Verdict.nothing_missing
    )
    assert answer(model((), misfit=20.0, score=0.0), nominal=20.0).verdict is Verdict.none_of_these


def test_an_inexact_model_bounds_the_confidence() -> None:
    """At two floors a name stands only where it explains nine tenths, and no surer than that."""
    sure = answer(model(["wind"], misfit=2.0, score=1e5), nominal=41.0)
    share = (41.0 - 2.0) / (41.0 - POLICY.noise_floor)
    assert sure.verdict is Verdict.named
    assert sure.claims[0].confidence == pytest.approx(share)
    poor = answer(model(["wind"], misfit=2.0, score=1e5), nominal=4.0)
    assert poor.verdict is Verdict.none_of_these
    assert "explains 66 % of the excess" in poor.reasons[0]


@pytest.mark.parametrize(("share", "verdict"), [(0.1, Verdict.named), (0.8, Verdict.cannot_tell)])
def test_the_engine_s_own_error_bounds_the_confidence(
    share: float, verdict: Verdict, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fit that misses its own simulation by a share of the gain is less sure by that share."""
    check = SelfCheck(error={"wind.size": 0.3}, gain=share * 0.3 * OBSERVED)
    monkeypatch.setattr(evidence, "self_check", lambda best: check)
    said = answer(model(["wind"], misfit=1.0, score=250.0), nominal=1.3)
    assert said.verdict is verdict
    if said.claims:
        assert said.claims[0].confidence == pytest.approx(1.0 - share)
        assert said.claims[0].hypothesis.fit.error == {"wind.size": 0.3}
    else:
        assert "misses wind in a simulation that holds it, by 80 % of its gain" in said.reasons[0]


SIDES = Identification(data_sheet="thrust and mass")


def sided(
    names: Sequence[str], *, score: float, together: float, monkeypatch: pytest.MonkeyPatch
) -> EvidenceHypothesis:
    """A model of sides of one proportion, and the score of the stated value alone."""
    best = model((), misfit=1.0, score=score)
    candidates = tuple(
        Candidate(
            name=n, keys=(f"{n}.size",), identification=Identification() if n == "wind" else SIDES
        )
        for n in names
    )
    sheet = Candidate(name="payload", keys=("mass.mass",), law="data sheet", identification=SIDES)
    candidate_set = replace(best.fitter.candidate_set, data_sheet=(sheet,))
    fitter: Any = SimpleNamespace(
        windows=best.fitter.windows, candidate_set=candidate_set, fit=lambda keys, start: best.fit
    )
    monkeypatch.setattr(
        data_sheet,
        "scored",
        lambda candidates, fit, fitter, nominal: EvidenceHypothesis(
            candidates=candidates, fit=fit, fitter=fitter, score=together
        ),
    )
    return EvidenceHypothesis(candidates=candidates, fit=best.fit, fitter=fitter, score=score)


def sheet_answer(best: EvidenceHypothesis, *, water: bool) -> list[tuple[Any, ...]]:
    """Names of the claims with their rivals and those that resemble them."""
    claims = [Claim(hypothesis=best, index=k, confidence=1.0) for k in range(len(best.candidates))]
    problem: Any = SimpleNamespace(policy=POLICY, vehicle=SimpleNamespace(has_water=water))
    base = model((), misfit=1.3, score=0.0)
    made = with_data_sheet(problem, Search(nominal=base, best=best), claims)
    return [(c.name, c.rivals, c.alike) for c in made]


def test_thrust_and_inertia_that_one_wrong_mass_explains_are_a_set(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A data sheet with a mass 20 % off: one number does what two effects do."""
    names = ["thrust_coefficient", "inertia"]
    best = sided(names, score=500.0, together=510.0, monkeypatch=monkeypatch)
    assert sheet_answer(best, water=False) == [("payload", tuple(names), tuple(names))]
    beside = sided(["wind", *names], score=500.0, together=498.0, monkeypatch=monkeypatch)
    assert [c[0] for c in sheet_answer(beside, water=False)] == ["payload", "wind"]


def test_thrust_and_inertia_that_no_mass_explains_stay_two(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pair that the mass alone explains worse is what it is."""
    names = ["thrust_coefficient", "inertia"]
    best = sided(names, score=500.0, together=480.0, monkeypatch=monkeypatch)
    assert [c[0] for c in sheet_answer(best, water=False)] == names


def test_a_thrust_in_air_may_be_the_mass_of_the_data_sheet(monkeypatch: pytest.MonkeyPatch) -> None:
    """Named, with the payload beside it; under water buoyancy tells the two apart."""
    best = sided(["thrust_coefficient"], score=500.0, together=0.0, monkeypatch=monkeypatch)
    assert sheet_answer(best, water=False) == [("thrust_coefficient", (), ("payload",))]
    assert sheet_answer(best, water=True) == [("thrust_coefficient", (), ())]
    load = sided(["payload"], score=500.0, together=0.0, monkeypatch=monkeypatch)
    assert sheet_answer(load, water=False) == [("payload", (), ())]


@pytest.mark.parametrize(("changed", "told"), [(1.5, True), (4.0, False)])
def test_no_name_where_the_data_sheet_must_give_way(
    changed: float, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A force is left over and the stated numbers are four tolerances apart: none of these."""
    level = DisturbanceLevel(level=5.0, gain=500.0, allowance=0.0, between=5.0)
    monkeypatch.setattr(evidence, "disturbance_level", lambda best: level)
    best = model(["wind"], misfit=1.0, score=5000.0)
    stated = {
        "mass.mass": Parameter(key="mass.mass", tolerance=0.1),
        "inertia.delta_xx": Parameter(key="inertia.delta_xx", tolerance=0.2),
    }
    known = best.fitter.candidate_set
    best.fitter.candidate_set = replace(known, parameters={**known.parameters, **stated})
    values = {"mass.mass": -0.1 * changed, "inertia.delta_xx": 0.2 * changed}
    best = replace(best, fit=replace(best.fit, values=values))
    said = answer(best, nominal=6.0)
    assert (said.verdict is Verdict.named) is told
    if not told:
        assert said.verdict is Verdict.none_of_these
        assert "4.0 tolerances" in said.reasons[0]


def test_what_a_law_does_not_resolve_is_not_named() -> None:
    """Neither is an effect below the least size that it declares, nor one of an impossible sign."""
    best = model(["wind"], misfit=1.0, score=500.0)
    (candidate,) = best.candidates
    (key,) = candidate.keys
    known = best.fitter.candidate_set
    least = replace(known.parameters[key], least=0.1)
    sets = replace(known, parameters={**known.parameters, key: least})
    for size, named in ((0.09, False), (-0.11, True)):
        fit = replace(best.fit, values={key: size})
        assert is_significant(candidate, fit, sets) is named
        assert is_significant(candidate, fit, known)
    adds = replace(known.parameters[key], bounds=(0.0, math.inf))
    sets = replace(known, parameters={**known.parameters, key: adds})
    for size, named in ((-0.11, False), (0.11, True)):
        assert is_significant(candidate, replace(best.fit, values={key: size}), sets) is named


@pytest.mark.parametrize(("blind", "advice"), [(("inertia",), True), ((), False)])
def test_more_motion_is_advised_only_where_motion_was_missing(
    blind: tuple[str, ...], advice: bool
) -> None:
    """A fit that misses its own simulation is not mended by a livelier flight."""
    answer = SimpleNamespace(verdict=Verdict.cannot_tell, reasons=("why",), blind=blind)
    held = {"stated": 1.0, "before": 1.0, "after": 1.0}
    empty = {"fitted": [], "effects": [], "channels": [], "stated_wrong": []}
    table = {**empty, "held_out_error": held}
    found: Any = SimpleNamespace(
        answer=answer, held_out=held, to_dict=lambda: table, given_log="log=a", given_robot=""
    )
    first = sentence(found).splitlines()[0]
    assert first == "Cannot tell: why." + " Move the vehicle more." * advice


def test_every_effect_that_was_fitted_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """A third effect that is too uncertain to be named stands in the answer and on the console."""
    monkeypatch.setattr(diagnosis, "parameters", lambda *given: {})
    best = model(["wind", "payload", "tether"], misfit=1.0, score=200.0)
    claims = tuple(Claim(hypothesis=best, index=k, confidence=0.9) for k in range(2))
    level = DisturbanceLevel(level=1.0, gain=0.0, allowance=0.0, between=1.0)
    base = model((), misfit=1.3, score=0.0)
    found = diagnosis.Diagnosis(
        problem=SimpleNamespace(samples=SimpleNamespace(logs=())),  # type: ignore[arg-type]
        search=Search(nominal=base, best=best),
        answer=EvidenceAnswer(
            verdict=Verdict.named, claims=claims, disturbance_level=level, explained=1.0
        ),
        held_out={"stated": 9.0, "before": 1.3, "after": 1.0, "noise_floor": 1.0},
        seconds=1.0,
    )
    monkeypatch.setattr(diagnosis.Diagnosis, "nominal", lambda self: {})
    monkeypatch.setattr(diagnosis.Diagnosis, "covariance", lambda *given: {})
    monkeypatch.setattr(diagnosis.Diagnosis, "logs", ())
    table = found.to_dict()
    assert [(e["name"], e["named"]) for e in table["fitted"]] == [
        ("wind", True),
        ("payload", True),
        ("tether", False),
    ]
    assert "too uncertain or small to be named: tether" in sentence(found)
    refused = replace(found, answer=replace(found.answer, verdict=Verdict.none_of_these, claims=()))
    assert sentence(refused).count("nearest of the library") == 3


def of_three_logs(*misfit: float) -> EvidenceHypothesis:
    """A model with the misfit of each of six windows, two to a log, five readings each."""
    found: Any = model((), misfit=1.0, score=0.0)
    rows = 10 * np.arange(6)[:, None] + np.arange(10)
    spans = tuple(SimpleNamespace(first=20 * k, last=20 * k + 20) for k in range(3))
    keys = {"normal": np.zeros((6, 0, 0)), "right": np.zeros((6, 0)), "misfit": np.array(misfit)}
    fit = replace(found.fit, keys=(), precision=np.zeros(0), centre=np.zeros(0), **keys)
    windows = SimpleNamespace(count=6, rows=rows, freedom=np.full(6, 5))
    plant = SimpleNamespace(samples=SimpleNamespace(logs=spans, rows=60))
    known = found.fitter.candidate_set
    fitter: Any = SimpleNamespace(windows=windows, plant=plant, candidate_set=known)
    return EvidenceHypothesis(candidates=(), fit=fit, fitter=fitter, score=0.0)


def test_the_misfit_of_each_log_is_that_of_its_windows() -> None:
    """Three logs of two windows: held-out misfit over the readings of their own windows."""
    given = of_three_logs(4.0, 6.0, 10.0, 10.0, 33.0, 27.0)
    assert held_out_by_log(given).tolist() == [1.0, 2.0, 6.0]


def test_a_log_that_keeps_its_misfit_bounds_the_confidence(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two logs are explained, the third keeps three quarters of its excess: 25 % at most."""
    nominal = of_three_logs(50.0, 50.0, 80.0, 80.0, 105.0, 105.0)
    best = of_three_logs(5.0, 5.0, 5.0, 5.0, 80.0, 80.0)
    assert explained_by_log(nominal, best).tolist() == [1.0, 1.0, 0.25]
    assert explained_by_log(best, nominal).tolist() == [0.0, 0.0, 0.0]
    nearly = of_three_logs(5.0, 5.0, 7.0, 7.0, 5.0, 5.0)
    assert explained_by_log(nominal, nearly).tolist() == [1.0, 1.0, 1.0]
    monkeypatch.setattr(evidence, "explained_by_log", lambda *two: np.array([1.0, 1.0, 0.25]))
    found = model(["wind"], misfit=1.3, score=500.0)
    alone = answer(found, nominal=9.0).claims[0].confidence
    logs = (SimpleNamespace(), SimpleNamespace(), SimpleNamespace())
    assert alone > 0.99
    assert answer(found, nominal=9.0, logs=logs).claims[0].confidence == 0.25


@pytest.mark.parametrize(("between", "told"), [(1.5, True), (1.6, False)])
def test_gusts_within_their_accuracy_are_no_force_left_over(
    between: float, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Stated to a factor of two, 1.5 times 1.3 of them may be there, and 1.6 times may not."""
    level = DisturbanceLevel(level=1.5, gain=60.0, allowance=60.0, between=between)
    monkeypatch.setattr(evidence, "disturbance_level", lambda best: level)
    said = answer(model(["wind"], misfit=1.0, score=500.0), nominal=1.06)
    assert said.explained < 0.9
    assert (said.verdict is Verdict.named) is told
    assert told or "1.6 times the stated gusts" in said.reasons[0]


@pytest.mark.parametrize(
    ("names", "lost", "said"),
    [
        (["tether"], [0], []),
        (["wind", "tether"], [1], ["wind"]),
        (["wind", "tether"], [], ["tether", "wind"]),
    ],
)
def test_a_pull_toward_a_point_that_is_not_located_is_no_name(
    names: list[str], lost: list[int], said: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Alone it is refused; beside another effect that one is named."""
    monkeypatch.setattr(evidence, "unlocated", lambda best: lost)
    monkeypatch.setattr(evidence, "rivals_of", lambda *given, **more: [])
    found = answer(model(names, misfit=1.0, score=200.0), nominal=1.3)
    assert sorted(c.name for c in found.claims) == said
    assert (found.verdict is Verdict.none_of_these) == (not said)
