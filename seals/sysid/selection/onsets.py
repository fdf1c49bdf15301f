"""Effects that begin or end within a log: proposals and their times."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from seals.sysid.candidates.activity import Activity, log_rows
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.parallel import spread
from seals.sysid.predictors.activity_equations import activity_equations, coarse_equations
from seals.sysid.predictors.linear_screen import (
    CandidateEquations,
    candidate_keys,
    linear_gain,
)
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.problem import FORGOTTEN, Problem, transient_rows
from seals.sysid.predictors.windows import Windows
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, scored
from seals.sysid.selection.change_points import ChangePoints, ChangePointSearch
from seals.sysid.selection.shortlist import Job

_FINER = ((0.1, 1.0), (0.02, 0.125))
"""Reach about a time [s] and spacing [rows] of the places that are tried, in turn."""
_ROUNDS = 2
"""Times that the times and the values of a model are found in turn."""


def may_act_for_a_time(problem: Problem, candidate: Candidate) -> bool:
    """Return true if an effect may begin or end and the log can show when.

    A fall in one window has no times to compare; delays are no sum of parts of a log, and waves
    not linear in when they act.
    """
    plant = problem.plant
    return (
        candidate.may_change
        and problem.samples.posed
        and not problem.impact
        and candidate.instance not in plant.timed
        and candidate.instance not in plant.candidate_set.waves
        and plant.candidate_set.sensor_delay not in candidate.throughout.all_keys
    )


def ends_with_start(problem: Problem, hypothesis: EvidenceHypothesis) -> bool:
    """Return true if an effect acts in windows alone that begin in the actuators' unknown start.

    The windows leave out that start as far as the stated lag needs it: a lag that was found to be
    longer goes on for longer, and looks like anything that acts on the first rows alone.
    """
    timed = [c.activity for c in hypothesis.candidates if c.activity is not None]
    if not timed or not len(problem.vehicle.lag):
        return False
    lags, samples = problem.vehicle.lag, problem.samples
    _, change, _ = problem.plant.timing(hypothesis.fit.values)
    decayed = FORGOTTEN * (float(np.max(lags)) + max(change, 0.0))
    if decayed <= transient_rows(problem.plant) * samples.step:
        return False
    last = decayed + hypothesis.fitter.windows.length * samples.step
    first = [samples.time[begin] for begin, _ in log_rows(samples)]
    return any(
        all(s.end is not None and s.end.value - first[s.log] <= last for s in activity.spans)
        for activity in timed
    )


def proposals(
    problem: Problem,
    base: EvidenceHypothesis,
    candidates: Sequence[Candidate],
    table: CandidateEquations,
    *,
    processes: int = 1,
) -> list[tuple[Candidate, dict[str, float]]]:
    """Return effects that fit better within a time span than throughout, with starting values.

    Args:
        problem: the log made ready.
        base: model that they would extend.
        candidates: effects to look at.
        table: linear equations of all of them about the base.
        processes: that share the searches for times.
    """
    fitter, policy = base.fitter, problem.policy
    common, _ = linear_gain(fitter, table, ())
    top = max((linear_gain(fitter, table, c.all_keys)[0] - common for c in candidates), default=0.0)
    # one that is far behind the best constant effect imitates it
    least = max(top - policy.behind - policy.behind_share * top, policy.screen_further)
    # what needs a first guess is timed once it is fitted throughout
    timed = [
        c for c in candidates if not c.identification.guessed and may_act_for_a_time(problem, c)
    ]

    def coarse(candidate: Candidate) -> ChangePoints:
        equations = coarse_equations(fitter, table, candidate)
        return ChangePointSearch(equations, candidate, policy).run()

    ranked = [
        (found.gain, c)
        for c, found in zip(timed, spread(coarse, timed, processes), strict=True)
        if found.activity is not None and found.gain > max(found.throughout, least)
    ]
    ranked.sort(key=lambda r: -r[0])
    about = fitter.start(base.fit.free) if not base.fit.free else base.fit

    def fine(candidate: Candidate) -> ChangePoints:
        equations = activity_equations(fitter, about, candidate, _offsets(fitter.windows, policy))
        return ChangePointSearch(equations, candidate, policy).run()

    chosen = [c for _, c in ranked[: problem.budget.changing]]
    out = []
    for candidate, found in zip(chosen, spread(fine, chosen, processes), strict=True):
        if found.activity is not None:
            acting = candidate.acting(found.activity)
            given = {k: base.fit.values[k] for k in base.fit.free}
            out.append((acting, given | _values(acting, found)))
    return out


def in_place_of_timed(problem: Problem, best: EvidenceHypothesis) -> list[Job]:
    """Return effects at the times of those of the best model, in place of one or of all.

    Only those that no linear screen about zero can judge, for they start elsewhere.
    """
    found = [
        c
        for c in problem.plant.candidate_set.candidates
        if c.starts and may_act_for_a_time(problem, c)
    ]
    known = {c.throughout.label for c in best.candidates}
    activities = [(k, c.activity) for k, c in enumerate(best.candidates) if c.activity is not None]
    places = [(a, best.candidates[:k] + best.candidates[k + 1 :]) for k, a in activities]
    if len(activities) == len(best.candidates) > 1:
        places.append((activities[0][1], ()))
    jobs: list[Job] = []
    for activity, others in places:
        for acting in (c.acting(activity) for c in found if c.label not in known):
            # another variant of the same effect gives way
            rest = tuple(c for c in others if c.name != acting.name)
            given = {k: best.fit.values[k] for k in candidate_keys(rest)}
            starts = (dict(zip(acting.all_keys, s, strict=True)) for s in acting.starts)
            jobs += [((*rest, acting), given | start) for start in starts]
    return jobs


def of_one_cause(problem: Problem, best: EvidenceHypothesis) -> list[Job]:
    """Return single effects in place of several that begin and end together.

    They may have one cause, as a weight that is dropped is a lift and a centre of gravity; no
    screen has judged it against both.
    """
    timed = [c.activity for c in best.candidates if c.activity is not None]
    if len(timed) < max(len(best.candidates), 2) or not _together(problem, timed):
        return []
    known = {c.throughout.label for c in best.candidates}
    jobs: list[Job] = []
    for candidate in problem.plant.candidate_set.candidates:
        if candidate.label in known or not may_act_for_a_time(problem, candidate):
            continue
        acting = candidate.acting(timed[0])
        starts = acting.starts or (tuple(0.0 for _ in acting.all_keys),)
        jobs += [((acting,), dict(zip(acting.all_keys, s, strict=True))) for s in starts]
    return jobs


def _together(problem: Problem, activities: Sequence[Activity]) -> bool:
    """Return true for effects that begin and end together, as far as times are resolved."""
    spans = [
        [
            (s.log, s.start.value if s.start else -np.inf, s.end.value if s.end else np.inf)
            for s in activity.spans
        ]
        for activity in activities
    ]
    near = 2.0 * problem.policy.activity_resolution
    return all(
        len(own) == len(spans[0]) and np.allclose(own, spans[0], rtol=0.0, atol=near)
        for own in spans
    )


def retimed(
    problem: Problem, nominal: EvidenceHypothesis, best: EvidenceHypothesis, *, processes: int = 1
) -> EvidenceHypothesis:
    """Refine the times of all effects about the model's own values; keep the better model.

    Args:
        problem: the log made ready.
        nominal: model against which it is scored.
        best: model whose effects may begin or end.
        processes: that share the last fits.
    """
    for _ in range(_ROUNDS):
        before = best
        for k, candidate in enumerate(best.candidates):
            if may_act_for_a_time(problem, candidate):
                best = _retimed(problem, nominal, best, k)
        if best is before:
            break
    # finer times may turn an effect into its complement, as coarse ones may
    return _complemented(nominal, _at_finer_times(nominal, best, processes=processes))


def _at_finer_times(
    nominal: EvidenceHypothesis, best: EvidenceHypothesis, *, processes: int
) -> EvidenceHypothesis:
    """Try each effect at all other times, then refine all times below one row."""
    known = [c.activity for c in best.candidates]
    if processes < 2 or not any(known):
        return sharpened(nominal, _complemented(nominal, best))

    def work(step: _Step) -> tuple[list[Activity | None], Fit]:
        found = step(nominal, best)
        return [c.activity for c in found.candidates], found.fit

    # the other times seldom do better: meanwhile these are sharpened
    steps: tuple[_Step, _Step] = (_complemented, sharpened)
    turned, sharp = spread(work, steps, processes)
    if turned[0] != known:
        return sharpened(nominal, _at_times(nominal, best, *turned))
    return best if sharp[0] == known else _at_times(nominal, best, *sharp)


_Step: TypeAlias = Callable[[EvidenceHypothesis, EvidenceHypothesis], EvidenceHypothesis]


def _at_times(
    nominal: EvidenceHypothesis,
    best: EvidenceHypothesis,
    activities: Sequence[Activity | None],
    fit: Fit,
) -> EvidenceHypothesis:
    """Return a model with times and fit found by another process."""
    pairs = zip(best.candidates, activities, strict=True)
    candidates = tuple(c if a is None else c.acting(a) for c, a in pairs)
    return scored(candidates, fit, best.fitter.acting(candidates), nominal)


def _complemented(nominal: EvidenceHypothesis, best: EvidenceHypothesis) -> EvidenceHypothesis:
    """Try each effect at all other times with the opposite sign; return the better model.

    A fault that begins looks like a stated model off by as much from the first row on, and the
    opposite until then.
    """
    for k, candidate in enumerate(best.candidates):
        if candidate.activity is None:
            continue
        other = candidate.activity.complement(len(log_rows(best.fitter.plant.samples)))
        if other is None:
            continue
        acting = candidate.acting(other)
        candidates = (*best.candidates[:k], acting, *best.candidates[k + 1 :])
        turned = {key: -best.fit.values[key] for key in acting.keys}
        found = _fitted(nominal, best, candidates, turned)
        best = found if found.score > best.score else best
    return best


def _retimed(
    problem: Problem, nominal: EvidenceHypothesis, best: EvidenceHypothesis, k: int
) -> EvidenceHypothesis:
    """Return the model with better times of one effect."""
    candidate, policy = best.candidates[k], problem.policy
    if candidate.activity is None:
        equations = activity_equations(best.fitter, best.fit, candidate, (0,))
        coarse = ChangePointSearch(equations, candidate, policy).run()
        if coarse.activity is None or coarse.gain < coarse.throughout:
            return best
    offsets = _offsets(best.fitter.windows, policy)
    equations = activity_equations(best.fitter, best.fit, candidate, offsets)
    found = ChangePointSearch(equations, candidate, policy).run()
    if found.activity is None or found.activity == candidate.activity:
        return best
    acting = candidate.acting(found.activity)
    candidates = (*best.candidates[:k], acting, *best.candidates[k + 1 :])
    other = _fitted(nominal, best, candidates, _values(acting, found))
    return other if other.score > best.score else best


def sharpened(nominal: EvidenceHypothesis, best: EvidenceHypothesis) -> EvidenceHypothesis:
    """Refine the times of a model's effects below one row."""
    policy = best.fitter.candidate_set.policy
    for reach, spacing in _FINER:
        for k, candidate in enumerate(best.candidates):
            if candidate.activity is None:
                continue
            windows = best.fitter.windows
            near = _near(windows, candidate.activity, reach / windows.samples.step, spacing)
            offsets = sorted({*_offsets(windows, policy), *near})
            equations = activity_equations(best.fitter, best.fit, candidate, offsets, strength=True)
            found = ChangePointSearch(equations, candidate, policy).run()
            if found.activity is None or found.activity == candidate.activity:
                continue
            acting = candidate.acting(
                replace(found.activity, occam_factor=candidate.activity.occam_factor)
            )
            candidates = (*best.candidates[:k], acting, *best.candidates[k + 1 :])
            other = _fitted(nominal, best, candidates, {})
            best = other if other.score > best.score else best
    return best


