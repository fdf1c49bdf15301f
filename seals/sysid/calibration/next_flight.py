"""Proposal of a manoeuvre for a parameter that the logs do not determine."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

from seals.errors import ConfigError
from seals.sysid.calibration.calibration import Calibration
from seals.sysid.calibration.stated import StatedNumber
from seals.sysid.candidates.parameters import Candidate, CandidateSet
from seals.sysid.predictors.plant import Plant
from seals.sysid.predictors.problem import Problem, linearise_model
from seals.sysid.report.naming import figure


@dataclass(frozen=True, kw_only=True)
class NextFlight:
    """Manoeuvre proposed for one number, or the reason why none is proposed.

    Args:
        number: that the logs do not determine.
        manoeuvre: in words; empty for none.
        seconds: that it takes.
        sigma: expected 1-sigma of the number after it.
        reason: why none is proposed.
    """

    number: StatedNumber
    manoeuvre: str = ""
    seconds: float = 0.0
    sigma: float = 0.0
    reason: str = ""

    @property
    def sentence(self) -> str:
        """The proposal in a sentence."""
        if not self.manoeuvre:
            return f"No manoeuvre is proposed for {self.number.name}: {self.reason}"
        return (
            f"To determine {self.number.name}, record {self.seconds:.0f} s of this: "
            f"{self.manoeuvre} Expected 1-sigma: {figure(self.sigma, self.number.unit)}."
        )

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "parameter": self.number.name,
            "manoeuvre": self.manoeuvre,
            "seconds": self.seconds,
            "expected_sigma": self.sigma,
            "sentence": self.sentence,
        }


def next_flight(found: Calibration) -> NextFlight | None:
    """Return the best manoeuvre for the first undetermined number; None where there is none.

    The other numbers count as known as well as the logs tell them.
    """
    from seals.sysid.experiment_design.ranking import propose

    open_ones = (n for n in found.numbers if not (found.determined(n) or found.at_bound(n)))
    number = next(open_ones, None)
    if number is None:
        return None
    prior = found.prior(number)
    try:
        known = {number.name: {number.key: prior / abs(number.slope)}}
        plan = propose(_problem(found, number), [number.name], known=known)
        best = plan.best
    except ConfigError as refusal:
        return NextFlight(number=number, reason=str(refusal).partition("\n")[0])
    # one chi-square is what one sigma leaves over
    sigma = prior / sqrt(1.0 + max(best.separation, 0.0))
    if sigma > found.problem.policy.undetermined * prior:
        reason = "none of the library would show it; measure it on the ground."
        return NextFlight(number=number, reason=reason)
    manoeuvre = best.manoeuvre
    return NextFlight(
        number=number, manoeuvre=manoeuvre.words, seconds=manoeuvre.seconds, sigma=sigma
    )


def _problem(found: Calibration, number: StatedNumber) -> Problem:
    """Problem with one number as a candidate and the others within their uncertainty."""
    problem, fit = found.problem, found.solution.fit
    held: CandidateSet = problem.plant.candidate_set
    parameters = dict(held.parameters)
    for other in found.numbers:
        if other is not number:
            own = parameters[other.key]
            parameters[other.key] = replace(own, tolerance=fit.spread(other.key))
    field = number.key.partition(".")[2]
    candidate = Candidate(name=number.name, keys=(number.key,), reported=(field,))
    candidate_set = replace(held, parameters=parameters, candidates=(*held.candidates, candidate))
    plant = Plant(problem.vehicle, candidate_set, problem.samples, parts=problem.plant.parts)
    fitter = linearise_model(plant, found.solution.fitter.trajectory, {})
    return replace(problem, plant=plant, fitter=fitter)
