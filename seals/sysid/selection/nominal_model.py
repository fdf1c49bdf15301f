"""Nominal model of a log: stated numbers fitted within their tolerances, gusts at their level."""

from __future__ import annotations

from collections.abc import Mapping

from seals.sysid.predictors.extended_model import nonzero
from seals.sysid.predictors.problem import Problem, linearise_model, rewindowed
from seals.sysid.scores.disturbance_level import disturbance_level
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection.relinearised import SETTLED

_NOMINAL_ROUNDS = 8
"""Times that the nominal fit is repeated about its own values, at most."""


def estimate_disturbance(problem: Problem) -> EvidenceHypothesis:
    """Fit the stated model at the most likely level of the gusts."""
    fitter = problem.fitter
    nominal = EvidenceHypothesis(candidates=(), fit=fitter.fit(()), fitter=fitter, score=0.0)
    late = problem.plant.candidate_set.sensor_delay
    at = {k: v for k, v in nominal.fit.values.items() if k != late}
    if problem.plant.friction(nonzero(at), fitter.trajectory.joint_velocity) is not None:
        # the slope of dry friction belongs to the dynamics
        fitter = linearise_model(problem.plant, fitter.trajectory, at, gusts=fitter.windows.gusts)
        nominal = EvidenceHypothesis(candidates=(), fit=fitter.fit(()), fitter=fitter, score=0.0)
    nominal = _about_moved_numbers(problem, nominal)
    fitter = nominal.fitter
    found = disturbance_level(nominal)
    if not 1.0 < found.level <= problem.policy.disturbance_admitted:
        return nominal
    fitter = rewindowed(fitter, gusts=found.level)
    return EvidenceHypothesis(candidates=(), fit=fitter.fit(()), fitter=fitter, score=0.0)


def _about_moved_numbers(problem: Problem, nominal: EvidenceHypothesis) -> EvidenceHypothesis:
    """Repeat the nominal fit about its own values where a stated number has moved far.

    About the stated value the response to a lag is that of another lag: every effect that is fitted
    beside it, about values of its own, would take the credit for the better response.
    """
    policy = problem.policy
    # on an arm the slope of dry friction belongs to the dynamics, and is taken where it was stated
    if not problem.samples.posed or problem.impact or problem.vehicle.servo:
        return nominal
    moved = nominal.fitter.start(()).cost - nominal.fit.cost > policy.relinearise
    # what an effect leaves moves the numbers anywhere, and the responses there are no better
    if not moved or nominal.misfit > policy.misfit_trusted:
        return nominal
    for _ in range(_NOMINAL_ROUNDS):
        found = _about(problem, nominal, nominal.fit.values)
        gain = nominal.fit.cost - found.fit.cost
        if not gain > 0.0:
            break
        nominal = found
        if gain < SETTLED:
            break
    return nominal


def about_other_numbers(
    problem: Problem, nominal: EvidenceHypothesis, other: EvidenceHypothesis
) -> EvidenceHypothesis:
    """Return the nominal model at the stated numbers of a model with an effect, if it fits better.

    A fit far from what is stated may be caught on its way; an effect of no size that is fitted
    beside it shows a way on, and must not take the credit for it.
    """
    found = _about(problem, nominal, other.fit.values)
    return found if found.fit.cost < nominal.fit.cost - SETTLED else nominal


def _about(
    problem: Problem, nominal: EvidenceHypothesis, values: Mapping[str, float]
) -> EvidenceHypothesis:
    """Return the stated model, linear about some values of its numbers, fitted again from there."""
    late = problem.plant.candidate_set.sensor_delay
    at = {k: values[k] for k in nominal.fit.keys if k != late}
    before = nominal.fitter
    fitter = linearise_model(problem.plant, before.trajectory, at, gusts=before.windows.gusts)
    fit = fitter.fit((), around=values)
    return EvidenceHypothesis(candidates=(), fit=fit, fitter=fitter, score=0.0)
