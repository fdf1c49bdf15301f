"""Effects of the place that a general force of the place explains better than they do.

A cable that is always taut, a magnet and the suction of an inlet all draw toward a point, and one
flight passes it at few distances: the parameters of one law bend to the force of another. The
general law has the centre, the softening radius and the power of the distance as free numbers.
"""

from __future__ import annotations

from seals.sysid.predictors.problem import Problem
from seals.sysid.residual_force.conditions import conditions
from seals.sysid.residual_force.evidence import evidence
from seals.sysid.residual_force.place import pull
from seals.sysid.residual_force.regress import Table, gain
from seals.sysid.residual_force.residual import residual
from seals.sysid.residual_force.terms import basis_of
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis


def better_general_law(problem: Problem, best: EvidenceHypothesis) -> str:
    """Return the reason against a model whose effect depends on the place; empty without one.

    The misfit of the model is compared with the misfit that a central force of any power leaves on
    held-out windows of the stated model.
    """
    placed = [c.label for c in best.candidates if c.identification.placed]
    if not placed or not problem.samples.posed:
        return ""
    found = evidence(problem)
    around = conditions(problem.fitter, found)
    toward = pull(found, around, residual(found, around))
    if toward is None:
        return ""
    left = Table(found, basis_of("pull", toward.settings, around)).held_out([0])
    more = gain(evidence(problem, best).before, left, found)
    if more.total <= max(problem.policy.general_law, 2.0 * more.total_sd):
        return ""
    return (
        f"a central force ~ 1/r^{toward.power:.2g} explains the residual force better than "
        f"{', '.join(placed)} does"
    )
