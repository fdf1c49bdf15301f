"""Effects that a fit does without, and the uncertainty of one whose windows differ."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.sysid.candidates.activity import Activity, Moment, Span
from seals.sysid.decision.required_evidence import required_evidence
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.whitened import Whitened
from seals.sysid.predictors.windows_fit import is_determined
from seals.sysid.scores.held_out import fall_by, held_out_fall
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection import onsets, window_models
from seals.sysid.selection.onsets import ends_with_start
from seals.sysid.selection.search import Refinement
from seals.sysid.selection.window_models import WindowModels
from tests.unit.test_diagnose_decision import POLICY, model


def linear(columns: np.ndarray, measured: np.ndarray, windows: int) -> EvidenceHypothesis:
    """Least squares of unit noise on columns, in windows of equal length."""
    count = columns.shape[1]
    precision = np.full(count, 1e-6)
    value = np.linalg.solve(columns.T @ columns + np.diag(precision), columns.T @ measured)
    rest = (measured - columns @ value).reshape(windows, -1)
    parts = columns.reshape(windows, -1, count)
    keys = tuple(f"k.{i}" for i in range(count))
    fit = Fit(
        free=keys,
        keys=keys,
        values=dict(zip(keys, value.tolist(), strict=True)),
        cost=float((rest**2).sum()),
        misfit=(rest**2).sum(axis=1),
        normal=np.einsum("wki,wkj->wij", parts, parts),
        right=np.einsum("wki,wk->wi", parts, rest),
        precision=precision,
        centre=np.zeros(count),
        penalty=0.0,
    )
    windows_of: Any = SimpleNamespace(observed=measured.size, count=windows)
    fitter: Any = SimpleNamespace(windows=windows_of)
    return EvidenceHypothesis(candidates=(), fit=fit, fitter=fitter, score=0.0)


def test_held_out_windows_tell_an_effect_from_what_one_stretch_resembles() -> None:
    """A slope acts throughout; a force in one window only is followed by a free one there."""
    rng = np.random.default_rng(5)
    windows, rows = 10, 40
    slope, guess = rng.standard_normal((2, windows * rows))
    burst = np.zeros(windows * rows)
    burst[:rows] = 6.0 * guess[:rows]
    measured = 0.5 * slope + burst + rng.standard_normal(windows * rows)
    without = linear(guess[:, None] * 0.0, measured, windows)
    alone = linear(slope[:, None], measured, windows)
    both = linear(np.stack([slope, guess], axis=1), measured, windows)
    assert held_out_fall(without, alone) > 30.0
    assert alone.fit.cost - both.fit.cost > 100.0
    assert held_out_fall(alone, both) < 0.0


@pytest.mark.parametrize(
    ("misfit", "sound"),
    [((5.0, 0.0), True), ((1e9, -1e-3), True), ((5.0, -1.0), False), ((np.inf, 1.0), False)],
)
def test_a_misfit_below_zero_is_no_fit(misfit: tuple[float, float], sound: bool) -> None:
    """A window whose squares come out negative has run out of digits, and never wins."""
    assert is_determined(np.array(misfit)) is sound


@pytest.fixture(autouse=True)
def whole_share(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every effect lowers the misfit by itself, unless a test says how much."""
    monkeypatch.setattr(window_models, "fall_by", lambda found, effect: 0.5)


def family(gust: float) -> WindowModels:
    """A family of models of a log with some level of gusts."""
    made = WindowModels.__new__(WindowModels)
    vehicle = SimpleNamespace(gust=np.array([gust, 0.0]), lag=np.zeros(0))
    made.problem = SimpleNamespace(policy=POLICY, vehicle=vehicle)  # type: ignore[assignment]
    return made


