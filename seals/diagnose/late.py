"""Late inertial sensors on a hull that falls into water: they report an impact when it is over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from seals.arrays import Floats
from seals.diagnose.between import Between
from seals.diagnose.hypothesis import Hypothesis, price
from seals.diagnose.linearise import DELAY
from seals.diagnose.parallel import spread
from seals.diagnose.problem import WINDOW, Problem
from seals.diagnose.rough import surface
from seals.diagnose.standing import Doubt, Standing, converged, stand

_ROUNDS = 14
"""Steps of a fit at most."""
_OUTSET = 0.02
"""Delay from which a fit sets out [s]."""
_MUCH = 1.2
"""Misfit of a model, per degree of freedom, from which on late sensors are looked for."""
_PLIANT = ("waves", "tether")
"""Effects whose place or period is free."""


def late_sensors(
    problem: Problem, nominal: Hypothesis, best: Hypothesis, asked: float, *, processes: int = 1
) -> Hypothesis | None:
    """The model with late sensors, followed between the rows; None where it does not stand out.

    A course that was smoothed with late readings is bent at the impact, and straight lines between
    the rows miss the impact's peak. So model and course are fitted together, with and without the
    delay, and those two are compared.

    Args:
        problem: the log made ready.
        nominal: model, against which all are scored.
        best: model that was found without.
        asked: score that the delay must reach.
        processes: that share the fits.
    """
    named = [c for c in problem.plant.library.candidates if DELAY in c.keys]
    if not named or not problem.impact or not _doubtful(best):
        return None
    course = problem.fitter.course
    rough = surface(problem.plant, course)
    if rough is not None:
        late = [
            np.roll(rough.blur, k) for k in range(1 + int(2.0 * _OUTSET / problem.samples.step))
        ]
        widened: Floats = np.max(late, axis=0)
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
    paid = price(delayed.fit, problem.plant.library) - price(plain.fit, problem.plant.library)
    if plain.level - delayed.level - paid < asked:
        return None
    return Hypothesis(
        candidates=(named[0],),
        fit=delayed.fit,
        fitter=delayed.fitter,
        score=nominal.fit.cost - delayed.fit.cost - paid,
    )


def _doubtful(best: Hypothesis) -> bool:
    """Whether a model leaves much over, or needs an effect that bends to almost anything."""
    much = best.fit.cost > _MUCH * best.fitter.windows.observed
    return much or bool({*best.names} & {*_PLIANT})


def _settled(now: Standing) -> Standing:
    return converged(now, rounds=_ROUNDS)
