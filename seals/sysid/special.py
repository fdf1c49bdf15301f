"""Starting values for effects that are not linear about zero, such as a tether or waves."""

from __future__ import annotations

from typing import Any

from seals.arrays import Floats
from seals.effects.identification import Residual
from seals.frames import matrix_of, rotate
from seals.sysid.catalogue import subject_of, wave_law
from seals.sysid.factors import Candidate, Library
from seals.sysid.hypothesis import Hypothesis
from seals.sysid.plant import WAVES
from seals.sysid.problem import LOOSE, Problem, rewindowed, typical

_EVERY = 5
"""Rows between the points at which the free force is looked at."""


def special_starts(problem: Problem, base: Hypothesis) -> dict[str, list[dict[str, float]]]:
    """Starting values, by name, of effects that are guessed from the force a model leaves over."""
    if not problem.samples.posed:
        return {}
    library = problem.plant.library
    guessed = [c for c in library.candidates if c.identification.guessed]
    if not guessed:
        return {}
    position, force, time = free_force(problem, base)
    subject = subject_of(problem.vehicle, typical(base.fitter.course))
    residual = Residual(position=position, force=force, time=time, subject=subject)
    given = {k: base.fit.values[k] for k in base.fit.freed}
    out: dict[str, list[dict[str, float]]] = {}
    for candidate in guessed:
        law, stem = law_of(library, candidate), candidate.keys[0].partition(".")[0]
        found = [] if law is None else law.guesses(residual)
        starts = [given | {f"{stem}.{p}": v for p, v in g.items()} for g in found]
        out.setdefault(candidate.name, []).extend(starts)
    return out


def law_of(library: Library, candidate: Candidate) -> Any:
    """Return the class of a candidate's law: an effect, the waves, or None without either."""
    stem = candidate.keys[0].partition(".")[0]
    if stem in library.effects:
        return type(library.effects[stem])
    return wave_law() if stem == WAVES else None


def free_force(problem: Problem, base: Hypothesis) -> tuple[Floats, Floats, Floats]:
    """Where, which and when: the force that best explains what a model leaves over, world axes."""
    fitter = rewindowed(base.fitter, gusts=LOOSE)
    misfit = fitter.misfit(base.fit.values)
    _, wrench = fitter.windows.explained(misfit.outputs[:, :, 0])
    rows = fitter.windows.rows[:, ::_EVERY].ravel()
    course = fitter.course
    force = rotate(matrix_of(course.quaternion[rows]), wrench[:, ::_EVERY, :3].reshape(-1, 3))
    return course.position[rows], force, problem.samples.time[rows]
