"""Reasons against naming an effect that fits: another law, or none, would fit as well or better.

- The power of a drag: the law of one power bends to the force of another.
- A force of the place: a cable that is always taut, a magnet and the suction of an inlet all draw
  toward a point, and one flight passes it at few distances. The general law has the centre, the
  softening radius and the power of the distance as free numbers.
- A point that the log does not locate: a pull toward it bends to almost any smooth force.
- A flow for a time that is an average of gusts, one that is another in a part of the log, and a
  step in place of a steady change.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from seals.arrays import Floats
from seals.effects.discrepancy import DragExponent
from seals.effects.effect import Effect, MediumKind
from seals.sysid.candidates.activity import Activity, Moment, Span
from seals.sysid.candidates.parameters import Candidate, CandidateSet, Parameter
from seals.sysid.predictors.extended_model import ExtendedModel
from seals.sysid.predictors.linear_screen import candidate_keys
from seals.sysid.predictors.problem import Problem, linearise_model, typical_speeds
from seals.sysid.residual_force.conditions import conditions
from seals.sysid.residual_force.evidence import evidence
from seals.sysid.residual_force.place import pull
from seals.sysid.residual_force.regress import Table, gain
from seals.sysid.residual_force.residual import residual
from seals.sysid.residual_force.terms import basis_of
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, scored


def other_power(problem: Problem, best: EvidenceHypothesis) -> str:
    """Return the reason against a drag whose power of the speed is not its law's; else nothing.

    One flight has few speeds: the law of one power bends to the force of another, and the drag of a
    third power leaves little beside one of the second. So the power of a drag that acts throughout
    is fitted as one more number, of the speed along each axis and of that of the whole body: a
    drag of the second power that counts the whole speed stays below the threshold in both.

    Args:
        problem: of the log.
        best: model of the answer.
    """
    if _two_laws(best):
        return "a drag that grows neither with the first nor with the second power of the speed"
    if not problem.samples.posed or problem.impact:
        return ""
    for candidate in best.candidates:
        power = candidate.identification.power
        if not power or candidate.activity is not None or not _by_axis(best, candidate):
            continue
        for squares in (_own_squares(best, candidate), np.ones((1, 3, 3))):
            change, error = fitted_change(problem, best, candidate, squares)
            if change - 2.0 * error > problem.policy.other_power:
                return (
                    f"a drag that grows with the power {power + change:.2g} of the speed, which is "
                    f"not that of {candidate.label}"
                )
    return ""


def _by_axis(best: EvidenceHypothesis, candidate: Candidate) -> bool:
    """Return true for a law of a medium with a coefficient for each axis: other forms pass."""
    law = best.fitter.candidate_set.effects[candidate.instance]
    return len(candidate.keys) == 3 and isinstance(vars(law).get("medium"), MediumKind)


def _own_squares(best: EvidenceHypothesis, candidate: Candidate) -> Floats | None:
    """Return the axes whose speeds count in a drag's own law, shape (1, 3, 3); None for its own."""
    law = best.fitter.candidate_set.effects[candidate.instance]
    return law.constants().get("squares")


def _two_laws(best: EvidenceHypothesis) -> bool:
    """Return true if two laws of one variant differ only by power or form of the speed."""
    laws = {
        (c.identification.family, tuple(c.variant.items()), c.name, c.law)
        for c in best.candidates
        if c.identification.family
    }
    return len({law[:2] for law in laws}) < len(laws)


def fitted_change(
    problem: Problem, best: EvidenceHypothesis, candidate: Candidate, squares: Floats | None
) -> tuple[float, float]:
    """Return the change of a drag's power of the speed that fits best, and its 1-sigma.

    Args:
        problem: of the log.
        best: model with the drag.
        candidate: the drag.
        squares: adds the squared velocities whose power it is, shape (1, 3, 3); None for that along
            each axis alone.
    """
    known, values = best.fitter.candidate_set, dict(best.fit.values)
    speeds = typical_speeds(best.fitter.trajectory)
    x, y, z = (float(values[key]) for key in candidate.keys)
    law = known.effects[candidate.instance]
    shape = DragExponent(
        power=candidate.identification.power,
        coefficients=(x, y, z),
        speeds=(float(speeds[0]), float(speeds[1]), float(speeds[2])),
        squares=squares,
        medium=_medium(law),
    )
    shape.correction = True
    name = f"{candidate.instance}_power"
    key = f"{name}.exponent"
    plant = _extended(problem, known, name, shape, key).acting(best.candidates)
    gusts = best.fitter.windows.gusts
    fitter = linearise_model(plant, best.fitter.trajectory, values, gusts=gusts)
    fit = fitter.fit((*best.fit.free, key), start=values)
    return float(fit.values[key]), fit.robust_spread(key)


