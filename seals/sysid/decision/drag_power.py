"""Drags that grow with another power of the speed than the laws of the library."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from seals.arrays import Floats
from seals.effects.discrepancy import DragExponent
from seals.effects.effect import Effect, MediumKind
from seals.sysid.candidates.parameters import Candidate, CandidateSet, Parameter
from seals.sysid.predictors.plant import Plant
from seals.sysid.predictors.problem import Problem, linearise_model, typical_speeds
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis


def other_power(problem: Problem, best: EvidenceHypothesis) -> str:
    """Return the reason against a drag whose power of the speed is not its law's; else nothing.

    One flight has few speeds: the law of one power bends to the force of another, and the drag of a
    third power leaves little beside one of the second. So the power of a drag that acts throughout
    is fitted as one more number, of the speed along each axis and of that of the whole body: a
    drag of the second power that counts the whole speed stays below the threshold in both.

    Args:
        problem: of the log.
        best: model of the answer.
    """
    if _two_laws(best):
        return "a drag that grows neither with the first nor with the second power of the speed"
    if not problem.samples.posed or problem.impact:
        return ""
    for candidate in best.candidates:
        power = candidate.identification.power
        if not power or candidate.activity is not None or not _by_axis(best, candidate):
            continue
        for squares in (_own_squares(best, candidate), np.ones((1, 3, 3))):
            change, error = fitted_change(problem, best, candidate, squares)
            if change - 2.0 * error > problem.policy.other_power:
                return (
                    f"a drag that grows with the power {power + change:.2g} of the speed, which is "
                    f"not that of {candidate.label}"
                )
    return ""


def _by_axis(best: EvidenceHypothesis, candidate: Candidate) -> bool:
    """Return true for a law of a medium with a coefficient for each axis: other forms pass."""
    law = best.fitter.candidate_set.effects[candidate.instance]
    return len(candidate.keys) == 3 and isinstance(vars(law).get("medium"), MediumKind)


def _own_squares(best: EvidenceHypothesis, candidate: Candidate) -> Floats | None:
    """Return the axes whose speeds count in a drag's own law, shape (1, 3, 3); None for its own."""
    law = best.fitter.candidate_set.effects[candidate.instance]
    return law.constants().get("squares")


def _two_laws(best: EvidenceHypothesis) -> bool:
    """Return true if two laws of one variant differ only by power or form of the speed."""
    laws = {
        (c.identification.family, tuple(c.variant.items()), c.name, c.law)
        for c in best.candidates
        if c.identification.family
    }
    return len({law[:2] for law in laws}) < len(laws)


def fitted_change(
    problem: Problem, best: EvidenceHypothesis, candidate: Candidate, squares: Floats | None
) -> tuple[float, float]:
    """Return the change of a drag's power of the speed that fits best, and its 1-sigma.

    Args:
        problem: of the log.
        best: model with the drag.
        candidate: the drag.
        squares: adds the squared velocities whose power it is, shape (1, 3, 3); None for that along
            each axis alone.
    """
    known, values = best.fitter.candidate_set, dict(best.fit.values)
    speeds = typical_speeds(best.fitter.trajectory)
    x, y, z = (float(values[key]) for key in candidate.keys)
    law = known.effects[candidate.instance]
    shape = DragExponent(
        power=candidate.identification.power,
        coefficients=(x, y, z),
        speeds=(float(speeds[0]), float(speeds[1]), float(speeds[2])),
        squares=squares,
        medium=_medium(law),
    )
    shape.correction = True
    name = f"{candidate.instance}_power"
    key = f"{name}.exponent"
    plant = _extended(problem, known, name, shape, key).acting(best.candidates)
    gusts = best.fitter.windows.gusts
    fitter = linearise_model(plant, best.fitter.trajectory, values, gusts=gusts)
    fit = fitter.fit((*best.fit.free, key), start=values)
    return float(fit.values[key]), fit.robust_spread(key)


def _extended(problem: Problem, known: CandidateSet, name: str, effect: Effect, key: str) -> Plant:
    """Return the plant with one more effect and its parameter."""
    free = Parameter(key=key, scale=problem.policy.other_power, bounds=(-2.0, 4.0))
    wider = replace(
        known,
        effects={**known.effects, name: effect},
        parameters={**known.parameters, key: free},
    )
    return Plant(problem.vehicle, wider, problem.samples, parts=problem.plant.parts)


def _medium(law: Effect) -> MediumKind:
    medium = vars(law)["medium"]
    assert isinstance(medium, MediumKind)
    return medium
