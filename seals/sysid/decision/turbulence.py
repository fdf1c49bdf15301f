"""Flows that vary: one for a time that is no stronger than its gusts is an average of them."""

from __future__ import annotations

import numpy as np

from seals.sysid.predictors.problem import Problem
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis


def varying_flow(problem: Problem, best: EvidenceHypothesis) -> str:
    """Return why a flow that acts for a time is a part of its own gusts; empty where it may act.

    Turbulence about no wind at all leaves an average over some seconds, which a fit finds.

    Equation:
        I = s_F / F, with the stated force of gusts s_F (1-sigma) and the root mean square F of the
        force that the flow adds while it acts; for small gusts that is the turbulence intensity,
        the ratio of the speeds.
    """
    flows = [c for c in best.candidates if c.identification.gusty and c.activity is not None]
    if not flows:
        return ""
    gust = float(problem.vehicle.gust[0])
    fitter, values = best.fitter, best.fit.values
    felt = fitter.prediction(values).reading[:, 3:6]
    mass = float(np.sum(problem.vehicle.robot.mass))
    for flow in flows:
        calm = fitter.prediction({**values, **dict.fromkeys(flow.all_keys, 0.0)}).reading[:, 3:6]
        assert flow.activity is not None
        acts = flow.activity.weights(problem.samples) > 0.0
        force = mass * float(np.sqrt(np.mean(np.sum((felt - calm)[acts] ** 2, axis=1))))
        if force * problem.policy.turbulence < gust:
            return (
                f"a {flow.name} varies here: what is steady of it, {force:.2g} N, is no more than "
                f"{force / gust:.2g} times its gusts of {gust:.2g} N"
            )
    return ""
