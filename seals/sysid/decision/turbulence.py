"""Effects for a time that are none: an average of gusts, or a step in place of a steady change."""

from __future__ import annotations

import numpy as np

from seals.sysid.candidates.activity import Activity, Span
from seals.sysid.predictors.linear_screen import candidate_keys
from seals.sysid.predictors.problem import Problem
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, scored


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


def steady_change(problem: Problem, nominal: EvidenceHypothesis, best: EvidenceHypothesis) -> str:
    """Return why an effect that begins or ends changes steadily instead; empty where it does not.

    A thrust that falls as the battery runs down, found as a step in the middle of the log: the same
    effect in proportion to the time explains more.
    """
    for k, candidate in enumerate(best.candidates):
        activity = candidate.activity
        if activity is None or candidate.identification.gusty:
            continue
        if not all((span.start is None) != (span.end is None) for span in activity.spans):
            continue
        grown = Activity(spans=tuple(Span(log=span.log) for span in activity.spans), growing=True)
        acting = candidate.throughout.acting(grown)
        candidates = (*best.candidates[:k], acting, *best.candidates[k + 1 :])
        keys, fitter = candidate_keys(candidates), best.fitter.acting(candidates)
        fit = fitter.fit(keys, start={key: best.fit.values[key] for key in keys})
        found = scored(candidates, fit, fitter, nominal)
        name = candidate.throughout.keys[0].partition(".")[2]
        if found.score > best.score + problem.policy.exchange_gain:
            return (
                f"{candidate.name} changes steadily along the log here, by "
                f"{fit.values[acting.keys[0]]:.2g} ({name}) from its start to its "
                f"end: that explains {found.score - best.score:.0f} more than a step does"
            )
    return ""
