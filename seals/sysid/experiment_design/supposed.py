"""Assumed sizes of effects for experiment design: fitted on the log, else plausible."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from seals.errors import ConfigError, suggestion
from seals.sysid.candidates.parameters import Candidate, CandidateSet
from seals.sysid.experiment_design.separation import Supposed
from seals.sysid.predictors.linear_screen import linear_gain, screen
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.problem import Problem
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, is_significant
from seals.sysid.selection.initial_guesses import initial_guesses, law_of

_FELT = 12.0
"""Fall of the misfit from which on a fitted size is believed."""


def supposed_of(
    problem: Problem, names: Sequence[str], known: Mapping[str, Mapping[str, float]] | None = None
) -> tuple[Supposed, ...]:
    """Return the effects with their assumed sizes.

    Args:
        problem: the log made ready.
        names: of effects in the catalogue.
        known: values by parameter key for names that were fitted already.

    Raises:
        ConfigError: an effect is not a candidate for this vehicle.
    """
    known = known or {}
    return tuple(_supposed(problem, name, known.get(name)) for name in names)


def _supposed(problem: Problem, name: str, known: Mapping[str, float] | None) -> Supposed:
    variants = variants_of(problem.plant.candidate_set, name)
    if known is not None:
        fits = [c for c in variants if set(known) <= set(c.all_keys)] or variants
        return Supposed(candidate=fits[0], values=dict(known))
    candidate = _likeliest(problem, variants)
    fit, fell = _fitted(problem, candidate)
    candidate_set = problem.plant.candidate_set
    if fell > _FELT and is_significant(candidate, fit, candidate_set):
        return Supposed(candidate=candidate, values={k: fit.values[k] for k in candidate.all_keys})
    return Supposed(candidate=candidate, values=_plausible(problem, candidate))


def variants_of(candidate_set: CandidateSet, name: str) -> list[Candidate]:
    """Return the variants of an effect: `weak_rotor`, for example, has one for each rotor.

    Raises:
        ConfigError: there is none.
    """
    found = [c for c in candidate_set.candidates if name in (c.name, c.label)]
    if not found:
        names = {c.name for c in candidate_set.candidates}
        raise ConfigError(
            f"effects: '{name}' is not a candidate for this vehicle.\n{suggestion(name, names)}"
        )
    return found


def _likeliest(problem: Problem, variants: Sequence[Candidate]) -> Candidate:
    """Return the variant with the largest linear gain on the log."""
    if len(variants) == 1:
        return variants[0]
    fitter = problem.fitter
    keys = tuple(dict.fromkeys(k for c in variants for k in c.all_keys))
    table = screen(fitter, fitter.start(()), keys)
    gains = [linear_gain(fitter, table, c.all_keys)[0] for c in variants]
    return variants[int(np.argmax(gains))]


def _fitted(problem: Problem, candidate: Candidate) -> tuple[Fit, float]:
    """Best fit on the log and the fall of the cost against the fitted stated model."""
    fitter, keys = problem.fitter, candidate.all_keys
    nominal = fitter.fit(())
    starts: list[Mapping[str, float]] = [{}]
    starts += [dict(zip(keys, s, strict=False)) for s in candidate.starts[:1]]
    if candidate.identification.guessed:
        base = EvidenceHypothesis(candidates=(), fit=nominal, fitter=fitter, score=0.0)
        starts = [s for _, s in initial_guesses(problem, base, [candidate])] or starts
    fits = [fitter.fit(keys, start=s, iterations=3) for s in starts]
    best = min(fits, key=lambda f: f.cost)
    return best, nominal.cost - best.cost


def _plausible(problem: Problem, candidate: Candidate) -> dict[str, float]:
    """Return plausible parameter values of an effect."""
    parameters = problem.plant.candidate_set.parameters
    middle = problem.fitter.trajectory.position.mean(axis=0)
    law = law_of(problem.plant.candidate_set, candidate)
    shape: Mapping[str, float] = {} if law is None else law.plausible(middle)
    out = {}
    for key in candidate.keys:
        factor = parameters[key]
        size = shape.get(factor.parameter, factor.scale)
        out[key] = float(np.clip(size, *factor.bounds))
    return {**out, **dict.fromkeys(candidate.nuisance, 0.0)}
