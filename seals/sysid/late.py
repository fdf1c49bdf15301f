"""Late inertial sensors on a hull that falls into water: they report an impact when it is over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from seals.arrays import Floats
from seals.sysid.between import Between
from seals.sysid.drop import Drops, Found, chosen
from seals.sysid.hypothesis import Hypothesis, material
from seals.sysid.linearise import DELAY
from seals.sysid.parallel import spread
from seals.sysid.problem import WINDOW, Problem
from seals.sysid.rough import surface
from seals.sysid.standing import Doubt, Standing, converged, stand

_ROUNDS = 14
"""Steps of a fit at most."""
_OUTSET = 0.02
"""Delay from which a fit sets out [s]."""


def own_courses(
    problem: Problem, nominal: Hypothesis, best: Hypothesis, asked: float, *, processes: int = 1
) -> Found | None:
    """Search again along courses of the models' own; None where those gain nothing.

    A course that was smoothed with late readings is bent at the impact, straight lines between the
    rows miss the impact's peak, and a hull that strikes fast is under water within a row. So model
    and course are fitted together: first with and without late sensors, and where these are not
    what is missing, with all other effects.

    Args:
        problem: the log made ready.
        nominal: model, against which all were scored.
        best: model that was found along the measured course.
        asked: score that an effect must reach.
        processes: that share the fits.

    Returns:
        Nominal model, chosen one and all that were tried.
    """
    named = [c for c in problem.plant.library.candidates if DELAY in c.keys]
    if not named or not problem.impact or not _doubtful(best):
        return None
    course = problem.fitter.course
    rough = surface(problem.plant, course)
    if rough is not None:
        later = [
            np.roll(rough.blur, k) for k in range(1 + int(2.0 * _OUTSET / problem.samples.step))
        ]
        widened: Floats = np.max(later, axis=0)
        rough = replace(rough, blur=widened)
    doubt = Doubt(gusts=problem.fitter.windows.gusts, rough=rough, length=WINDOW)
    between = Between(problem.plant)
    outsets = [
        stand(between, course, freed, {DELAY: start}, doubt)
        for freed, start in (((), 0.0), ((DELAY,), _OUTSET))
    ]
    found: list[Standing] = spread(_settled, outsets, processes)
    for one in found:
        one.fitter.settle(between)
    plain, delayed = found
    drops = Drops(plain, outsets[0], processes=processes)
    late = drops.hypothesis(named[:1], delayed)
    if late.score > asked and material(named[0], late.fit, drops.library):
        late = replace(late, score=late.score + nominal.fit.cost - plain.fit.cost)
        if late.score > best.score + asked:
            return nominal, late, (late,)
    if plain.fit.cost > best.fit.cost - problem.policy.late_gain:
        return None
    return chosen(drops, asked)


def _doubtful(best: Hypothesis) -> bool:
    """Whether a model leaves much over, or needs an effect that bends to almost anything."""
    much = best.fit.cost > best.fitter.library.policy.late_misfit * best.fitter.windows.observed
    return much or any(c.identification.guessed for c in best.candidates)


def _settled(now: Standing) -> Standing:
    return converged(now, rounds=_ROUNDS)
