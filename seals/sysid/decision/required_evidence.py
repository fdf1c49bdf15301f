"""Evidence that the next effect of a model must bring to be accepted."""

from __future__ import annotations

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.predictors.problem import Problem
from seals.sysid.predictors.surface_model_error import SurfaceModelError
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis


def required_evidence(
    problem: Problem,
    base: EvidenceHypothesis,
    added: Candidate,
    *,
    surface_error: SurfaceModelError | None,
) -> float:
    """Return the rise in score [2 ln B] that a model's next effect must bring.

    Every case in which an effect needs more evidence than others is decided here.

    Args:
        problem: of the log; its policy holds the thresholds.
        base: the model without the effect.
        added: the effect.
        surface_error: model error where the hull pierces the surface; None where it never does.
    """
    policy = problem.policy
    required = policy.evidence
    if surface_error is not None:
        required += policy.evidence_surface
    if base.candidates:
        required += policy.evidence_further
        floats = surface_error is not None and surface_error.floats
        if floats or any(c.identification.approximate for c in base.candidates):
            required += policy.first_order_error * base.score
    if added.activity is not None or _another_power(base, added):
        # laws hold to a few per cent: one that fits well but not quite needs no second beside it
        required += policy.activity_share * max(base.score, _drag_accounts_for(base, added))
    if problem.vehicle.servo and not added.in_arm:
        required += policy.evidence_arm
    return required


def _another_power(base: EvidenceHypothesis, added: Candidate) -> bool:
    """Return true if a model has a law that differs from the added one by power or form only."""
    family = added.identification.family
    same = (c for c in base.candidates if c.identification.family == family)
    return bool(family) and any(c.variant == added.variant for c in same)


def _drag_accounts_for(base: EvidenceHypothesis, added: Candidate) -> float:
    """Return what drags of a model account for in the medium of a further drag [chi2].

    The score does not say it: the tolerances of the stated drag take over most of a hidden one. Its
    law is inexact by a share of the whole, and another drag for a time fits some of that.
    """
    if not added.identification.resists:
        return 0.0
    medium = added.variant.get("medium")
    drags = [c for c in base.candidates if c.identification.resists]
    keys = [k for c in drags if c.variant.get("medium") == medium for k in c.keys]
    return base.fit.accounted(keys) if keys else 0.0
