"""Initial guesses for effects that are not linear about zero, such as a tether or waves."""

from __future__ import annotations

from typing import Any

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
    """Derive starting values, by effect name, from the residual force of a model."""
    if not problem.samples.posed:
        return {}
    candidate_set = problem.plant.candidate_set
    guessed = [c for c in candidate_set.candidates if c.identification.guessed]
    if not guessed:
        return {}
    residual = free_force(problem, base)
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


def free_force(problem: Problem, base: EvidenceHypothesis) -> Residual:
    """Estimate the residual force of a model, world axes."""
    fitter = rewindowed(base.fitter, gusts=LOOSE)
    misfit = fitter.misfit(base.fit.values)
    _, wrench = fitter.windows.explained(misfit.outputs[:, :, 0])
    rows = fitter.windows.rows[:, ::_EVERY].ravel()
    trajectory, samples = fitter.trajectory, problem.samples
    turn = matrix_of(trajectory.quaternion[rows])
    return Residual(
        position=trajectory.position[rows],
        force=rotate(turn, wrench[:, ::_EVERY, :3].reshape(-1, 3)),
        time=samples.time[rows],
        subject=subject_of(problem.vehicle, typical_speeds(trajectory)),
        log=samples.log_index[rows],
    )
