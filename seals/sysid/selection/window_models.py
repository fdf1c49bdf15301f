"""Models for the search on one log, fitted to short windows along one trajectory."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision.required_evidence import required_evidence
from seals.sysid.parallel import spread
from seals.sysid.predictors.linear_screen import (
    CandidateEquations,
    candidate_keys,
    linear_gain,
    screen,
)
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.problem import (
    LATE,
    Problem,
    follow_measurements,
    linearise_model,
    rewindowed,
)
from seals.sysid.predictors.surface_model_error import surface_model_error
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.scores.channels import channel_errors
from seals.sysid.scores.disturbance_level import disturbance_level
from seals.sysid.scores.held_out import fall_by, held_out_fall, held_out_misfit
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, is_significant, scored
from seals.sysid.selection.initial_guesses import initial_guesses
from seals.sysid.selection.nominal_model import about_other_numbers, estimate_disturbance
from seals.sysid.selection.onsets import (
    ends_with_start,
    in_place_of_timed,
    may_act_for_a_time,
    of_one_cause,
    proposals,
    retimed,
)
from seals.sysid.selection.relinearised import (
    along_own_trajectory,
    converged,
    refit_about_own_values,
    relinearise,
    repeat_worse_fits,
)
from seals.sysid.selection.search import Refinement, Search
from seals.sysid.selection.shortlist import Job, better_known, fitted, refined


class WindowModels:
    """Models of a log fitted to short windows, scored by their Laplace evidence.

    Args:
        problem: of the log.
        processes: that share the fits.
    """

    def __init__(self, problem: Problem, *, processes: int = 1) -> None:
        self.problem, self.processes = problem, processes
        self.nominal = estimate_disturbance(problem)
        trajectory = self.nominal.fitter.trajectory
        self._surface_error = surface_model_error(problem.plant, trajectory)

    def extended(
        self, base: EvidenceHypothesis, singles: Sequence[EvidenceHypothesis]
    ) -> tuple[EvidenceHypothesis, ...]:
        """Fit all models with one more effect; the first round also refits the stated model."""
        problem, processes = self.problem, self.processes
        tried = extensions(problem, self.nominal, base, singles=singles, processes=processes)
        tried = plainest(tried, trusted=problem.policy.plain_form)
        if problem.impact and not base.candidates:
            self.nominal, tried = _refit_nominal(problem, self.nominal, tried, processes=processes)
        elif tried and not base.candidates and problem.samples.posed:
            # what explains this little may explain the noise that the trajectory follows
            weak = tried[0].score < problem.policy.relinearise
            own = along_own_trajectory(problem, self.nominal) if weak else self.nominal
            if own is not self.nominal:
                self.nominal = own
                tried = extensions(problem, own, own, singles=singles, processes=processes)
                tried = plainest(tried, trusted=problem.policy.plain_form)
            moved = about_other_numbers(problem, self.nominal, tried[0]) if tried else self.nominal
            if moved is not self.nominal:
                self.nominal = moved
                tried = tuple(scored(h.candidates, h.fit, h.fitter, moved) for h in tried)
        return tried

    def accepted(
        self, base: EvidenceHypothesis, tried: Sequence[EvidenceHypothesis]
    ) -> tuple[EvidenceHypothesis | None, Sequence[EvidenceHypothesis]]:
        """Return the best extension where its evidence is strong enough, and where all then stand.

        Those near the best are fitted until they have settled, as that is.
        """
        chosen, further = self._accepted(base, tried)
        stand = sorted((further.get(id(h), h) for h in tried), key=lambda h: -h.score)
        self._release(chosen or base, (base, *tried, *further.values()))
        return chosen, stand

    def _accepted(
        self, base: EvidenceHypothesis, tried: Sequence[EvidenceHypothesis]
    ) -> tuple[EvidenceHypothesis | None, dict[int, EvidenceHypothesis]]:
        candidate_set, policy = self.problem.plant.candidate_set, self.problem.policy
        if self.settled(base):
            return None, {}
        tried = [h for h in tried if is_significant(h.candidates[-1], h.fit, candidate_set)]
        tried = [h for h in tried if not ends_with_start(self.problem, h)]
        if self.problem.vehicle.servo:
            arm = policy.evidence_arm
            tried.sort(key=lambda h: -h.score + (0.0 if h.candidates[-1].in_arm else arm))
        # one for a time must bring more: where it does not, it hides no constant one
        least = {h.label: base.score + self._required(base, h.candidates[-1]) for h in tried}
        best = next((h for h in tried if h.score >= least[h.label]), None)
        if best is None:
            return None, {}
        # stronger gusts, as far as they are admitted, may do as well as the effect
        calm = disturbance_level(base).allowance - disturbance_level(best).allowance
        if best.score - calm < least[best.label]:
            return None, {}
        first, best = best, self._retimed(best)
        if self.problem.impact or not self.problem.samples.posed:
            return best, {}
        further = {id(first): converged(self.problem, self.nominal, best)}
        # a rival that has not settled loses by the way that is left to it
        near = [h for h in tried if h.score >= max(best.score - policy.unsettled, least[h.label])]
        for rival in (h for h in near if h.names != best.names):
            further[id(rival)] = converged(self.problem, self.nominal, rival)
        return max(further.values(), key=lambda h: h.score), further

    def _release(self, best: EvidenceHypothesis, others: Sequence[EvidenceHypothesis]) -> None:
        """Release the linearisations that neither the nominal nor the best model stands on."""
        held = [f.along for f in (self.problem.fitter, self.nominal.fitter, best.fitter)]
        for fitter in (h.fitter for h in others):
            if not any(fitter.along is one for one in held):
                fitter.release()

    def settled(self, base: EvidenceHypothesis) -> bool:
        """Return true if a model's error is below that expected from the stated noise.

        What is left is then no noise, such as the steps of a simulator, and proves nothing; unless
        gusts lower the misfit, or readings without noise hide in it a channel that is left over.
        """
        seen, policy = float(base.fitter.windows.observed), self.problem.policy
        least = policy.noise_floor * seen - policy.standard_errors * math.sqrt(2.0 * seen)
        quiet = base.fit.cost < least and not self.problem.vehicle.gust.any()
        return quiet and not channel_errors(self.nominal, base).outside

    def _required(self, base: EvidenceHypothesis, added: Candidate) -> float:
        return required_evidence(self.problem, base, added, surface_error=self._surface_error)

    def refined(
        self, best: EvidenceHypothesis, singles: Sequence[EvidenceHypothesis], step: Refinement
    ) -> tuple[EvidenceHypothesis, Sequence[EvidenceHypothesis]]:
        """Try pairs or exchanges of effects; return the model with the most evidence.

        Backward: the same without one of its effects, where that one does not pay.
        """
        if step is Refinement.backward:
            return self._without_superfluous(best, singles)
        pairs, trusted = step is Refinement.pairs, self.problem.policy.misfit_trusted
        if pairs and len(best.candidates) == 1 and best.misfit <= trusted:
            return best, ()
        jobs = self._pairs(best, singles) if pairs else _exchanges(best, singles)
        jobs += in_place_of_timed(self.problem, best) if pairs else []
        fitter = self.nominal.fitter if pairs else best.fitter
        tried = fitted(fitter, jobs, self.nominal, best, processes=self.processes)
        before = best
        for rival in (h for h in tried if not ends_with_start(self.problem, h)):
            if rival.score > best.score + self.problem.policy.exchange_gain:
                best = rival
        self._release(best, (before,))
        return best if best is before else self._retimed(best), tried

    def _retimed(self, best: EvidenceHypothesis) -> EvidenceHypothesis:
        """Return the model with better times of its effects."""
        return retimed(self.problem, self.nominal, best, processes=self.processes)

    def _without_superfluous(
        self, best: EvidenceHypothesis, singles: Sequence[EvidenceHypothesis]
    ) -> tuple[EvidenceHypothesis, Sequence[EvidenceHypothesis]]:
        """Drop, one by one, effects below the evidence required of a further one.

        A single one for a time is compared with others at its times first. Nor does one pay that
        has no size, beside which the fit got stuck elsewhere, or that hardly lowers the error.
        """
        jobs = in_place_of_timed(self.problem, best) if len(best.candidates) == 1 else []
        tried = list(fitted(best.fitter, jobs, self.nominal, best, processes=self.processes))
        rival = max(tried, key=lambda h: h.score, default=best)
        if rival.score > best.score + self.problem.policy.exchange_gain:
            best = retimed(self.problem, self.nominal, rival)
        while len(best.candidates) > 1:
            jobs = [
                (rest, {k: best.fit.values[k] for k in candidate_keys(rest)})
                for rest in combinations(best.candidates, len(best.candidates) - 1)
            ]
            smaller = fitted(best.fitter, jobs, self.nominal, best, processes=self.processes)
            smaller = [self._on_its_own(better_known(h, singles), best) for h in smaller]
            tried += smaller
            left = [next(c for c in best.candidates if c not in h.candidates) for h in smaller]
            known = best.fitter.candidate_set
            idle = [not is_significant(added, best.fit, known) for added in left]
            spare = [
                h
                for h, added, sizeless in zip(smaller, left, idle, strict=True)
                if sizeless
                or best.score - h.score < self._required(h, added)
                or not self._bears_out(h, best)
                or fall_by(best, added) < self.problem.policy.error_falls
            ]
            if not spare:
                break
            fewer = max(spare, key=lambda h: h.score)
            # beside a twin, such as a delay beside a lag, the right one may be without a size
            twins = any(sizeless for h, sizeless in zip(smaller, idle, strict=True) if h is fewer)
            best = max(smaller, key=lambda h: h.score) if twins else fewer
        if len(best.candidates) > 1:
            best, one = self._of_one_cause(best)
            tried += one
        alone = len(best.candidates) == 1 and best.candidates[0].activity is not None
        if alone and not self._bears_out(self.nominal, best):
            best = self.nominal
        return best, tried

    def _of_one_cause(
        self, best: EvidenceHypothesis
    ) -> tuple[EvidenceHypothesis, list[EvidenceHypothesis]]:
        """Return one effect in place of several that begin and end together, where it does as well.

        Its fit about the values of the others is rough: those that are not far behind are repeated.
        """
        jobs = of_one_cause(self.problem, best)
        tried = fitted(best.fitter, jobs, self.nominal, best, processes=self.processes)
        tried = [
            refit_about_own_values(self.problem, self.nominal, h)
            for h in sorted(tried, key=lambda h: -h.score)[: self.problem.budget.relinearised]
        ]
        rival = max(tried, key=lambda h: h.score, default=best)
        if rival.score > best.score:
            return self._retimed(rival), tried
        return best, tried

    def _on_its_own(
        self, smaller: EvidenceHypothesis, larger: EvidenceHypothesis
    ) -> EvidenceHypothesis:
        """Repeat a fit that is not far behind a larger model about its own values, as that was."""
        added = next(c for c in larger.candidates if c not in smaller.candidates)
        behind = larger.score - smaller.score - self._required(smaller, added)
        if not 0.0 <= behind < self.problem.policy.behind:
            return smaller
        own = refit_about_own_values(self.problem, self.nominal, smaller)
        return max(smaller, own, key=lambda h: h.score)

    def _bears_out(self, smaller: EvidenceHypothesis, larger: EvidenceHypothesis) -> bool:
        """Return false if held-out windows contradict the effect added in ``larger``.

        They do where they lose more by it than the fit gains. An effect that acts in one stretch
        only, as an impact does, gains nothing on the others and loses nothing.
        """
        seen = larger.fitter.windows.observed
        gain = smaller.fit.cost - larger.fit.cost - smaller.fitter.windows.observed + seen
        misfit = held_out_misfit(larger)
        if misfit > self.problem.policy.misfit_trusted and gain < (misfit - 1.0) * seen:
            return False
        return bool(held_out_fall(smaller, larger) > -gain)

    def _pairs(self, best: EvidenceHypothesis, singles: Sequence[EvidenceHypothesis]) -> list[Job]:
        """Combine the likeliest effects in pairs, which a third effect may hide.

        The effect that was found beside the first joins them.
        """
        pool, singles = self.problem.budget.paired, _likeliest(singles)
        top = [h for h in singles[:pool] if h.score > 0.0]
        second = best.candidates[-1].label
        top += [h for h in singles[pool:] if h.candidates[-1].label == second]
        pairs = [(a, b) for i, a in enumerate(top) for b in top[i + 1 :] if a.names != b.names]
        known = set(best.names)
        return [
            (
                (*a.candidates, *b.candidates),
                {k: h.fit.values[k] for h in (a, b) for k in h.fit.free},
            )
            for a, b in pairs
            if {*a.names, *b.names} != known
        ]


def plainest(
    tried: Sequence[EvidenceHypothesis], *, trusted: float
) -> tuple[EvidenceHypothesis, ...]:
    """Leave out forms with more numbers than the usual form of a law that leaves little.

    A power of the speed between the first and the second is no law of its own: its equivalent in
    the usual form is what is known of such a vehicle and what other models state.

    Args:
        tried: models with one more effect each.
        trusted: misfit per degree of freedom up to which the usual form does.
    """

    def key(candidate: Candidate) -> tuple[object, ...]:
        activity = None if candidate.activity is None else candidate.activity.spans
        return candidate.name, tuple(sorted(candidate.variant.items())), activity

    usual = {
        key(h.candidates[-1]): len(h.candidates[-1].keys)
        for h in tried
        if not h.candidates[-1].law and h.misfit <= trusted
    }
    most = [usual.get(key(h.candidates[-1]), math.inf) for h in tried]
    return tuple(h for h, n in zip(tried, most, strict=True) if len(h.candidates[-1].keys) <= n)


def _likeliest(singles: Sequence[EvidenceHypothesis]) -> list[EvidenceHypothesis]:
    """Keep the better fit of each effect, constant or limited in time; best first."""
    chosen: dict[str, EvidenceHypothesis] = {}
    for single in singles:
        chosen.setdefault(single.candidates[-1].throughout.label, single)
    return list(chosen.values())


def _exchanges(best: EvidenceHypothesis, singles: Sequence[EvidenceHypothesis]) -> list[Job]:
    """Return the fits in which another effect replaces one of those found before the last."""
    jobs: list[Job] = []
    taken = set(best.names)
    for k in range(len(best.candidates) - 1):
        others = best.candidates[:k] + best.candidates[k + 1 :]
        for single in _likeliest(singles)[: best.fitter.candidate_set.budget.paired]:
            candidate = single.candidates[-1]
            if candidate.name not in taken:
                jobs.append(_beside(best, others, single))
    return jobs


def _beside(
    best: EvidenceHypothesis, others: Sequence[Candidate], single: EvidenceHypothesis
) -> Job:
    """Return one effect beside others of the best model, with the present values."""
    candidate = single.candidates[-1]
    values = {**best.fit.values, **{k: single.fit.values[k] for k in candidate.all_keys}}
    return (*others, candidate), values


def _refit_nominal(
    problem: Problem,
    nominal: EvidenceHypothesis,
    tried: tuple[EvidenceHypothesis, ...],
    *,
    processes: int = 1,
) -> tuple[EvidenceHypothesis, tuple[EvidenceHypothesis, ...]]:
    """Refit the stated model on the trajectory of the best extension, then the best extensions.

    A strong effect is fitted along a trajectory that follows it. Where it only led to a better one
    through an impact, it must not take the credit; of its fits along both the better one stays.
    """
    if not tried or tried[0].fitter.trajectory is nominal.fitter.trajectory:
        return nominal, tried
    level = nominal.fitter.windows.gusts
    fitter = linearise_model(problem.plant, tried[0].fitter.trajectory, {}, gusts=level)
    fitter = follow_measurements(fitter, (), rounds=2)
    moved = EvidenceHypothesis(candidates=(), fit=fitter.fit(()), fitter=fitter, score=0.0)
    if moved.fit.cost > nominal.fit.cost - problem.policy.relinearise:
        return nominal, tried
    own = [h for h in tried if h.fitter.trajectory is not nominal.fitter.trajectory]
    found = [scored(h.candidates, h.fit, h.fitter, moved) for h in own]
    found += extensions(problem, moved, moved, processes=processes)
    best = {h.label: h for h in sorted(found, key=lambda h: h.score)}
    return moved, tuple(sorted(best.values(), key=lambda h: -h.score))


def extensions(
    problem: Problem,
    nominal: EvidenceHypothesis,
    base: EvidenceHypothesis,
    *,
    singles: Sequence[EvidenceHypothesis] = (),
    processes: int = 1,
) -> tuple[EvidenceHypothesis, ...]:
    """Fit all models with one more effect than ``base``, best first.

    What starts elsewhere than at zero and was likely alone, among ``singles``, is fitted whatever
    the linear screen says: a lag has no slope at zero beside other effects either.
    """
    candidate_set = problem.plant.candidate_set
    taken = {c.label for c in base.candidates}
    families = {c.name for c in base.candidates}
    candidates = [
        c for c in candidate_set.candidates if c.label not in taken and c.name not in families
    ]
    noisy = disturbance_level(base)
    missing = noisy.level > 1.0 and noisy.gain > problem.policy.disturbance_search
    regular = [c for c in candidates if not c.identification.guessed]
    uncertain = [c.name for c in regular if c.identification.always_fitted]
    likely = [h.candidates[-1].name for h in singles if h.score > problem.policy.evidence]
    apart = [c.name for c in regular if c.starts and c.name in likely]
    table, first = linear_screen(base, regular, always=[*apart, *(uncertain if missing else ())])
    first += (timed := proposals(problem, base, regular, table, processes=processes))
    jobs = [(c, begin) for c, values in first for begin in (values, *_starts_of(c, base))]
    if missing:
        jobs += _as_alone(base, regular, singles)
        jobs += initial_guesses(problem, base, candidates)
        # the strongest of those for a time may stand for one that needs a guess
        for activity in [c.activity for c, _ in timed[:1]]:
            changing = [c for c in candidates if may_act_for_a_time(problem, c)]
            jobs += initial_guesses(problem, base, changing, activity)

    late = candidate_set.sensor_delay
    plain = _shifted(base.fitter, 0.0)
    if any(not begin.get(late) for _, begin in jobs):
        plain.prepare()

    def seen_by(candidate: Candidate, begin: Mapping[str, float]) -> Fitter:
        delay = begin.get(late, 0.0)
        fitter = _shifted(base.fitter, delay) if delay else plain
        return fitter.acting((*base.candidates, candidate))

    def work(job: tuple[Candidate, Mapping[str, float]]) -> Fit:
        keys = candidate_keys((*base.candidates, job[0]))
        return seen_by(*job).fit(keys, start=job[1], coarse=True)

    fits = spread(work, jobs, processes)
    chosen: dict[str, tuple[Candidate, Fit, Fitter]] = {}
    for (candidate, begin), fit in zip(jobs, fits, strict=True):
        known = chosen.get(candidate.label)
        if known is None or fit.cost < known[1].cost:
            chosen[candidate.label] = (candidate, fit, seen_by(candidate, begin))
    repeat_worse_fits(problem, nominal, base, chosen, processes)
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
    return tuple(relinearise(problem, nominal, base, out, processes=processes))


def _shifted(fitter: Fitter, delay: float) -> Fitter:
    """Return windows shifted by a considerable sensor delay [s]."""
    return rewindowed(fitter, delay=delay) if abs(delay - fitter.windows.delay) > LATE else fitter


def _starts_of(candidate: Candidate, base: EvidenceHypothesis) -> list[dict[str, float]]:
    given = {k: base.fit.values[k] for k in base.fit.free}
    return [given | dict(zip(candidate.all_keys, s, strict=False)) for s in candidate.starts]


def _as_alone(
    base: EvidenceHypothesis, regular: Sequence[Candidate], singles: Sequence[EvidenceHypothesis]
) -> list[tuple[Candidate, dict[str, float]]]:
    """Start further effects at the values of those that explained most alone.

    A response that grows with the square of its number has no slope at zero.
    """
    policy, budget = base.fitter.candidate_set.policy, base.fitter.candidate_set.budget
    labels = {c.label for c in regular}
    likely = [h for h in _likeliest(singles) if h.candidates[-1].label in labels]
    return [
        (h.candidates[-1], {**base.fit.values, **{k: h.fit.values[k] for k in h.fit.free}})
        for h in likely[: budget.paired]
        if h.score > policy.evidence
    ]


def linear_screen(
    base: EvidenceHypothesis, candidates: Sequence[Candidate], *, always: Sequence[str] = ()
) -> tuple[CandidateEquations, list[tuple[Candidate, dict[str, float]]]]:
    """Return the candidates that pass a linear screen about ``base``, with starting values.

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
    astray = base.misfit > policy.misfit_trusted
    most = budget.survivors_further if free else budget.survivors
    kept = [
        (c, v)
        for i, (g, c, v) in enumerate(ranked)
        if c.name in always
        # about zero no linear screen can judge what starts elsewhere
        or (c.starts and (astray or not free))
        or (
            (i < most or (g > top - policy.screen_near and i < 2 * budget.survivors))
            and (g > least or i < spared)
        )
    ]
    return table, kept


def rivals_of(
    search: Search[EvidenceHypothesis], best: EvidenceHypothesis, index: int, *, processes: int = 1
) -> tuple[EvidenceHypothesis, ...]:
    """Fit models in which another effect replaces one of the chosen, best first."""
    own = best.candidates[index]
    singles = [h for h in search.rounds[0] if h.candidates[-1].name != own.name]
    if len(best.candidates) == 1:
        return tuple(singles)
    others = tuple(c for k, c in enumerate(best.candidates) if k != index)
    taken = {c.name for c in best.candidates}
    pool = {h.candidates[-1].label: h for r in search.rounds for h in r}
    ranked = sorted(
        _likeliest(sorted(pool.values(), key=lambda h: -h.score)),
        key=lambda h: (not own.resembles(h.candidates[-1]), -h.score),
    )
    jobs: list[Job] = []
    for single in ranked:
        candidate = single.candidates[-1]
        if candidate.name in taken or len(jobs) >= best.fitter.candidate_set.budget.rivals:
            continue
        jobs.append(_beside(best, others, single))
    found = fitted(best.fitter, jobs, search.nominal, best, processes=processes)
    return tuple(sorted(found, key=lambda h: -h.score))