def _extended(
    problem: Problem, known: CandidateSet, name: str, effect: Effect, key: str
) -> ExtendedModel:
    """Return the plant with one more effect and its parameter."""
    free = Parameter(key=key, scale=problem.policy.other_power, bounds=(-2.0, 4.0))
    wider = replace(
        known,
        effects={**known.effects, name: effect},
        parameters={**known.parameters, key: free},
    )
    return ExtendedModel(problem.vehicle, wider, problem.samples, parts=problem.plant.parts)


def _medium(law: Effect) -> MediumKind:
    medium = vars(law)["medium"]
    assert isinstance(medium, MediumKind)
    return medium


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


def unlocated(best: EvidenceHypothesis) -> list[int]:
    """Return the places among a model's candidates of those toward a point that is not known."""
    most = best.fitter.candidate_set.policy.centre_known
    return [i for i, c in enumerate(best.candidates) if centre_error(best, c) > most]


def centre_error(best: EvidenceHypothesis, candidate: Candidate) -> float:
    """Return the standard error of the point toward which a force acts by its mean distance [1].

    Zero for effects that do not act toward a point.
    """
    centre = candidate.identification.centre
    keys = [k for k in candidate.keys if k.partition(".")[2].startswith(f"{centre}_")]
    if not centre or len(keys) != 3:
        return 0.0
    point = np.array([best.fit.values[k] for k in keys])
    away = np.linalg.norm(best.fitter.trajectory.position - point, axis=1)
    error = math.sqrt(sum(best.fit.robust_spread(k) ** 2 for k in keys))
    return error / max(float(away.mean()), 1e-9)


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
    for flow in flows:
        force = _force_of(problem, best, flow)
        if force * problem.policy.turbulence < gust:
            return (
                f"a {flow.name} varies here: what is steady of it, {force:.2g} N, is no more than "
                f"{force / gust:.2g} times its gusts of {gust:.2g} N"
            )
    return ""


def _force_of(problem: Problem, best: EvidenceHypothesis, flow: Candidate) -> float:
    """Root mean square force that a flow adds while it acts [N]."""
    fitter, values = best.fitter, best.fit.values
    still = {**values, **dict.fromkeys(flow.all_keys, 0.0)}
    added = fitter.prediction(values).reading[:, 3:6] - fitter.prediction(still).reading[:, 3:6]
    if flow.activity is not None:
        added = added[flow.activity.weights(problem.samples) > 0.0]
    mass = float(np.sum(problem.vehicle.robot.mass))
    return mass * float(np.sqrt(np.mean(np.sum(added**2, axis=1))))


def weak_flows(problem: Problem, best: EvidenceHypothesis) -> list[Candidate]:
    """Return the flows of a model that act throughout and are hardly stronger than their gusts."""
    flows = [c for c in best.candidates if c.identification.gusty and c.activity is None]
    most = problem.vehicle.gust[0] / problem.policy.turbulence if flows else 0.0
    return [flow for flow in flows if _force_of(problem, best, flow) <= most]


_PARTS = ((0.0, 1.0 / 3.0), (1.0 / 3.0, 2.0 / 3.0), (2.0 / 3.0, 1.0), (0.0, 0.5))
"""Parts of a log in which a flow that acts throughout is compared with itself elsewhere."""


def changing_flow(problem: Problem, nominal: EvidenceHypothesis, best: EvidenceHypothesis) -> str:
    """Return why a flow that acts throughout is no steady one; empty where it is.

    Turbulence about no wind at all leaves an average over a whole flight, too, which is hardly
    stronger than the gusts. A second flow of the same law that acts beside it in a part of the log
    is evidence only where the first one changes: beside a steady one it loses the Occam factor of
    its numbers.
    """
    flows = weak_flows(problem, best)
    if not flows or len(problem.samples.logs) > 1:
        # from one log to the next it may be another one
        return ""
    time = problem.samples.time
    first, long = float(time[0]), float(np.ptp(time))
    for flow in flows:
        for begin, end in _PARTS:
            span = Span(
                log=0,
                start=_sharp(first + begin * long) if begin > 0.0 else None,
                end=_sharp(first + end * long) if end < 1.0 else None,
            )
            candidates = (*best.candidates, flow.acting(Activity(spans=(span,))))
            keys, fitter = candidate_keys(candidates), best.fitter.acting(candidates)
            fit = fitter.fit(keys, start={key: best.fit.values.get(key, 0.0) for key in keys})
            more = scored(candidates, fit, fitter, nominal).score - best.score
            if more > problem.policy.exchange_gain:
                return (
                    f"a {flow.name} varies here: another one from {first + begin * long:.3g} to "
                    f"{first + end * long:.3g} s than before and after explains {more:.0f} more"
                )
    return ""


def _sharp(time: float) -> Moment:
    return Moment(value=time, low90=time, high90=time)


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
