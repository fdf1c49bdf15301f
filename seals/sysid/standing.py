"""A model of whole runs along its own course, and the steps that bring it to the measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from seals.arrays import Floats
from seals.sysid.between import Between, FineFitter
from seals.sysid.normal import Fit, newton_step
from seals.sysid.problem import forgotten, stated_starts
from seals.sysid.rough import Rough
from seals.sysid.trajectory import Course
from seals.sysid.windows import Windows

WHOLE = 1e6
"""Length of the windows that take whole runs, from their stated starts [s]."""
_KNOT = 0.05
"""Spacing of the knots of what no law describes [s]."""
_REACH = np.repeat([0.06, 0.1, 0.4, 1.0], 3)
"""Longest step of a course: position [m], turn [rad], velocity [m/s], spin [rad/s]."""
_STILL, _SETTLED = 0.1, 0.5
"""Share of the reach, and change of the misfit, below which a fit has settled."""
_SLOWEST = 0.1
"""Least share of a step."""


@dataclass(frozen=True, kw_only=True)
class Doubt:
    """What may act that no law describes.

    Args:
        gusts: factor on their stated level.
        rough: errors at the surface, the same for every model; None without a surface.
        length: of the windows, longer than a run for whole runs [s].
    """

    gusts: float
    rough: Rough | None
    length: float = WHOLE


@dataclass(frozen=True, kw_only=True)
class Standing:
    """A model at some values, linear about the course it takes there.

    Args:
        fitter: of that linearisation.
        fit: its equations at those values.
        doubt: under which it is judged.
        done: whether further steps gain nothing.
    """

    fitter: FineFitter
    fit: Fit
    doubt: Doubt
    done: bool = False

    @property
    def level(self) -> float:
        """Twice the negative log evidence, up to a constant, without the price of freedom."""
        return self.fit.cost + self.fitter.windows.volume


def stand(
    between: Between, course: Course, freed: Sequence[str], at: Mapping[str, float], doubt: Doubt
) -> Standing:
    """Linearise a model about a course and values."""
    track = between.track(course, at)
    rows, fine = between.dynamics(track, at)
    plant, rough = between.plant, doubt.rough
    windows = Windows(
        plant.samples,
        plant.vehicle,
        course,
        rows,
        length=doubt.length,
        gusts=doubt.gusts,
        extra=None if rough is None else rough.push,
        blur=None if rough is None else rough.blur,
        knot=max(_KNOT, 1.5 * plant.samples.step),
        stated=stated_starts(plant, course) if doubt.length == WHOLE else None,
        skip=forgotten(plant),
    )
    fitter = FineFitter(between, course, windows, fine=fine, rows=rows, at=at)
    return Standing(fitter=fitter, fit=fitter.start(freed), doubt=doubt)


def doubted(now: Standing, doubt: Doubt) -> Standing:
    """The same model under another doubt."""
    fitter = now.fitter
    return stand(fitter.between, fitter.course, now.fit.freed, now.fit.values, doubt)


def converged(now: Standing, *, rounds: int) -> Standing:
    """Take Gauss-Newton steps of values, start states and gusts until they gain nothing.

    A run whose misfit rises goes half as far the next time: far from a model that could be true,
    full steps swing about. Without an end the best place on the way is returned.
    """
    best, pace = now, np.ones(now.fitter.windows.count)
    for _ in range(rounds):
        if now.done:
            break
        taken = _stepped(now, pace)
        if taken is None:
            break
        after, moved = taken
        fall = now.fit.cost - after.fit.cost
        now = replace(after, done=moved < _STILL and abs(fall) < _SETTLED)
        pace = np.where(after.fit.misfit <= best.fit.misfit + 1.0, 1.5 * pace, 0.5 * pace)
        pace = np.clip(pace, _SLOWEST, 1.0)
        # numbers that ran out of digits give squares below zero
        sound = bool(np.all(after.fit.misfit > 0.0))
        if sound and (now.done or after.fit.cost < best.fit.cost):
            best = now
        elif not sound:
            now = best
    return best


def _stepped(now: Standing, pace: Floats) -> tuple[Standing, float] | None:
    """One step, run by run at its pace, and the largest move in units of the reach.

    None where the step is not finite: the equations, or the course that it leads to.
    """
    fitter, factors, values = now.fitter, now.fitter.library.factors, {}
    step, _ = newton_step(now.fit)
    if not np.isfinite(step).all():
        return None
    for i, key in enumerate(now.fit.keys):
        low, high = factors[key].bounds
        aim = now.fit.values[key] + float(pace.mean()) * step[i]
        values[key] = float(min(max(aim, low), high))
    windows = fitter.windows
    prediction = fitter.predicted(values)
    error = windows.states(windows.residual(prediction), prediction)
    if not np.isfinite(error).all():
        return None
    largest = 0.0
    for run, share in zip(windows.rows, pace, strict=True):
        size = float((np.abs(error[run, :12]) / _REACH).max())
        largest = max(largest, size)
        # a measured pose holds a course by itself
        far = 1.0 / max(size, 1e-9) if now.doubt.length == WHOLE else 1.0
        error[run] *= min(share, far)
    course = fitter.course.moved(error)
    moved = stand(fitter.between, course, now.fit.freed, values, now.doubt)
    return moved, largest
