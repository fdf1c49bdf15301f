"""Search in windows of one log: effects that explain the residual, alone or together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.least_squares.normal_equations import Fit
from seals.sysid.parallel import spread
from seals.sysid.predictors.linearise import DELAY
from seals.sysid.predictors.plant import nonzero
from seals.sysid.predictors.problem import (
    LATE,
    Problem,
    follow_measurements,
    linearise_model,
    rewindowed,
)
from seals.sysid.predictors.surface_model_error import surface_model_error
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.scores.disturbance_level import disturbance_level
from seals.sysid.scores.laplace_evidence import Hypothesis, is_significant, keys_of, scored
from seals.sysid.selection.initial_guesses import initial_guesses
from seals.sysid.selection.late_sensors import search_own_trajectories
from seals.sysid.selection.linear_screen import (
    CandidateEquations,
    candidate_keys,
    linear_gain,
    screen,
)
from seals.sysid.selection.sensor_delay import estimate_sensor_delay
from seals.sysid.selection.shortlist import Job, fitted, hopeful, refined
from seals.sysid.selection.whole_runs import search_whole_runs

_SETTLED = 2.0


@dataclass(frozen=True, kw_only=True)
class Search:
    """Hypotheses tried by a search.

    Args:
        nominal: the model as it is.
        best: the model that was chosen, the nominal one when no effect stands out.
        rounds: hypotheses of every round, best first.
    """

    nominal: Hypothesis
    best: Hypothesis
    rounds: tuple[tuple[Hypothesis, ...], ...] = field(default=())


def search(
    problem: Problem,
    *,
    processes: int = 1,
    tell: Callable[[int], None] = lambda rounds: None,
) -> Search:
    """Search forward while effects are significant, with exchanges and pairs.

    Args:
        problem: the log made ready.
        processes: that share the fits.
        tell: called with the number of rounds done.
    """
    policy = problem.policy
    unposed = policy.evidence + policy.evidence_unposed
    if problem.impact and not problem.samples.posed:
        asked = unposed
        nominal, best, tried = search_whole_runs(problem, asked, processes=processes, tell=tell)
        return Search(nominal=nominal, best=best, rounds=(tried,))
    nominal, best, rounds = added(problem, processes=processes, tell=tell)
    own = search_own_trajectories(problem, nominal, best, unposed, processes=processes)
    if own is not None:
        # what was tried along another trajectory has no say beside these
        kept = [h for h in rounds[0] if own[0] is nominal and h.names != own[1].names]
        nominal, best, fresh = own
        rounds = [(*fresh, *kept)]
    return Search(nominal=nominal, best=best, rounds=tuple(rounds))


def added(
    problem: Problem, *, processes: int, tell: Callable[[int], None]
) -> tuple[Hypothesis, Hypothesis, list[tuple[Hypothesis, ...]]]:
    """Run the forward search: nominal model, best model, and the hypotheses of every round."""
    nominal = estimate_disturbance(problem)
    best = nominal
    rounds: list[tuple[Hypothesis, ...]] = []
    surface_error = surface_model_error(problem.plant, nominal.fitter.trajectory) is not None
    policy = problem.policy
    for _ in range(problem.budget.effects):
        tried = extensions(problem, nominal, best, processes=processes)
        if problem.impact and not rounds:
            nominal, tried = refit_nominal(problem, nominal, tried, processes=processes)
            best = nominal
        rounds.append(tried)
        tell(len(rounds))
        tried = tuple(
            h for h in tried if is_significant(h.candidates[-1], h.fit, problem.plant.candidate_set)
        )
        if problem.vehicle.servo:
            tried = tuple(
                sorted(
                    tried,
                    key=lambda h: -h.score + (0.0 if _in_the_arm(h) else policy.evidence_arm),
                )
            )
        if not tried:
            break
        asked = policy.evidence + (policy.evidence_surface if surface_error else 0.0)
        asked += policy.evidence_further if best.candidates else 0.0
        approximate = any(c.identification.approximate for c in best.candidates)
        asked += policy.wave_model_error * best.score if approximate else 0.0
        if problem.vehicle.servo and not _in_the_arm(tried[0]):
            asked += policy.evidence_arm
        if tried[0].score < best.score + asked:
            break
        # stronger gusts, as far as they are admitted, may do as well as the effect
        calm = disturbance_level(best).allowance - disturbance_level(tried[0]).allowance
        if tried[0].score - calm < best.score + asked:
            break
        best = tried[0]
        if len(best.candidates) == 2:
            best = paired(nominal, best, rounds[0], processes=processes)
        elif len(best.candidates) > 2:
            best = exchanged(nominal, best, rounds[0], processes=processes)
    return nominal, best, rounds


def refit_nominal(
    problem: Problem, nominal: Hypothesis, tried: tuple[Hypothesis, ...], *, processes: int = 1
) -> tuple[Hypothesis, tuple[Hypothesis, ...]]:
    """Refit the nominal model on the trajectory of the best of some others, and try those again.

    A strong effect is fitted along a trajectory that follows it. Where it only led to a better
    trajectory through an impact, it must not take the credit.
    """
    if not tried or tried[0].fitter.trajectory is nominal.fitter.trajectory:
        return nominal, tried
    level = nominal.fitter.windows.gusts
    fitter = linearise_model(problem.plant, tried[0].fitter.trajectory, {}, gusts=level)
    fitter = follow_measurements(fitter, (), rounds=2)
    moved = Hypothesis(candidates=(), fit=fitter.fit(()), fitter=fitter, score=0.0)
    if moved.fit.cost > nominal.fit.cost - problem.policy.relinearise:
        return nominal, tried
    return moved, extensions(problem, moved, moved, processes=processes)


def _in_the_arm(hypothesis: Hypothesis) -> bool:
    """Return true where the effect that was added last acts in the arm."""
    return hypothesis.candidates[-1].in_arm


def estimate_disturbance(problem: Problem) -> Hypothesis:
    """Fit the nominal model under the most likely level of the gusts within the stated range."""
    fitter = problem.fitter
    nominal = Hypothesis(candidates=(), fit=fitter.fit(()), fitter=fitter, score=0.0)
    at = {k: v for k, v in nominal.fit.values.items() if k != DELAY}
    if problem.plant.friction(nonzero(at), fitter.trajectory.joint_velocity) is not None:
        # the slope of dry friction belongs to the dynamics
        fitter = linearise_model(problem.plant, fitter.trajectory, at, gusts=fitter.windows.gusts)
        nominal = Hypothesis(candidates=(), fit=fitter.fit(()), fitter=fitter, score=0.0)
    found = disturbance_level(nominal)
    if not 1.0 < found.level <= problem.policy.disturbance_admitted:
        return nominal
    fitter = rewindowed(fitter, gusts=found.level)
    return Hypothesis(candidates=(), fit=fitter.fit(()), fitter=fitter, score=0.0)


def extensions(
    problem: Problem, nominal: Hypothesis, base: Hypothesis, *, processes: int = 1
) -> tuple[Hypothesis, ...]:
    """Fit all models with one effect more than ``base``, best first."""
    candidate_set = problem.plant.candidate_set
    taken = {c.label for c in base.candidates}
    families = {c.name for c in base.candidates}
    candidates = [
        c for c in candidate_set.candidates if c.label not in taken and c.name not in families
    ]
    noisy = disturbance_level(base)
    missing = noisy.level > 1.0 and noisy.gain > problem.policy.disturbance_search
    starts = initial_guesses(problem, base) if missing else {}
    regular = [c for c in candidates if not c.identification.guessed]
    uncertain = [c.name for c in regular if c.identification.always_fitted]
    _, first = linear_screen(base, regular, always=uncertain if missing else ())
    jobs = [(c, begin) for c, values in first for begin in (values, *_starts_of(c, base))]
    jobs += [
        (c, begin)
        for c in candidates
        if c.identification.guessed
        for begin in starts.get(c.name, ())
    ]

    def work(job: tuple[Candidate, Mapping[str, float]]) -> Fit:
        keys = keys_of((*base.candidates, job[0]))
        return _shifted(base.fitter, job[1]).fit(keys, start=job[1], coarse=True)

    fits = spread(work, jobs, processes)
    chosen: dict[str, tuple[Candidate, Fit, Fitter]] = {}
    for (candidate, begin), fit in zip(jobs, fits, strict=True):
        known = chosen.get(candidate.label)
        if known is None or fit.cost < known[1].cost:
            chosen[candidate.label] = (candidate, fit, _shifted(base.fitter, begin))
    out = [
        scored((*base.candidates, c), fit, fitter, nominal) for c, fit, fitter in chosen.values()
    ]
    # the first round's runners-up are tried two by two later
    out = refined(
        out,
        nominal,
        base,
        always=0 if base.candidates else problem.budget.paired,
        processes=processes,
    )
    out.sort(key=lambda h: -h.score)
    return tuple(relinearise(problem, nominal, base, out))


def _shifted(fitter: Fitter, start: Mapping[str, float]) -> Fitter:
    """Return windows that follow a late sensor, for starts with a considerable delay."""
    delay = start.get(DELAY, 0.0)
    return rewindowed(fitter, delay=delay) if abs(delay - fitter.windows.delay) > LATE else fitter


def _starts_of(candidate: Candidate, base: Hypothesis) -> list[dict[str, float]]:
    given = {k: base.fit.values[k] for k in base.fit.free}
    return [given | dict(zip(candidate.all_keys, s, strict=False)) for s in candidate.starts]


def linear_screen(
    base: Hypothesis, candidates: Sequence[Candidate], *, always: Sequence[str] = ()
) -> tuple[CandidateEquations, list[tuple[Candidate, dict[str, float]]]]:
    """Return the candidates that pass a linear screen about ``base``, with first values.

    Args:
        base: model that they would extend.
        candidates: to look at.
        always: names that a linear screen cannot judge.
    """
    fitter, free = base.fitter, base.fit.free
    policy, budget = fitter.candidate_set.policy, fitter.candidate_set.budget
    about = fitter.start(free) if not free else base.fit
    table = screen(fitter, about, candidate_keys(candidates))
    common, _ = linear_gain(fitter, table, ())
    ranked = []
    for candidate in candidates:
        gain, values = linear_gain(fitter, table, candidate.all_keys)
        keys = (*free, *candidate.all_keys)
        ranked.append((gain - common, candidate, {k: values[k] for k in keys if k in values}))
    ranked.sort(key=lambda r: -r[0])
    top = ranked[0][0] if ranked else 0.0
    least, spared = (policy.screen_further, 1) if free else (policy.screen, budget.spared)
    most = budget.survivors_further if free else budget.survivors
    kept = [
        (c, v)
        for i, (g, c, v) in enumerate(ranked)
        if c.name in always
        or (
            (i < most or (g > top - policy.screen_near and i < 2 * budget.survivors))
            and (g > least or i < spared)
        )
    ]
    return table, kept


def relinearise(
    problem: Problem, nominal: Hypothesis, base: Hypothesis, tried: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """Repeat the best fits of high evidence about their own values."""
    out = list(tried)
    least = problem.policy.relinearise
    least = max(least, hopeful(out[0].score, base)) if out else least
    for i, hypothesis in enumerate(out[: problem.budget.relinearised]):
        if hypothesis.score > least:
            out[i] = refit_about_own_values(problem, nominal, hypothesis)
    return sorted(out, key=lambda h: -h.score)


def refit_about_own_values(
    problem: Problem, nominal: Hypothesis, hypothesis: Hypothesis, *, rounds: int = 2
) -> Hypothesis:
    """Fit a hypothesis again about its own values."""
    keys = hypothesis.fit.free
    if DELAY in keys and hypothesis.fitter.windows.delay:
        hypothesis = estimate_sensor_delay(nominal, hypothesis)
    fit, fitter = hypothesis.fit, hypothesis.fitter
    known = fit.known
    for _ in range(rounds):
        at = dict(fit.values)
        if problem.samples.posed and not problem.impact:
            level = fitter.windows.gusts
            fitter = linearise_model(problem.plant, fitter.trajectory, at, gusts=level)
        else:
            fitter = follow_measurements(fitter, keys, at=at, rounds=1)
        before, fit = fit, fitter.fit(keys, start=fit.values)
        if abs(before.cost - fit.cost) < _SETTLED:
            break
    return scored(hypothesis.candidates, replace(fit, known=known), fitter, nominal)


def exchanged(
    nominal: Hypothesis,
    best: Hypothesis,
    singles: Sequence[Hypothesis],
    *,
    processes: int = 1,
) -> Hypothesis:
    """Exchange: try other effects in place of each one that was found but the last."""
    jobs = []
    for k in range(len(best.candidates) - 1):
        others = best.candidates[:k] + best.candidates[k + 1 :]
        for single in singles[:5]:
            candidate = single.candidates[-1]
            if candidate.name in {c.name for c in best.candidates}:
                continue
            values = {**best.fit.values, **{x: single.fit.values[x] for x in candidate.all_keys}}
            jobs.append(((*others, candidate), values))
    for rival in fitted(best.fitter, jobs, nominal, best, processes=processes):
        if rival.score > best.score + best.fitter.candidate_set.policy.exchange_gain:
            best = rival
    return best


def paired(
    nominal: Hypothesis,
    best: Hypothesis,
    singles: Sequence[Hypothesis],
    *,
    processes: int = 1,
) -> Hypothesis:
    """Fit the likeliest effects in pairs: a pair may hide behind a third effect.

    The effect that was found beside the first joins them.
    """
    pool = nominal.fitter.candidate_set.budget.paired
    top = [h for h in singles[:pool] if h.score > 0.0]
    second = best.candidates[-1].label
    top += [h for h in singles[pool:] if h.candidates[-1].label == second]
    pairs = [(a, b) for i, a in enumerate(top) for b in top[i + 1 :] if a.names != b.names]
    known = set(best.names)
    pairs = [(a, b) for a, b in pairs if {*a.names, *b.names} != known]
    fitter = nominal.fitter
    jobs = [
        (
            (*a.candidates, *b.candidates),
            {k: h.fit.values[k] for h in (a, b) for k in h.fit.free},
        )
        for a, b in pairs
    ]
    for rival in fitted(fitter, jobs, nominal, best, processes=processes):
        if rival.score > best.score + best.fitter.candidate_set.policy.exchange_gain:
            best = rival
    return best


def rivals_of(
    search: Search, best: Hypothesis, index: int, *, processes: int = 1
) -> tuple[Hypothesis, ...]:
    """Fit models with another effect in the place of one of the chosen, best first."""
    own = best.candidates[index]
    singles = [h for h in search.rounds[0] if h.candidates[-1].name != own.name]
    if len(best.candidates) == 1:
        return tuple(singles)
    others = tuple(c for k, c in enumerate(best.candidates) if k != index)
    taken = {c.name for c in best.candidates}
    pool = {h.candidates[-1].label: h for r in search.rounds for h in r}
    ranked = sorted(pool.values(), key=lambda h: (not own.resembles(h.candidates[-1]), -h.score))
    jobs: list[Job] = []
    for single in ranked:
        candidate = single.candidates[-1]
        if candidate.name in taken or len(jobs) >= best.fitter.candidate_set.budget.rivals:
            continue
        values = {**best.fit.values, **{k: single.fit.values[k] for k in candidate.all_keys}}
        jobs.append(((*others, candidate), values))
    found = fitted(best.fitter, jobs, search.nominal, best, processes=processes)
    return tuple(sorted(found, key=lambda h: -h.score))