def test_an_effect_that_changes_its_mind_along_the_log_is_superfluous() -> None:
    """Of either sign from block to block: the fit gains a little, held-out windows lose more."""
    rng = np.random.default_rng(8)
    column = rng.standard_normal(4000)
    noise = rng.standard_normal(4000)
    for sizes, kept in ((0.5, True), (np.repeat([0.5, -0.5, 0.6, -0.5, 0.3], 800), False)):
        measured = sizes * column + noise
        none = linear(column[:, None] * 0.0, measured, 10)
        one = linear(column[:, None], measured, 10)
        assert none.fit.cost - one.fit.cost > 10.0
        assert family(0.2)._bears_out(none, one) is kept


def test_a_superfluous_effect_pays_what_a_further_one_must() -> None:
    """Twice the evidence of a single one; for a time, a share of what the others explain."""
    one = model(["wind"], misfit=1.0, score=10000.0)
    passing = one.candidates[0].acting(Activity(spans=()))
    made = family(0.2)
    made.problem.vehicle.servo = {}  # type: ignore[attr-defined]

    def needed(added: Any, floats: bool = False) -> float:
        surface: Any = SimpleNamespace(floats=True) if floats else None
        return required_evidence(made.problem, one, added, surface_error=surface)

    least = POLICY.evidence + POLICY.evidence_further
    assert needed(one.candidates[0]) == least
    more = needed(one.candidates[0], floats=True) - least - POLICY.evidence_surface
    assert more == pytest.approx(POLICY.first_order_error * 10000.0)
    more = needed(passing) - needed(one.candidates[0])
    assert more == pytest.approx(POLICY.activity_share * 10000.0)


