"""The search in logs without pose: every effect is fitted to whole runs, along its own course."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from seals.sysid.between import Between
from seals.sysid.factors import Candidate
from seals.sysid.gusts import unrest
from seals.sysid.hypothesis import Hypothesis, keys_of, material, price
from seals.sysid.parallel import spread
from seals.sysid.plant import Plant
from seals.sysid.problem import GUSTS, Problem
from seals.sysid.rough import surface
from seals.sysid.screen import candidate_keys, linear_gain, screen
from seals.sysid.standing import Doubt, Standing, converged, stand
from seals.sysid.trajectory import Course
from seals.sysid.trials import nearest_courses

_COARSE = 2
"""Parts of a row in which plausible runs are simulated."""
_ROUNDS, _FIRST = 10, 2
"""Steps of a fit at most, and before those that fall behind are left."""
_SPARED, _RIVALS = 4, 3
"""Effects that are fitted whatever their linear gain, and rivals that are fitted once more."""
_RANKS = (0, 1, 2, 3, 5, 8)
"""Courses from which the nominal model sets out, by how near their runs came to the readings."""


Pair: TypeAlias = tuple[Candidate, Standing]


class Drops:
    """Fits models of a log of drops, each along a course of its own.

    Args:
        base: the nominal model, fitted.
        outset: the same before the fit; other models set out there when the fit came to nothing.
        processes: that share the fits.
    """

    def __init__(self, base: Standing, outset: Standing, *, processes: int = 1) -> None:
        """Choose where to set out."""
        self.base, self.doubt, self.processes = base, base.doubt, processes
        self.between: Between = base.fitter.between
        self.library = base.fitter.library
        self.policy = self.library.policy
        good = base.fit.cost < self.policy.good_fit * base.fitter.windows.observed
        self._from = base if good else outset

    @property
    def nominal(self) -> Hypothesis:
        """The model without any effect."""
        fit, fitter = self.base.fit, self.base.fitter
        return Hypothesis(candidates=(), fit=fit, fitter=fitter, score=0.0)

    def _shared(self, work: Callable[[Any], Standing], items: Sequence[Any]) -> list[Standing]:
        """Share work among the processes."""
        found: list[Standing] = spread(work, items, self.processes)
        for one in found:
            one.fitter.settle(self.between)
        return found

    def hypothesis(self, candidates: Sequence[Candidate], found: Standing) -> Hypothesis:
        """Score a model against the nominal one."""
        paid = price(found.fit, self.library) - price(self.base.fit, self.library)
        return Hypothesis(
            candidates=tuple(candidates),
            fit=found.fit,
            fitter=found.fitter,
            score=self.base.level - found.level - paid,
        )

    def singles(self) -> tuple[Hypothesis, ...]:
        """Models with one effect more, best first; those that fall behind are not fitted out."""
        chosen = self._promising()
        first = zip(chosen, self._spread([self._outset(c) for c in chosen], _FIRST), strict=True)
        tried = sorted(first, key=lambda pair: -self._score(*pair))
        least = self._score(*tried[0]) - self.policy.behind_unposed if tried else 0.0
        near = sum(self._score(*pair) > least for pair in tried)
        more = self._spread([s for _, s in tried[:near]], _ROUNDS)
        found = [*((c, s) for (c, _), s in zip(tried, more, strict=False)), *tried[near:]]
        found.sort(key=lambda pair: -self._score(*pair))
        if found and self._score(*found[0]) > self.policy.recheck_unposed:
            found = self._again(found)
        out = [self.hypothesis((c,), s) for c, s in found]
        return tuple(sorted(out, key=lambda h: -h.score))

    def _again(self, found: Sequence[Pair]) -> list[Pair]:
        """Fit the nominal model and the nearest rivals from the course of the best one too.

        Where an effect only led to a better course, it must not take the credit for it.
        """
        best, rivals = found[0][1], found[1 : 1 + _RIVALS]
        given = {k: best.fit.values[k] for k in self.library.tolerances}
        course, jobs = best.fitter.course, []
        for candidate, own in (((), self.base), *(((c,), s) for c, s in rivals)):
            keys = keys_of(candidate)
            at = given | {k: own.fit.values[k] for k in keys}
            jobs.append(stand(self.between, course, keys, at, self.doubt))
        more = self._spread(jobs, _ROUNDS)
        self.base = min(self.base, more[0], key=lambda s: s.fit.cost)
        better = [
            (c, min(s, other, key=lambda s: s.fit.cost))
            for (c, s), other in zip(rivals, more[1:], strict=True)
        ]
        return [found[0], *better, *found[1 + _RIVALS :]]

    def _score(self, candidate: Candidate, found: Standing) -> float:
        return self.hypothesis((candidate,), found).score

    def _promising(self) -> list[Candidate]:
        """Candidates that a linear look about the nominal course does not rule out."""
        fit, fitter = self._from.fit, self._from.fitter
        # readings without pose do not hold effects of unknown place or period
        candidates = [c for c in self.library.candidates if not c.identification.guessed]
        table = screen(fitter, fit, candidate_keys(candidates))
        common, _ = linear_gain(fitter, table, ())
        gains = {c.label: linear_gain(fitter, table, c.all_keys)[0] - common for c in candidates}
        ranked = sorted(candidates, key=lambda c: -gains[c.label])
        least = self.policy.screen_unposed
        return [c for k, c in enumerate(ranked) if k < _SPARED or gains[c.label] > least]

    def _outset(self, candidate: Candidate) -> Standing:
        """The nominal model with the candidate's keys free, where its course is sensible."""
        base = self._from
        fit = base.fitter.start(keys_of((candidate,)))
        return Standing(fitter=base.fitter, fit=fit, doubt=base.doubt)

    def _spread(self, jobs: Sequence[Standing], rounds: int) -> list[Standing]:
        return self._shared(lambda job: converged(job, rounds=rounds), jobs)


