"""A model with some effects added, and how well it stands against others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from seals.sysid.factors import Candidate, Library
from seals.sysid.fit import Fitter
from seals.sysid.normal import Fit


@dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """Some candidates added to the nominal model, fitted.

    Args:
        candidates: that were added; none for the nominal model.
        fit: of their factors and the tolerances.
        fitter: the linearisation the fit belongs to.
        score: fall of the cost against the nominal model less the price of the freedom; 0 for the
            nominal model.
    """

    candidates: tuple[Candidate, ...]
    fit: Fit
    fitter: Fitter
    score: float

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects in the catalogue."""
        return tuple(c.name for c in self.candidates)

    @property
    def label(self) -> str:
        """Names with their variants."""
        return " + ".join(c.label for c in self.candidates) or "nominal model"


def keys_of(candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """Factors that the candidates free, once each."""
    return tuple(dict.fromkeys(k for c in candidates for k in c.all_keys))


def price(fit: Fit, library: Library) -> float:
    """What the freedom of a fit costs: the Occam factor of its freed factors.

    Equation:
        log det of the posterior precision less log det of the prior precision over all keys, priors
        of freed factors as wide as a plausible effect (Laplace's approximation of the evidence).
    """
    factors = library.factors
    widths = np.array(
        [
            max(factors[k].scale, factors[k].tolerance) if k in fit.freed else factors[k].tolerance
            for k in fit.keys
        ]
    )
    scaled = fit.normal.sum(axis=0) * widths[:, None] * widths[None, :]
    return float(np.linalg.slogdet(scaled + np.eye(len(widths)))[1])


def scored(
    candidates: Sequence[Candidate], fit: Fit, fitter: Fitter, nominal: Hypothesis
) -> Hypothesis:
    """Score a fit against that of the nominal model."""
    library = fitter.library
    # windows that follow a late sensor leave out rows, each worth one
    dropped = nominal.fitter.windows.observed - fitter.windows.observed
    gain = nominal.fit.cost - fit.cost - dropped
    paid = price(fit, library) - price(nominal.fit, library)
    score = gain - paid if np.isfinite(gain - paid) else -np.inf
    return Hypothesis(candidates=tuple(candidates), fit=fit, fitter=fitter, score=score)


def try_starts(
    fitter: Fitter,
    candidates: Sequence[Candidate],
    starts: Sequence[Mapping[str, float]],
) -> Fit:
    """Best fit from several starting values."""
    keys = keys_of(candidates)
    fits = [fitter.fit(keys, start=start) for start in starts]
    return min(fits, key=lambda f: f.cost)


def material(candidate: Candidate, fit: Fit, library: Library) -> bool:
    """Whether an effect is large enough to matter: beyond its tolerance, and not a mere trace."""
    tolerated, plausible, policy = 0.0, 0.0, library.policy
    for key in candidate.keys:
        factor = library.factors[key]
        if factor.tolerance > 0.0:
            tolerated = max(tolerated, abs(fit.values[key]) / factor.tolerance)
        plausible = max(plausible, abs(fit.values[key]) / factor.scale)
    exact = all(library.factors[k].tolerance == 0.0 for k in candidate.keys)
    # a slightly different law of another drag looks like a small one
    similar = policy.trace_of_similar if candidate.identification.resists else 1.0
    return plausible > similar * policy.trace if exact else tolerated > policy.tolerances
