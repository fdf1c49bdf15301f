"""Effects that begin or end: where they act, what that does to the misfit, and their times."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.effects.identification import Identification
from seals.schema import read
from seals.sysid.candidates.activity import ACTIVE, Activity, Moment, Span
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.data.samples import Samples
from seals.sysid.data.vehicle import read_vehicle
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.predictors.activity_equations import ActivityEquations, Blocks, activity_equations
from seals.sysid.predictors.normal_equations import newton_step
from seals.sysid.predictors.problem import linearise_model
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.scores.held_out import folds_of
from seals.sysid.selection import onsets
from seals.sysid.selection.change_points import ChangePointSearch, LogPlaces, Part
from seals.sysid.validation.answer import ActiveSpan
from tests.unit.test_diagnose_along import described, waving

POLICY = DecisionPolicy()
WIND = Candidate(
    name="breeze",
    keys=("breeze.speed",),
    identification=Identification(may_begin=True, may_end=True),
)


def at(value: float) -> Moment:
    """A moment without doubt."""
    return Moment(value=value, low90=value, high90=value)


def timed(rows: int, step: float = 0.1) -> Samples:
    """Samples of nothing but time."""
    none = np.zeros((rows, 0))
    return Samples(
        time=5.0 + np.arange(rows) * step,
        step=step,
        runs=((0, rows),),
        channels={},
        command=none,
        voltage=None,
        joint_command=none,
    )


def test_a_window_of_time_covers_rows_and_shares_of_steps() -> None:
    """Rows count at their moment, steps by the share of them in which the effect acts."""
    activity = Activity(spans=(Span(log=0, start=at(5.125), end=at(5.35)),))
    assert activity.weights(timed(6)).tolist() == [0.0, 0.0, 1.0, 1.0, 0.0, 0.0]
    shares = activity.weights(timed(6), over_steps=True)
    assert shares == pytest.approx([0.0, 0.75, 1.0, 0.5, 0.0, 0.0])


def test_an_effect_acts_in_no_log_that_is_not_listed() -> None:
    """Without a span there is no row; with an open one, every row."""
    assert not Activity(spans=()).weights(timed(4)).any()
    assert Activity(spans=(Span(log=0),)).weights(timed(4)).all()


def test_the_other_times_of_an_effect() -> None:
    """What began in one log ended in the complement; a window of time has no single complement."""
    begun = Activity(spans=(Span(log=0, start=at(3.0)), Span(log=2)), occam_factor=7.0)
    other = begun.complement(3)
    assert other is not None
    assert other.spans == (Span(log=0, end=at(3.0)), Span(log=1))
    assert other.occam_factor == 7.0
    assert other.complement(3) == begun
    assert Activity(spans=(Span(log=0, start=at(1.0), end=at(2.0)),)).complement(1) is None


def test_an_activity_is_read_as_it_was_written() -> None:
    """The entry of an answer holds all of it."""
    activity = Activity(spans=(Span(log=1, end=Moment(value=9.0, low90=8.9, high90=9.2)),))
    (written,) = activity.to_list(["a", "b"])
    assert list(written) == ["log", "start", "end"]
    found = read(ActiveSpan, written, where="")
    assert found == ActiveSpan(log="b", start=None, end=activity.spans[0].end)


@pytest.fixture(scope="module")
def fitter() -> Fitter:
    """A linearisation in the air with windows."""
    return linearise_model(*waving(read_vehicle(described(None))), {}, window=0.5)


@pytest.mark.parametrize("name", ["payload_second", "wind", "weak_rotor_2", "gyroscope_bias"])
@pytest.mark.parametrize("offset", [0, 17])
def test_times_change_the_misfit_as_the_model_says(fitter: Fitter, name: str, offset: int) -> None:
    """Equations of parts of windows give the fall of the misfit that the model itself gives."""
    every = fitter.candidate_set.candidates
    candidate = next(c for c in every if c.instance == name)
    row = int(fitter.windows.rows[1, 0]) + offset
    begin = float(fitter.plant.samples.time[row])
    acting = candidate.acting(Activity(spans=(Span(log=0, start=at(begin)),)))
    own = fitter.acting([acting])
    assert own.plant.activity.keys() == set(acting.all_keys)
    expected = newton_step(own.start(acting.all_keys))[1] - newton_step(own.start(()))[1]
    equations = activity_equations(fitter, fitter.start(()), candidate, (0, 17))
    places = LogPlaces(equations, equations.windows_of_logs()[0])
    place = places.offsets + (1 if offset else 0)
    assert places.time[place] == pytest.approx(begin)
    fall, _ = equations.fall(places.block(Part(start=place))[None])
    throughout, _ = equations.fall(places.whole[None])
    assert abs(throughout[0] - expected) > 0.01 * expected
    # columns of the model smear a beginning over half a row
    assert abs(fall[0] - expected) < 0.25 * abs(throughout[0] - expected)


def test_an_effect_outside_its_times_changes_nothing(fitter: Fitter) -> None:
    """Values of an effect that begins after a row leave the prediction of that row alone."""
    candidate = next(c for c in fitter.candidate_set.candidates if c.name == "wind")
    activity = Activity(spans=(Span(log=0, start=at(0.5), end=at(1.0)),))
    acting = candidate.acting(activity)
    own = fitter.acting([acting])
    moved = own.prediction({acting.keys[0]: 3.0}).defect
    throughout = own.prediction({candidate.keys[0]: 3.0}).defect
    still = own.prediction({}).defect
    assert moved[:50] == pytest.approx(still[:50], abs=1e-15)
    assert moved[100:] == pytest.approx(still[100:], abs=1e-15)
    assert moved[50:100] == pytest.approx(throughout[50:100], abs=1e-15)
    assert np.abs(throughout - still)[50:100].max() > 1e-6


def test_what_acts_for_a_time_comes_on_top_of_a_tolerance(fitter: Fitter) -> None:
    """The tolerance of the same quantity holds throughout, the effect while it acts."""
    weak = next(c for c in fitter.candidate_set.candidates if c.name == "weak_rotor")
    acting = weak.acting(Activity(spans=(Span(log=0, start=at(0.5)),)))
    plant = fitter.plant.acting([acting])
    own, active = weak.keys[0], acting.keys[0]
    applied = plant.applied({own: 0.01, active: 0.1}, 300)
    assert set(applied) == {own}
    assert applied[own][:150] == pytest.approx([0.01] * 50 + [0.11] * 100)
    assert applied[own][150:] == pytest.approx(applied[own][:150])
    assert active == own + ACTIVE


def scalar(signal: Any, logs: int = 1, noise: float = 0.0, seed: int = 4) -> ActivityEquations:
    """Equations of one strength in windows of ten rows, of an effect that did ``signal``."""
    rows = len(signal)
    rng = np.random.default_rng(seed)
    seen = signal + noise * rng.standard_normal(rows)
    windows = np.arange(rows).reshape(-1, 10)
    spans = tuple(
        SimpleNamespace(first=k * rows // logs, last=(k + 1) * rows // logs) for k in range(logs)
    )
    samples = SimpleNamespace(time=np.arange(rows) * 0.1, step=0.1, rows=rows, logs=spans)
    fitter: Any = SimpleNamespace(
        windows=SimpleNamespace(rows=windows), plant=SimpleNamespace(samples=samples)
    )

    def blocks(acts: Any) -> Blocks:
        right = np.stack([(seen[windows] * a).sum(axis=1) for a in acts], axis=1)[:, :, None]
        own = np.stack([np.full(len(windows), a.sum()) for a in acts], axis=1)[:, :, None, None]
        return Blocks(cross=np.zeros((*right.shape[:2], 1, 1)), own=own, right=right)

    starts = [(np.arange(10) >= r).astype(float) for r in range(10)]
    return ActivityEquations(
        fitter=fitter,
        offsets=np.arange(10.0),
        on=blocks(starts),
        off=blocks([1.0 - s for s in starts]),
        normal=np.eye(1),
        gradient=np.zeros(1),
        precision=np.full(1, 1e-9),
        at=np.zeros(1),
    )


def found(equations: ActivityEquations, candidate: Candidate = WIND) -> Any:
    """Times of an effect."""
    return ChangePointSearch(equations, candidate, POLICY).run()


@pytest.mark.parametrize(("first", "last"), [(73, 200), (0, 128), (61, 117)])
def test_a_beginning_and_an_end_are_found_to_the_row(first: int, last: int) -> None:
    """A strong effect is placed where it acts, and its strength is that while it acts."""
    acts = (np.arange(200) >= first) & (np.arange(200) < last)
    result = found(scalar(3.0 * acts, noise=0.5))
    (span,) = result.activity.spans
    assert (span.start is None) == (first == 0)
    assert (span.end is None) == (last == 200)
    if span.start is not None:
        assert span.start.value == pytest.approx(0.1 * first)
        assert span.start.low90 <= 0.1 * first <= span.start.high90
    if span.end is not None:
        assert span.end.value == pytest.approx(0.1 * last)
    assert result.values[0] == pytest.approx(3.0, abs=0.2)


def test_a_constant_effect_gets_no_times() -> None:
    """Neither noise nor a strength that differs by a tenth makes an effect begin."""
    assert found(scalar(np.full(200, 3.0), noise=1.0)).activity is None
    uneven = np.where(np.arange(200) < 80, 3.3, 3.0)
    result = found(scalar(uneven, noise=1.0))
    assert result.activity is None or result.gain < result.throughout


def test_noise_gets_no_times() -> None:
    """The best of all times in noise is not worth their price."""
    for seed in range(12):
        result = found(scalar(np.zeros(400), noise=1.0, seed=seed))
        assert result.activity is None or result.gain < POLICY.screen


def test_each_log_has_its_own_times() -> None:
    """An effect may act throughout in one log, not at all in another, and begin in a third."""
    signal = np.concatenate([np.full(100, 2.0), np.zeros(100), np.where(np.arange(100) < 44, 0, 2)])
    result = found(scalar(signal, logs=3, noise=0.5))
    spans = {s.log: s for s in result.activity.spans}
    assert set(spans) == {0, 2}
    assert spans[0] == Span(log=0)
    assert spans[2].start is not None
    assert spans[2].start.value == pytest.approx(20.0 + 4.4)


def test_what_cannot_end_only_begins() -> None:
    """A part that breaks stays broken: an end is no choice where the effect declares none."""
    breaks = Candidate(
        name="crack", keys=("crack.size",), identification=Identification(may_begin=True)
    )
    signal = 3.0 * (np.arange(200) < 90)
    result = found(scalar(signal, noise=0.5), breaks)
    assert result.activity is None or all(s.end is None for s in result.activity.spans)


def test_no_held_out_part_holds_all_of_an_effect() -> None:
    """Windows in which an effect acts are dealt out to all parts; without times they are blocks."""
    rows = np.arange(200).reshape(-1, 10)
    samples = timed(200)
    fitter = SimpleNamespace(
        windows=SimpleNamespace(rows=rows, count=len(rows)), plant=SimpleNamespace(samples=samples)
    )
    acting = WIND.acting(Activity(spans=(Span(log=0, end=at(5.0 + 5.04)),)))
    early: Any = SimpleNamespace(fitter=fitter, candidates=(acting,))
    throughout: Any = SimpleNamespace(fitter=fitter, candidates=(WIND,))
    assert set(folds_of(early)[:5]) == set(range(5))
    assert folds_of(throughout).tolist() == np.repeat(np.arange(5), 4).tolist()


@pytest.mark.parametrize("other_wins", [False, True])
@pytest.mark.parametrize("processes", [1, 2])
def test_last_times_are_found_side_by_side(
    monkeypatch: pytest.MonkeyPatch, processes: int, *, other_wins: bool
) -> None:
    """Sharper times follow the other times where those do better, with one process or two."""
    spans = [(Span(log=0, start=at(t), end=None),) for t in (2.0, 3.0, 3.5, 2.5)]
    known, other, sharp_other, sharp = (Activity(spans=s) for s in spans)

    def model(activity: Activity) -> Any:
        fitter = SimpleNamespace(acting=lambda candidates: None)
        return SimpleNamespace(candidates=(WIND.acting(activity),), fit=activity, fitter=fitter)

    def sharpened(_: object, best: Any) -> Any:
        return model(sharp if best.candidates[0].activity == known else sharp_other)

    def complemented(_: object, best: Any) -> Any:
        return model(other) if other_wins and best.fit == known else best

    monkeypatch.setattr(onsets, "may_act_for_a_time", lambda *_: False)
    monkeypatch.setattr(onsets, "_complemented", complemented)
    monkeypatch.setattr(onsets, "sharpened", sharpened)
    monkeypatch.setattr(onsets, "scored", lambda c, fit, *_: SimpleNamespace(candidates=c, fit=fit))
    no_log: Any = None
    found = onsets.retimed(no_log, no_log, model(known), processes=processes)
    assert found.candidates[0].activity == found.fit == (sharp_other if other_wins else sharp)
