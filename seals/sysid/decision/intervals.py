"""Parameters of an effect as reported: values with 90 % intervals."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.schema import parameters_of
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.candidates.reported_values import at_bound, reported_values, with_interval
from seals.sysid.decision.answer import Claim
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection.initial_guesses import law_of


def parameters(candidate: Candidate, fit: Fit, hypothesis: EvidenceHypothesis) -> dict[str, Any]:
    """Fitted parameters with 90 % intervals.

    Of a number that the fit has at its bound, such as a coefficient of zero that cannot be
    negative, mean and interval are those of a normal law cut off there.
    """
    out = _symmetric(candidate, fit, hypothesis)
    known = hypothesis.fitter.candidate_set.parameters
    for key, name in zip(candidate.keys, candidate.reported, strict=True):
        low = known[key].bounds[0]
        if fit.values[key] <= low + 1e-6 * known[key].scale:
            out[name] = at_bound(out[name])
    return out


def _symmetric(candidate: Candidate, fit: Fit, hypothesis: EvidenceHypothesis) -> dict[str, Any]:
    """Fitted parameters with 90 % intervals about them, whatever their bounds."""
    out: dict[str, Any] = {
        name: {"value": value, "low90": value, "high90": value, "unit": "1"}
        for name, value in candidate.variant.items()
        if name in ("rotor", "joint")
    }
    candidate_set = hypothesis.fitter.candidate_set
    values, own = reported_values(
        candidate, candidate_set, fit.values, hypothesis.fitter.trajectory.joint_velocity
    )
    law = law_of(candidate_set, candidate)
    meta = {} if law is None else parameters_of(law)
    for key, name in zip(candidate.keys, candidate.reported, strict=True):
        value, spread = values[key], fit.robust_spread(key)
        parameter = candidate_set.parameters[key].parameter
        unit = meta[parameter].unit if parameter in meta else "1"
        # the datasheet's tolerance of the same quantity cannot be told from the effect
        out[name] = with_interval(value, float(np.hypot(spread, own[key])), unit)
    return out


def holds_zero(claim: Claim[EvidenceHypothesis]) -> bool:
    """Return true if the 90 % intervals of all parameters of a claim hold zero: no effect."""
    candidate, hypothesis = claim.candidate, claim.hypothesis
    found = _symmetric(candidate, hypothesis.fit, hypothesis)
    sizes = [p for name, p in found.items() if name not in candidate.variant]
    return bool(sizes) and all(p["low90"] <= 0.0 <= p["high90"] for p in sizes)
