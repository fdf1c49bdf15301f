"""Relinearised fits of the best models about their own values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.parallel import spread
from seals.sysid.predictors.linear_screen import candidate_keys
from seals.sysid.predictors.linearise import predict
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.problem import (
    Linearisation,
    Problem,
    follow_measurements,
    linearise_model,
    rewindowed,
)
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, scored
from seals.sysid.selection.shortlist import hopeful

SETTLED = 2.0
"""Change of the cost below which a repeated fit has converged."""
_ROUNDS = 2
"""Linearisations of one hypothesis, at most."""
_REPEATS = 4
"""Times that those are repeated for a hypothesis that is built on, at most."""
_STEPS = (3e-3, 1e-3, 3e-4)
_MOVES = 8
"""Steps of the search for a delay [s]."""


def relinearise(
    problem: Problem,
    nominal: EvidenceHypothesis,
    base: EvidenceHypothesis,
    tried: Sequence[EvidenceHypothesis],
    *,
    processes: int = 1,
) -> list[EvidenceHypothesis]:
    """Relinearise and repeat the best fits about their own values; the losing ones are released."""
    out = list(tried)
    least = problem.policy.relinearise
    least = max(least, hopeful(out[0].score, base)) if out else least
    # a fit that was caught on its way stands near its own values already, and takes no place
    most = problem.budget.relinearised
    still = [
        i
        for i, h in enumerate(out)
        if not any(key in h.fitter.at for key in h.candidates[-1].all_keys)
    ]
    places = sorted({*range(len(out[:most])), *still[:most]})
    chosen = [i for i in places if out[i].score > least]

    def work(i: int) -> tuple[Fit, Linearisation]:
        found = refit_about_own_values(problem, nominal, out[i])
        return found.fit, Linearisation.of(found.fitter)

    if min(processes, len(chosen)) > 1:
        # a linearisation costs less than its way through a pipe: it is computed again if it wins
        for i, (fit, about) in zip(chosen, spread(work, chosen, processes), strict=True):
            fitter = about.fitter(out[i].fitter.plant)
            out[i] = scored(out[i].candidates, fit, fitter, nominal)
    else:
        best = None
        for i in chosen:
            out[i] = refit_about_own_values(problem, nominal, out[i])
            if best is None or out[i].score > best.score:
                best, loser = out[i], best
            else:
                loser = out[i]
            if loser is not None:
                loser.fitter.release()
    return sorted(out, key=lambda h: -h.score)


def refit_about_own_values(
    problem: Problem, nominal: EvidenceHypothesis, hypothesis: EvidenceHypothesis
) -> EvidenceHypothesis:
    """Relinearise a hypothesis about its own values and fit it again.

    One effect alone that is then worse than none has tolerances that stand in for what is still
    missing, such as a centre of gravity far away: they make the dynamics of a model that does not
    fly, and the next fit moves them further. They stay where the stated model is linear.
    """
    keys, late = hypothesis.fit.free, problem.plant.candidate_set.sensor_delay
    if late in keys and hypothesis.fitter.windows.delay:
        hypothesis = estimate_sensor_delay(nominal, hypothesis)
    known = hypothesis.fit.known
    # windows follow a late sensor that is an effect: a tolerance would be held by the rows left out
    kept = {late} - set(keys)
    followed = problem.impact or not problem.samples.posed

    def repeated(moving: Sequence[str]) -> tuple[Fit, Fitter]:
        fit, fitter = hypothesis.fit, hypothesis.fitter
        tried = []
        for _ in range(_ROUNDS):
            at = {**fitter.at, **{k: fit.values[k] for k in moving if k not in kept}}
            if followed:
                fitter = follow_measurements(fitter, keys, at=at, rounds=1)
            else:
                level = fitter.windows.gusts
                fitter = linearise_model(fitter.plant, fitter.trajectory, at, gusts=level)
            before, fit = fit, fitter.fit(keys, start=fit.values)
            tried.append((fit, fitter))
            if abs(before.cost - fit.cost) < SETTLED:
                break
        # a step from a good place can overshoot where a response has a kink, as one to a delay has
        return min(tried, key=lambda one: one[0].cost)

    fit, fitter = repeated(hypothesis.fit.keys)
    alone = len(hypothesis.candidates) == 1
    if alone and not followed and fit.cost > nominal.fit.cost + problem.policy.screen_near:
        fit, fitter = min((fit, fitter), repeated(keys), key=lambda one: one[0].cost)
    return scored(hypothesis.candidates, replace(fit, known=known), fitter, nominal)


def converged(
    problem: Problem, nominal: EvidenceHypothesis, hypothesis: EvidenceHypothesis
) -> EvidenceHypothesis:
    """Repeat a fit about its own values until its cost has settled; the best of them.

    Whatever is added to a fit that has not settled takes the credit for the way that is left.
    """
    for _ in range(_REPEATS):
        found = refit_about_own_values(problem, nominal, hypothesis)
        gain = hypothesis.fit.cost - found.fit.cost
        if not gain > 0.0:
            break
        hypothesis = found
        if gain < SETTLED:
            break
    return hypothesis


def along_own_trajectory(problem: Problem, nominal: EvidenceHypothesis) -> EvidenceHypothesis:
    """Repeat a good fit of the stated model along the trajectory that it flies under its gusts.

    The trajectory of the free force follows the noise of the measurements. Responses along it share
    the noise of the residual, and where the motion is as small as the noise, they explain it: an
    inertia 30 % too large, sensors 3 ms late (errors in variables). A model that lacks much has no
    better trajectory of its own.
    """
    fit, fitter = nominal.fit, nominal.fitter
    if problem.vehicle.servo or nominal.misfit > problem.policy.misfit_trusted:
        return nominal
    prediction = predict(fitter.plant, fitter.trajectory, fit.values, cache=fitter.cache)
    error = fitter.windows.states(fitter.windows.residual(prediction), prediction)
    if not np.isfinite(error).all():
        return nominal
    moved, level = fitter.trajectory.moved(error), fitter.windows.gusts
    fitter = linearise_model(fitter.plant, moved, fitter.at, gusts=level)
    found = fitter.fit((), start=fit.values)
    repeated = EvidenceHypothesis(candidates=(), fit=found, fitter=fitter, score=0.0)
    return repeated if repeated.misfit < problem.policy.misfit_trusted else nominal


def repeat_worse_fits(
    problem: Problem,
    nominal: EvidenceHypothesis,
    base: EvidenceHypothesis,
    chosen: dict[str, tuple[Candidate, Fit, Fitter]],
    processes: int,
) -> None:
    """Repeat the fits that are worse than the base, in place.

    A model with one more effect holds the one without it: a worse fit was caught on its way. It
    starts again from the base's values; where it is caught again, the responses of the tolerances
    are taken about its own values. A load beside the centre is balanced by torques that the base
    does not know: the base's response to an inertia is wrong beside it.
    """

    def caught(by: float) -> list[Candidate]:
        return [c for c, fit, _ in chosen.values() if fit.cost > base.fit.cost + by]

    models = [(*base.candidates, c) for c in caught(0.0)]

    def work(model: tuple[Candidate, ...]) -> Fit:
        fitter = base.fitter.acting(model)
        return fitter.fit(candidate_keys(model), around=base.fit.values, coarse=True)

    for model, fit in zip(models, spread(work, models, processes), strict=True):
        if fit.cost < chosen[model[-1].label][1].cost:
            chosen[model[-1].label] = (model[-1], fit, base.fitter.acting(model))
    if problem.impact or not problem.samples.posed:
        return
    # the base's own responses are no better: a little worse is no sign
    again = caught(problem.policy.screen_near)

    def about(candidate: Candidate) -> tuple[Fit, Linearisation]:
        _, fit, fitter = chosen[candidate.label]
        at = scored((*base.candidates, candidate), fit, fitter, nominal)
        found = refit_about_own_values(problem, nominal, at)
        return found.fit, Linearisation.of(found.fitter)

    for one, (fit, place) in zip(again, spread(about, again, processes), strict=True):
        if fit.cost < chosen[one.label][1].cost:
            chosen[one.label] = (one, fit, place.fitter(chosen[one.label][2].plant))


def estimate_sensor_delay(
    nominal: EvidenceHypothesis, hypothesis: EvidenceHypothesis
) -> EvidenceHypothesis:
    """Estimate the delay of the inertial sensors by a line search and a parabola.

    Args:
        nominal: model against which fits are scored.
        hypothesis: with a delay of the sensors, in windows that follow it.
    """
    best, near = hypothesis, [hypothesis, hypothesis]
    for step in _STEPS:
        for _ in range(_MOVES):
            at = best.fitter.windows.delay
            near = [_at_delay(nominal, best, at + side * step) for side in (-1.0, 1.0)]
            ahead = max(near, key=lambda h: _better(h, best))
            if _better(ahead, best) <= 0.0:
                break
            best = ahead
    return parabola_peak(nominal, best, near)


def _better(other: EvidenceHypothesis, best: EvidenceHypothesis) -> float:
    """Return by how much the score of a fit is higher, as if both saw equally many readings.

    Windows leave out a row more at each whole row of the delay: in the score that is a step, which
    would hold the delay there.
    """
    rows, others = best.fitter.windows.observed, other.fitter.windows.observed
    return float(best.fit.cost - other.fit.cost * rows / others)


def parabola_peak(
    nominal: EvidenceHypothesis, best: EvidenceHypothesis, near: Sequence[EvidenceHypothesis]
) -> EvidenceHypothesis:
    """Return the fit at the peak of a parabola through three delays, with its standard deviation.

    Equation:
        the score falls by 1 at one standard deviation; with s the step and c the score's second
        difference, sigma = s / sqrt(-c / 2), and the top is half the first difference over -c away.

    Args:
        nominal: model against which fits are scored.
        best: at the middle.
        near: a step earlier and a step later.
    """
    before, after = (_better(h, best) for h in near)
    bend = -(before + after)
    at = best.fitter.windows.delay
    step = near[1].fitter.windows.delay - at
    if before > 0.0 or after > 0.0 or bend <= 0.0 or step <= 0.0:
        return best
    spread = float(step / np.sqrt(0.5 * bend))
    top = _at_delay(nominal, best, at + 0.5 * step * (after - before) / bend)
    chosen = top if _better(top, best) > 0.0 else best
    return replace(
        chosen, fit=replace(chosen.fit, known={best.fitter.candidate_set.sensor_delay: spread})
    )


def _at_delay(
    nominal: EvidenceHypothesis, hypothesis: EvidenceHypothesis, delay: float
) -> EvidenceHypothesis:
    fitter = rewindowed(hypothesis.fitter, delay=delay)
    start = {**hypothesis.fit.values, fitter.candidate_set.sensor_delay: delay}
    fit = fitter.fit(hypothesis.fit.free, start=start)
    return scored(hypothesis.candidates, fit, fitter, nominal)
