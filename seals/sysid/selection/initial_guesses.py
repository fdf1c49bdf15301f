"""Initial guesses for effects that are not linear about zero, such as a tether or waves."""

from __future__ import annotations

from typing import Any

from seals.arrays import Floats
from seals.effects.identification import Residual
from seals.frames import matrix_of, rotate
from seals.sysid.candidates.parameters import Candidate, CandidateSet
from seals.sysid.candidates.vehicle import subject_of
from seals.sysid.predictors.problem import LOOSE, Problem, rewindowed, typical_speeds
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis

_EVERY = 5
"""Rows between the points at which the free force is looked at."""


def initial_guesses(
    problem: Problem, base: EvidenceHypothesis
) -> dict[str, list[dict[str, float]]]:
    """Guess starting values, by effect name, from the residual force of a model."""
    if not problem.samples.posed:
        return {}
    candidate_set = problem.plant.candidate_set
    guessed = [c for c in candidate_set.candidates if c.identification.guessed]
    if not guessed:
        return {}
    position, force, time = free_force(problem, base)
    subject = subject_of(problem.vehicle, typical_speeds(base.fitter.trajectory))
    residual = Residual(position=position, force=force, time=time, subject=subject)
    given = {k: base.fit.values[k] for k in base.fit.free}
    out: dict[str, list[dict[str, float]]] = {}
    for candidate in guessed:
        law, stem = law_of(candidate_set, candidate), candidate.keys[0].partition(".")[0]
        found = [] if law is None else law.guesses(residual)
        starts = [given | {f"{stem}.{p}": v for p, v in g.items()} for g in found]
        out.setdefault(candidate.name, []).extend(starts)
    return out


def law_of(candidate_set: CandidateSet, candidate: Candidate) -> Any:
    """Return the class of a candidate's law: an effect, the waves, or None without either."""
    stem = candidate.keys[0].partition(".")[0]
    if stem in candidate_set.effects:
        return type(candidate_set.effects[stem])
    return candidate_set.waves[stem].law if stem in candidate_set.waves else None


def free_force(problem: Problem, base: EvidenceHypothesis) -> tuple[Floats, Floats, Floats]:
    """Estimate the residual force of a model, world axes: positions, forces and times."""
    fitter = rewindowed(base.fitter, gusts=LOOSE)
    misfit = fitter.misfit(base.fit.values)
    _, wrench = fitter.windows.explained(misfit.outputs[:, :, 0])
    rows = fitter.windows.rows[:, ::_EVERY].ravel()
    trajectory = fitter.trajectory
    force = rotate(matrix_of(trajectory.quaternion[rows]), wrench[:, ::_EVERY, :3].reshape(-1, 3))
    return trajectory.position[rows], force, problem.samples.clock[rows]
