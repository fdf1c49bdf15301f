"""Hypotheses scored by the Laplace approximation of their evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from seals.arrays import Floats
from seals.sysid.candidates.parameters import Candidate, CandidateSet, prior_widths
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.scores.hypothesis import Hypothesis


@dataclass(frozen=True, kw_only=True)
class EvidenceHypothesis(Hypothesis):
    """Hypothesis fitted to a log, scored by the Laplace approximation of its evidence.

    Args:
        fit: of their parameters and the tolerances.
        fitter: the linearisation the fit belongs to.
        score: fall of the cost against the fitted stated model less the Occam factors, also of the
            times at which effects begin or end; 0 for the stated model.
    """

    fit: Fit
    fitter: Fitter
    score: float

    @property
    def misfit(self) -> float:
        """Misfit per degree of freedom; 1 is the noise floor."""
        return float(self.fit.misfit.sum() / self.fitter.windows.observed)

    @cached_property
    def _costs(self) -> dict[int, float]:
        return {self.fitter.windows.late: self.fit.cost}

    def cost_without(self, late: int) -> float:
        """Return the cost without the first rows of inertial readings in every window."""
        if late not in self._costs:
            rows = self.fitter.windows.without_first(late)
            misfit = self.fitter.with_windows(rows).misfit(self.fit.values)
            self._costs[late] = float(misfit.product(misfit).sum()) + self.fit.penalty
        return self._costs[late]


def occam_factor(fit: Fit, candidate_set: CandidateSet) -> float:
    """Compute the Occam factor of the free parameters of a fit.

    Equation:
        log det of the posterior precision less log det of the prior precision over all keys, priors
        of free parameters as wide as a plausible effect (Laplace's approximation of the evidence).
        It is not negative: measurements take no knowledge away.
    """
    widths = prior_widths(candidate_set.parameters, fit.keys, fit.free, 1.0)
    scaled = fit.normal.sum(axis=0) * widths[:, None] * widths[None, :]
    return _log_information(scaled)


def _log_information(scaled: Floats) -> float:
    """Compute log det (N + 1) of an information matrix N in units of its prior.

    Rounding can leave N with negative eigenvalues, for it is a difference of large products; these
    count as zero, as in `posterior_covariance`.

    Args:
        scaled: information matrix, shape (p, p), symmetric up to rounding.

    Returns:
        Twice the information in nats; NaN where the matrix holds values not finite.

    Example:
        >>> round(_log_information(np.diag([np.e - 1.0, -9.0])), 12)
        1.0
    """
    if not np.isfinite(scaled).all():
        return float("nan")
    whole = scaled + np.eye(len(scaled))
    try:
        np.linalg.cholesky(whole)
    except np.linalg.LinAlgError:
        values = np.linalg.eigvalsh(0.5 * (scaled + scaled.T))
        return float(np.log1p(np.maximum(values, 0.0)).sum())
    return float(np.linalg.slogdet(whole)[1])


def scored(
    candidates: Sequence[Candidate], fit: Fit, fitter: Fitter, nominal: EvidenceHypothesis
) -> EvidenceHypothesis:
    """Score a fit against that of the stated model."""
    candidate_set = fitter.candidate_set
    # windows that follow a late sensor leave out rows, which count for neither
    gain = nominal.cost_without(fitter.windows.late) - fit.cost
    paid = occam_factor(fit, candidate_set) - occam_factor(nominal.fit, candidate_set)
    paid += sum(c.activity.occam_factor for c in candidates if c.activity is not None)
    score = gain - paid if np.isfinite(gain - paid) else -np.inf
    return EvidenceHypothesis(candidates=tuple(candidates), fit=fit, fitter=fitter, score=score)


def is_significant(candidate: Candidate, fit: Fit, candidate_set: CandidateSet) -> bool:
    """Return true if an effect exceeds its tolerance and is not negligible.

    A value beyond what its law allows, such as negative friction, counts as the nearest allowed.
    """
    tolerated, plausible, policy = 0.0, 0.0, candidate_set.policy
    sizes = {k: abs(candidate_set.allowed(k, fit.values[k])) for k in candidate.keys}
    for key, size in sizes.items():
        parameter = candidate_set.parameters[key]
        if parameter.tolerance > 0.0:
            tolerated = max(tolerated, size / parameter.tolerance)
        plausible = max(plausible, size / parameter.scale)
    if all(size < candidate_set.parameters[k].least for k, size in sizes.items()):
        return False
    exact = all(candidate_set.parameters[k].tolerance == 0.0 for k in candidate.keys)
    # a slightly different law of another drag looks like a small one
    similar = policy.trace_of_similar if candidate.identification.resists else 1.0
    return plausible > similar * policy.trace if exact else tolerated > policy.tolerances
