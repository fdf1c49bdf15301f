"""Initial guesses for effects that are not linear about zero, such as a tether or waves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeAlias

from seals.effects.identification import Residual
from seals.frames import matrix_of, rotate
from seals.sysid.candidates.activity import ACTIVE, Activity
from seals.sysid.candidates.parameters import Candidate, CandidateSet
from seals.sysid.predictors.problem import LOOSE, Problem, rewindowed, typical_speeds
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis

Guess: TypeAlias = tuple[Candidate, dict[str, float]]
"""Effect to add and the starting values of the model with it."""

_EVERY = 5
"""Rows between the points at which the free force is looked at."""


def initial_guesses(
    problem: Problem,
    base: EvidenceHypothesis,
    candidates: Sequence[Candidate],
    activity: Activity | None = None,
) -> list[Guess]:
    """Derive starting values of effects from the residual force of a model.

    Args:
        problem: the log made ready.
        base: model that they would extend.
        candidates: effects to look at; those that are linear about zero need no guess.
        activity: when they act, from the force of these times alone: one that is zero at other
            times contradicts every law that acts throughout. None for throughout.
    """
    guessed = [c for c in candidates if c.identification.guessed]
    if not guessed or not problem.samples.posed:
        return []
    residual = free_force(problem, base, activity)
    if not len(residual.time):
        return []
    given = {k: base.fit.values[k] for k in base.fit.free}
    out: list[Guess] = []
    for candidate in guessed:
        law = law_of(problem.plant.candidate_set, candidate)
        acting = candidate if activity is None else candidate.acting(activity)
        key, ending = f"{candidate.instance}.{{}}", "" if activity is None else ACTIVE
        for guess in [] if law is None else law.guesses(residual):
            out.append((acting, given | {key.format(p) + ending: v for p, v in guess.items()}))
    return out


def law_of(candidate_set: CandidateSet, candidate: Candidate) -> Any:
    """Return the class of a candidate's law: an effect, the waves, or None without either."""
    stem = candidate.keys[0].partition(".")[0]
    if stem in candidate_set.effects:
        return type(candidate_set.effects[stem])
    return candidate_set.waves[stem].law if stem in candidate_set.waves else None


def free_force(
    problem: Problem, base: EvidenceHypothesis, activity: Activity | None = None
) -> Residual:
    """Estimate the residual force of a model, world axes, at some times or at all."""
    fitter = rewindowed(base.fitter, gusts=LOOSE)
    misfit = fitter.misfit(base.fit.values)
    _, wrench = fitter.windows.explained(misfit.outputs[:, :, 0])
    rows = fitter.windows.rows[:, ::_EVERY].ravel()
    trajectory, samples = fitter.trajectory, problem.samples
    force = wrench[:, ::_EVERY, :3].reshape(-1, 3)
    if activity is not None:
        acts = activity.weights(samples)[rows] > 0.0
        rows, force = rows[acts], force[acts]
    turn = matrix_of(trajectory.quaternion[rows])
    return Residual(
        position=trajectory.position[rows],
        force=rotate(turn, force),
        time=samples.time[rows],
        subject=replace(problem.vehicle, speeds=typical_speeds(trajectory)),
        log=samples.log_index[rows],
    )
