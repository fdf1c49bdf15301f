"""At what size effects are supposed to act: as fitted on the log, or else as is plausible."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from seals.errors import ConfigError, suggestion
from seals.sysid.experiment_design.separation import Supposed
from seals.sysid.factors import Candidate, Library
from seals.sysid.hypothesis import Hypothesis, material
from seals.sysid.normal import Fit
from seals.sysid.problem import Problem
from seals.sysid.screen import linear_gain, screen
from seals.sysid.special import law_of, special_starts

_FELT = 12.0
"""Fall of the misfit from which on a fitted size is believed."""


def supposed_of(
    problem: Problem,
    names: Sequence[str],
    known: Mapping[str, Mapping[str, float]] | None = None,
) -> tuple[Supposed, ...]:
    """Effects at their supposed sizes.

    Args:
        problem: the log made ready.
        names: of effects in the catalogue.
        known: values by factor key for names that were fitted already.

    Raises:
        ConfigError: an effect is not one that this vehicle could miss.
    """
    known = known or {}
    return tuple(_supposed(problem, name, known.get(name)) for name in names)


def _supposed(problem: Problem, name: str, known: Mapping[str, float] | None) -> Supposed:
    variants = variants_of(problem.plant.library, name)
    if known is not None:
        fits = [c for c in variants if set(known) <= set(c.all_keys)] or variants
        return Supposed(candidate=fits[0], values=dict(known))
    candidate = _likeliest(problem, variants)
    fit, fell = _fitted(problem, candidate)
    library = problem.plant.library
    if fell > _FELT and material(candidate, fit, library):
        return Supposed(candidate=candidate, values={k: fit.values[k] for k in candidate.all_keys})
    return Supposed(candidate=candidate, values=plausible(problem, candidate))


def variants_of(library: Library, name: str) -> list[Candidate]:
    """Variants of an effect, such as each rotor of a weak rotor.

    Raises:
        ConfigError: there is none.
    """
    found = [c for c in library.candidates if name in (c.name, c.label)]
    if not found:
        names = {c.name for c in library.candidates}
        raise ConfigError(
            f"effects: '{name}' is none that this vehicle could miss.\n{suggestion(name, names)}"
        )
    return found


def _likeliest(problem: Problem, variants: Sequence[Candidate]) -> Candidate:
    """The variant with the largest linear gain on the log."""
    if len(variants) == 1:
        return variants[0]
    fitter = problem.fitter
    keys = tuple(dict.fromkeys(k for c in variants for k in c.all_keys))
    table = screen(fitter, fitter.start(()), keys)
    gains = [linear_gain(fitter, table, c.all_keys)[0] for c in variants]
    return variants[int(np.argmax(gains))]


def _fitted(problem: Problem, candidate: Candidate) -> tuple[Fit, float]:
    """Best fit on the log and the fall of the cost against the nominal model."""
    fitter, keys = problem.fitter, candidate.all_keys
    nominal = fitter.fit(())
    starts: list[Mapping[str, float]] = [{}]
    starts += [dict(zip(keys, s, strict=False)) for s in candidate.starts[:1]]
    if candidate.identification.guessed:
        base = Hypothesis(candidates=(), fit=nominal, fitter=fitter, score=0.0)
        starts = list(special_starts(problem, base).get(candidate.name, starts))
    fits = [fitter.fit(keys, start=s, iterations=3) for s in starts]
    best = min(fits, key=lambda f: f.cost)
    return best, nominal.cost - best.cost


def plausible(problem: Problem, candidate: Candidate) -> dict[str, float]:
    """A size that the effect may well have."""
    factors = problem.plant.library.factors
    middle = problem.fitter.course.position.mean(axis=0)
    law = law_of(problem.plant.library, candidate)
    shape: Mapping[str, float] = {} if law is None else law.plausible(middle)
    out = {}
    for key in candidate.keys:
        factor = factors[key]
        size = shape.get(factor.parameter, factor.scale)
        out[key] = float(np.clip(size, *factor.bounds))
    return {**out, **dict.fromkeys(candidate.free, 0.0)}