@pytest.mark.parametrize(("alone", "kept"), [((10.0, 10.0), "wind"), ((10.0, 500.0), "payload")])
def test_an_effect_of_no_size_is_superfluous(
    alone: tuple[float, float], kept: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even where the fits without it got stuck elsewhere and score far less.

    Beside a twin the other one is, where the one of no size alone does better.
    """
    both = model(["wind", "payload"], misfit=1.0, score=9000.0)
    wind, load = both.candidates
    sizes = {**dict.fromkeys(wind.keys, 5.0), **dict.fromkeys(load.keys, 0.0)}
    both = replace(both, fit=replace(both.fit, values={**both.fit.values, **sizes}))
    pairs = zip(both.candidates, alone, strict=True)
    smaller = [replace(both, candidates=(c,), score=score) for c, score in pairs]
    made = family(0.2)
    made._surface_error = None
    made.processes, made.nominal = 1, both
    made.problem.vehicle.servo = {}  # type: ignore[attr-defined]
    monkeypatch.setattr(WindowModels, "_bears_out", lambda *given: True)
    monkeypatch.setattr(window_models, "fitted", lambda *given, **named: smaller)
    assert [c.name for c in made._without_superfluous(both, [])[0].candidates] == [kept]


def test_an_effect_that_hardly_lowers_the_error_is_superfluous(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A score of hundreds, from a law that is not quite exact, and 0.5 % of the misfit."""
    both = model(["wind", "payload"], misfit=1.0, score=9000.0)
    sizes = dict.fromkeys((k for c in both.candidates for k in c.keys), 5.0)
    both = replace(both, fit=replace(both.fit, values={**both.fit.values, **sizes}))
    smaller = [replace(both, candidates=(c,), score=10.0) for c in both.candidates]
    made = family(0.2)
    made._surface_error = None
    made.processes, made.nominal = 1, both
    made.problem.vehicle.servo = {}  # type: ignore[attr-defined]
    monkeypatch.setattr(WindowModels, "_bears_out", lambda *given: True)
    monkeypatch.setattr(window_models, "fitted", lambda *given, **named: smaller)
    falls = {"wind": 0.5, "payload": 0.005}
    monkeypatch.setattr(window_models, "fall_by", lambda found, effect: falls[effect.name])
    assert [c.name for c in made._without_superfluous(both, [])[0].candidates] == ["wind"]


@pytest.mark.parametrize(("lowered", "share"), [(0.0, 0.0), (2.0, 0.8)])
def test_what_an_effect_lowers_is_counted_with_all_else_as_fitted(
    lowered: float, share: float
) -> None:
    """Without it a residual of 1 is sqrt(1 + 2^2) at every reading: 1 - 1 / 5 of the misfit."""
    found = model(["wind"], misfit=1.0, score=50.0)
    (wind,) = found.candidates

    def misfit(values: dict[str, float]) -> Whitened:
        size = 1.0 if values[wind.keys[0]] else math.sqrt(1.0 + lowered**2)
        return Whitened(
            outputs=np.full((3, 4, 1), size),
            absorbed=np.zeros((3, 1, 1)),
            cross=np.zeros((3, 1, 1)),
        )

    fitter: Any = SimpleNamespace(misfit=misfit)
    values = {**found.fit.values, wind.keys[0]: 2.0}
    known = replace(found, fitter=fitter, fit=replace(found.fit, values=values))
    assert fall_by(known, wind) == pytest.approx(share)


def test_a_smaller_model_is_judged_about_its_own_values(monkeypatch: pytest.MonkeyPatch) -> None:
    """A load taken up under water had a change of added mass beside it, of no use to the fit."""
    both = model(["wind", "payload"], misfit=1.0, score=9000.0)
    sizes = dict.fromkeys((k for c in both.candidates for k in c.keys), 5.0)
    both = replace(both, fit=replace(both.fit, values={**both.fit.values, **sizes}))
    scores = {"wind": 8900.0, "payload": 10.0}
    smaller = [replace(both, candidates=(c,), score=scores[c.name]) for c in both.candidates]
    made = family(0.2)
    made._surface_error = None
    made.processes, made.nominal = 1, both
    made.problem.vehicle.servo = {}  # type: ignore[attr-defined]
    repeated: list[str] = []

    def about_own_values(problem: Any, nominal: Any, found: Any) -> EvidenceHypothesis:
        repeated.append(found.label)
        return replace(found, score=9010.0)  # type: ignore[no-any-return]

    monkeypatch.setattr(WindowModels, "_bears_out", lambda *given: True)
    monkeypatch.setattr(window_models, "fitted", lambda *given, **named: smaller)
    monkeypatch.setattr(window_models, "refit_about_own_values", about_own_values)
    assert [c.name for c in made._without_superfluous(both, [])[0].candidates] == ["wind"]
    assert repeated == ["wind"]  # the other is too far behind


@pytest.mark.parametrize("pair", [False, True])
def test_a_load_is_tried_at_the_times_of_the_effect_that_was_found(
    monkeypatch: pytest.MonkeyPatch, *, pair: bool
) -> None:
    """No linear screen about zero finds it; an effect for a time may be its shadow."""
    found = model(["wind", "buoyancy"] if pair else ["wind"], misfit=1.0, score=100.0)
    passing = found.candidates[0].acting(Activity(spans=((1.0, 2.0),)))
    values = dict.fromkeys(("wind.size", "buoyancy.size"), 3.0)
    fit = replace(found.fit, values=values)
    found = replace(found, candidates=(passing, *found.candidates[1:]), fit=fit)
    every = {c.name: c for c in found.fitter.candidate_set.candidates}
    load = replace(every["payload"], starts=((0.5,),))
    made = family(0.2)
    made.processes, made.nominal = 1, found
    made.problem.plant = SimpleNamespace(  # type: ignore[misc]
        candidate_set=SimpleNamespace(candidates=(passing.throughout, load))
    )
    tried: list[Any] = []

    def fit_all(fitter: Any, jobs: Any, *rest: Any, **more: Any) -> list[EvidenceHypothesis]:
        tried.extend(jobs)
        return [replace(found, candidates=job[0], score=150.0) for job in jobs]

    monkeypatch.setattr(window_models, "fitted", fit_all)
    monkeypatch.setattr(onsets, "may_act_for_a_time", lambda problem, candidate: True)
    monkeypatch.setattr(window_models, "retimed", lambda problem, nominal, best, **more: best)
    monkeypatch.setattr(WindowModels, "_release", lambda *models: None)
    monkeypatch.setattr(WindowModels, "_bears_out", lambda *models: True)
    made.problem.budget = SimpleNamespace(paired=0)  # type: ignore[misc]
    step = Refinement.pairs if pair else Refinement.backward
    best, _ = made.refined(found, [], step)
    *others, chosen = best.candidates
    assert chosen.name == "payload"
    assert chosen.activity == passing.activity
    assert [c.name for c in others] == (["buoyancy"] if pair else [])
    # what stays keeps its value
    assert [list(job[1].values()) for job in tried] == [[3.0, 0.5] if pair else [0.5]]


@pytest.mark.parametrize("borne_out", [True, False])
def test_a_single_effect_for_a_time_is_borne_out_by_held_out_windows(
    monkeypatch: pytest.MonkeyPatch, *, borne_out: bool
) -> None:
    """Where they contradict it, nothing is missing; a model without effects stays as it is."""
    found = model(["wind"], misfit=1.0, score=60.0)
    passing = found.candidates[0].acting(Activity(spans=((1.0, 2.0),)))
    found, none = replace(found, candidates=(passing,)), replace(found, candidates=(), score=0.0)
    made = family(0.2)
    made.processes, made.nominal = 1, none
    monkeypatch.setattr(window_models, "in_place_of_timed", lambda *given: [])
    monkeypatch.setattr(window_models, "fitted", lambda *given, **named: [])
    monkeypatch.setattr(WindowModels, "_bears_out", lambda *models: borne_out)
    assert made.refined(none, [], Refinement.backward)[0] is none
    assert made.refined(found, [], Refinement.backward)[0] is (found if borne_out else none)


def test_an_effect_for_a_time_that_brings_too_little_hides_no_constant_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The share of what is explained that one for a time must bring is asked of it alone."""
    base = model(["wind"], misfit=1.0, score=10_000.0)
    both = [model(["wind", name], misfit=1.0, score=10_300.0) for name in ("payload", "tether")]
    passing = both[0].candidates[-1].acting(Activity(spans=((1.0, 2.0),)))
    timed = replace(both[0], candidates=(base.candidates[0], passing), score=10_400.0)
    made = family(0.2)
    made.processes, made.nominal, made._surface_error = 1, base, None
    made.problem.vehicle.servo = {}  # type: ignore[attr-defined]
    made.problem.plant = SimpleNamespace(candidate_set=None)  # type: ignore[misc]
    made.problem.impact = False  # type: ignore[misc]
    made.problem.samples = SimpleNamespace(posed=True)  # type: ignore[misc]
    monkeypatch.setattr(window_models, "converged", lambda problem, nominal, best: best)
    monkeypatch.setattr(window_models, "is_significant", lambda *given: True)
    monkeypatch.setattr(window_models, "retimed", lambda problem, nominal, best, **more: best)
    level = SimpleNamespace(allowance=0.0)
    monkeypatch.setattr(window_models, "disturbance_level", lambda best: level)
    assert made._accepted(base, [timed, both[1]])[0] is both[1]
    assert made._accepted(base, [timed])[0] is None


def test_errors_below_the_stated_noise_prove_no_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """A simulated log without noise or gusts: what is left at 0.6 floors is the simulator's."""
    quiet, noisy = (model((), misfit=m, score=0.0) for m in (0.6, 1.0))
    left: list[Any] = []
    monkeypatch.setattr(
        window_models, "channel_errors", lambda *given: SimpleNamespace(outside=tuple(left))
    )

    def settled(gust: float, base: EvidenceHypothesis) -> bool:
        made = family(gust)
        made.nominal = base
        return made.settled(base)

    assert settled(0.0, quiet)
    assert not settled(0.0, noisy)
    # gusts that are weaker than stated lower a misfit as well
    assert not settled(0.2, quiet)
    # a channel that is left over is no noise, however quiet the others
    left.append("position x")
    assert not settled(0.0, quiet)


def test_windows_that_scatter_more_than_noise_widen_the_interval() -> None:
    """Gradients of the windows three times as large as noise makes them: three times as wide."""
    rng = np.random.default_rng(7)
    column = rng.standard_normal(4000)
    factor = np.repeat(rng.standard_normal(40) * 3.0, 100)
    wrong = linear(column[:, None], factor * column * 0.1, 40)
    right = linear(column[:, None], rng.standard_normal(4000), 40)
    key = "k.0"
    assert right.fit.robust_spread(key) == pytest.approx(right.fit.spread(key), rel=0.3)
    # each window has a value of its own, 0.3 from that of the others
    assert wrong.fit.robust_spread(key) == pytest.approx(0.3 / math.sqrt(40.0), rel=0.3)
    assert wrong.fit.robust_spread(key) > 2.0 * wrong.fit.spread(key)


def test_parameters_that_act_alike_are_told_with_their_covariance() -> None:
    """Closed form of two columns at an angle; what widens an interval is the parameter's own."""
    rng = np.random.default_rng(11)
    first, other = rng.standard_normal((2, 4000))
    columns = np.stack([first, 0.8 * first + 0.6 * other], axis=1)
    fit = linear(columns, rng.standard_normal(4000), 40).fit
    # (X^T X)^-1 has the correlation of its columns with the other sign
    exact = np.linalg.inv(columns.T @ columns)
    found = fit.joint_covariance(("k.0", "k.1"), (0.5, fit.robust_spread("k.1")))
    size = [fit.robust_spread(key) for key in ("k.0", "k.1")]
    wanted = exact[0, 1] / math.sqrt(exact[0, 0] * exact[1, 1])
    assert wanted == pytest.approx(-0.8, abs=0.03)
    assert found[0, 1] / (size[0] * size[1]) == pytest.approx(wanted, abs=1e-3)
    assert np.diag(found) == pytest.approx([0.25, size[1] ** 2])
    held = replace(fit, known={"k.0": 0.5}).joint_covariance(("k.0", "k.1"), (0.5, size[1]))
    np.testing.assert_allclose(held, np.diag([0.25, size[1] ** 2]))


def test_the_usual_form_of_a_law_stays_where_it_leaves_nothing() -> None:
    """A form with more numbers counts where the usual one leaves more than a tenth of noise."""
    usual = model(["buoyancy"], misfit=1.05, score=900.0)
    form = replace(usual.candidates[0], law="both", keys=("buoyancy.size", "buoyancy.square"))
    richer = replace(usual, candidates=(form,), score=1500.0)
    other = model(["wind"], misfit=3.0, score=10.0)
    assert window_models.plainest([richer, usual, other], trusted=1.1) == (usual, other)
    bad = replace(usual, fit=replace(usual.fit, misfit=2.0 * usual.fit.misfit))
    assert window_models.plainest([richer, bad, other], trusted=1.1) == (richer, bad, other)


def test_an_effect_in_the_start_of_slow_actuators_is_none() -> None:
    """A lag of 0.2 s beside a stated 0.05 s: the first second and a window are not its own."""
    one = model(["buoyancy"], misfit=1.0, score=100.0)

    def until(end: float, change: float) -> bool:
        moment = Moment(value=end, low90=end, high90=end)
        timed = one.candidates[0].acting(Activity(spans=(Span(log=0, end=moment),)))
        samples = SimpleNamespace(time=np.arange(0.0, 30.0, 0.02), step=0.02, rows=1500, logs=())
        parameters: dict[str, Any] = {}
        plant = SimpleNamespace(
            vehicle=SimpleNamespace(lag=np.array([0.05]), fall=None),
            candidate_set=SimpleNamespace(parameters=parameters),
            timing=lambda values: (0.0, values.get("lag", 0.0), 0.0),
            samples=samples,
        )
        problem: Any = SimpleNamespace(vehicle=plant.vehicle, plant=plant, samples=samples)
        windows: Any = SimpleNamespace(length=50)
        fitter: Any = SimpleNamespace(windows=windows)
        fit = replace(one.fit, values={"lag": change})
        slow = replace(one, candidates=(timed,), fitter=fitter, fit=fit)
        return ends_with_start(problem, slow)

    assert until(1.2, change=0.15)
    assert not until(6.0, change=0.15)
    assert not until(1.2, change=0.0)