def _near(windows: Windows, activity: Activity, reach: float, spacing: float) -> set[float]:
    """Offsets inside a window near the times of an activity, in rows."""
    samples, out = windows.samples, set[float]()
    begin = samples.time[windows.rows[:, 0]]
    logs = log_rows(samples)
    for span in activity.spans:
        own = (windows.rows[:, 0] >= logs[span.log][0]) & (windows.rows[:, 0] < logs[span.log][1])
        for moment in (span.start, span.end):
            if moment is None:
                continue
            late = (moment.value - begin[own]) / samples.step
            at = float(late[late >= 0.0].min(initial=windows.length))
            steps = np.arange(-reach, reach + 0.5 * spacing, spacing)
            places = np.round((at + steps) / spacing) * spacing
            # beyond an end of this window lies the next one
            out |= {float(p) for p in places % windows.length}
    return out


def _fitted(
    nominal: EvidenceHypothesis,
    best: EvidenceHypothesis,
    candidates: tuple[Candidate, ...],
    values: Mapping[str, float],
) -> EvidenceHypothesis:
    """Fit a model with other times, starting from the values of a similar one."""
    keys, start = candidate_keys(candidates), {**best.fit.values, **values}
    fitter = best.fitter.acting(candidates)
    fit = fitter.fit(keys, start={k: start[k] for k in keys})
    return scored(candidates, fit, fitter, nominal)


def _values(acting: Candidate, found: ChangePoints) -> dict[str, float]:
    return dict(zip(acting.all_keys, map(float, found.values), strict=True))


def _offsets(windows: Windows, policy: DecisionPolicy) -> list[float]:
    """Rows inside a window at which an effect may begin or end."""
    spacing = max(1, round(policy.activity_resolution / windows.samples.step))
    return [float(k) for k in range(0, windows.length, spacing)]
