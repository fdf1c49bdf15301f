"""The search in logs without pose: every effect is fitted to whole runs, along its own course."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from seals.diagnose.between import Between
from seals.diagnose.factors import Candidate
from seals.diagnose.gusts import unrest
from seals.diagnose.hypothesis import Hypothesis, keys_of, material, price
from seals.diagnose.parallel import spread
from seals.diagnose.pierced import pierced
from seals.diagnose.plant import Plant
from seals.diagnose.problem import GUSTS, Problem
from seals.diagnose.screen import candidate_keys, linear_gain, screen
from seals.diagnose.standing import Doubt, Standing, converged, stand
from seals.diagnose.trials import nearest_course

_COARSE = 2
"""Parts of a row in which plausible runs are simulated."""
_NEAR = 1.5
"""Misfit of the nominal model, per degree of freedom, up to which others set out from its end."""
_ROUNDS, _FIRST = 10, 2
"""Steps of a fit at most, and before those that fall behind are left."""
_BEHIND = 60.0
"""Score behind the best from which on a fit is not taken further."""
_HOPELESS, _SPARED = 4.0, 4
"""Linear gain below which an effect is not fitted, and how many are in any case."""
_SPECIAL = ("tether", "waves")
"""Effects of unknown place or period: readings without pose do not hold them."""


class Drops:
    """Fits models of a log without pose.

    Args:
        problem: the log made ready.
        gusts: factor on the stated level of the gusts.
        processes: that share the fits.
    """

    def __init__(self, problem: Problem, *, gusts: float = GUSTS, processes: int = 1) -> None:
        """Fit the nominal model."""
        self.problem, self.processes = problem, processes
        self.between = Between(problem.plant)
        self.library = problem.plant.library
        coarse = Plant(problem.vehicle, self.library, problem.samples, parts=_COARSE)
        course = nearest_course(coarse, leave=_SPECIAL, processes=processes)
        self.doubt = Doubt(gusts=gusts, rough=pierced(problem, course))
        outset = stand(self.between, course, (), {}, self.doubt)
        self.base = converged(outset, rounds=_ROUNDS)
        good = self.base.fit.cost < _NEAR * self.base.fitter.windows.observed
        self._from = self.base if good else outset
        self._price = price(self.base.fit, self.library)
        fit, fitter = self.base.fit, self.base.fitter
        self.nominal = Hypothesis(candidates=(), fit=fit, fitter=fitter, score=0.0)

    def _shared(self, work: Callable[[Any], Standing], items: Sequence[Any]) -> list[Standing]:
        """Share work among the processes."""
        found: list[Standing] = spread(work, items, self.processes)
        for one in found:
            one.fitter.settle(self.between)
        return found

    def hypothesis(self, candidates: Sequence[Candidate], found: Standing) -> Hypothesis:
        """Score a model against the nominal one."""
        paid = price(found.fit, self.library) - self._price
        return Hypothesis(
            candidates=tuple(candidates),
            fit=found.fit,
            fitter=found.fitter,
            score=self.base.level - found.level - paid,
        )

    def singles(self) -> tuple[Hypothesis, ...]:
        """Models with one effect more, best first; those that fall behind are not fitted out."""
        chosen = self._promising()
        first = self._spread([self._outset(c) for c in chosen], _FIRST)
        tried = [(c, s, self.hypothesis((c,), s).score) for c, s in zip(chosen, first, strict=True)]
        best = max((score for *_, score in tried), default=0.0)
        near = [t for t in tried if t[2] > best - _BEHIND]
        more = self._spread([s for _, s, _ in near], _ROUNDS)
        out = [self.hypothesis((c,), s) for (c, _, _), s in zip(near, more, strict=True)]
        out += [self.hypothesis((c,), s) for c, s, score in tried if score <= best - _BEHIND]
        return tuple(sorted(out, key=lambda h: -h.score))

    def _promising(self) -> list[Candidate]:
        """Candidates that a linear look about the nominal course does not rule out."""
        fit, fitter = self._from.fit, self._from.fitter
        candidates = [c for c in self.library.candidates if c.name not in _SPECIAL]
        table = screen(fitter, fit, candidate_keys(candidates))
        common, _ = linear_gain(fitter, table, ())
        gains = {c.label: linear_gain(fitter, table, c.all_keys)[0] - common for c in candidates}
        ranked = sorted(candidates, key=lambda c: -gains[c.label])
        return [c for k, c in enumerate(ranked) if k < _SPARED or gains[c.label] > _HOPELESS]

    def _outset(self, candidate: Candidate) -> Standing:
        """The nominal model with the candidate's keys free, where its course is sensible."""
        base = self._from
        fit = base.fitter.start(keys_of((candidate,)))
        return Standing(fitter=base.fitter, fit=fit, doubt=base.doubt)

    def _spread(self, jobs: Sequence[Standing], rounds: int) -> list[Standing]:
        return self._shared(lambda job: converged(job, rounds=rounds), jobs)


def search_drops(
    problem: Problem, asked: float, *, processes: int, tell: Callable[[int], None]
) -> tuple[Hypothesis, Hypothesis, tuple[Hypothesis, ...]]:
    """Nominal model, chosen one and all that were tried, in a log of drops without pose.

    One effect at most: readings of an impact alone do not hold two apart.

    Args:
        problem: the log made ready.
        asked: score that an effect must reach.
        processes: that share the fits.
        tell: called with the number of stages done.
    """
    drops = Drops(problem, processes=processes)
    tell(1)
    tried = drops.singles()
    tell(2)
    nominal = drops.nominal
    real = [h for h in tried if material(h.candidates[-1], h.fit, problem.plant.library)]
    if not real or real[0].score < asked:
        return nominal, nominal, tried
    # stronger gusts, as far as they are admitted, may do as well as the effect
    calm = unrest(nominal).allowance - unrest(real[0]).allowance
    return nominal, real[0] if real[0].score - calm > asked else nominal, tried