Found: TypeAlias = tuple[Hypothesis, Hypothesis, tuple[Hypothesis, ...]]
"""Nominal model, chosen one and all that were tried."""


def search_drops(
    problem: Problem, asked: float, *, processes: int, tell: Callable[[int], None]
) -> Found:
    """Search a log of drops without pose.

    One effect at most: readings of an impact alone do not hold two apart.

    Args:
        problem: the log made ready.
        asked: score that an effect must reach.
        processes: that share the fits.
        tell: called with the number of stages done.
    """
    plant = problem.plant
    coarse = Plant(problem.vehicle, plant.library, problem.samples, parts=_COARSE)
    guessed = {c.name for c in plant.library.candidates if c.identification.guessed}
    courses = nearest_courses(coarse, leave=sorted(guessed), ranks=_RANKS, processes=processes)
    outset, base = settled(plant, courses, processes=processes)
    tell(1)
    found = chosen(Drops(base, outset, processes=processes), asked)
    tell(2)
    return found


def settled(
    plant: Plant, courses: Sequence[Course], *, processes: int
) -> tuple[Standing, Standing]:
    """Fit the nominal model from the nearest course, from the others where that leaves something.

    A hull that comes up a little early or late turns another way, and no small step leads from the
    one course to the other.
    """
    between = Between(plant)
    doubt = Doubt(gusts=GUSTS, rough=surface(plant, courses[0]))
    outset = stand(between, courses[0], (), {}, doubt)
    base = converged(outset, rounds=_ROUNDS)
    if base.fit.cost < base.fitter.windows.observed:
        return outset, base
    others = [stand(between, course, (), {}, doubt) for course in courses[1:]]
    found = spread(lambda job: converged(job, rounds=_ROUNDS), others, processes)
    for one in found:
        one.fitter.settle(between)
    pairs = [(outset, base), *zip(others, found, strict=True)]
    return min(pairs, key=lambda pair: pair[1].fit.cost)


def chosen(drops: Drops, asked: float) -> Found:
    """Try all effects one by one; the best is taken if it stands out."""
    tried = drops.singles()
    nominal = drops.nominal
    real = [h for h in tried if material(h.candidates[-1], h.fit, drops.library)]
    if not real or real[0].score < asked:
        return nominal, nominal, tried
    # stronger gusts, as far as they are admitted, may do as well as the effect
    calm = unrest(nominal).allowance - unrest(real[0]).allowance
    return nominal, real[0] if real[0].score - calm > asked else nominal, tried
