"""Decision by Laplace evidence: named effects, indistinguishable ones, or a refusal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision.answer import Answer, Claim, Rival, claim_against, reported, verdict_of
from seals.sysid.decision.data_sheet import with_data_sheet
from seals.sysid.decision.intervals import holds_zero
from seals.sysid.decision.moved_numbers import MovedNumber, stated_wrong
from seals.sysid.decision.policy import TieRule
from seals.sysid.decision.reasons_against import (
    better_general_law,
    changing_flow,
    other_power,
    steady_change,
    unlocated,
    varying_flow,
    weak_flows,
)
from seals.sysid.decision.required_evidence import required_evidence
from seals.sysid.decision.verdict import Verdict
from seals.sysid.predictors.problem import LATE, Problem
from seals.sysid.predictors.surface_model_error import surface_model_error
from seals.sysid.scores.channels import ChannelErrors, channel_errors
from seals.sysid.scores.disturbance_level import DisturbanceLevel, disturbance_level
from seals.sysid.scores.excitation import best_gains, expected_gains
from seals.sysid.scores.held_out import explained_by_log, held_out_misfit, stated_misfit
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, is_significant
from seals.sysid.scores.self_check import self_check
from seals.sysid.selection.search import Search
from seals.sysid.selection.window_models import rivals_of


@dataclass(frozen=True, kw_only=True)
class EvidenceAnswer(Answer[EvidenceHypothesis]):
    """Answer of a diagnosis of one log.

    Args:
        disturbance_level: of the residual.
        explained: share of the misfit that the claims explain.
        excitation: expected gain by candidate.
        blind: effects that the log could not show; few of them do not hinder a verdict.
        channels: errors by channel under the stated, the calibrated and the best model.
        stated_wrong: stated numbers that lie too far off to be chance.
    """

    disturbance_level: DisturbanceLevel
    explained: float
    excitation: Mapping[str, float] = field(default_factory=dict)
    blind: tuple[str, ...] = ()
    channels: ChannelErrors = field(default_factory=ChannelErrors)
    stated_wrong: tuple[MovedNumber, ...] = ()

    def ended(self, verdict: Verdict, *reasons: str) -> EvidenceAnswer:
        """Return the answer with a verdict that names nothing, and why."""
        return replace(self, verdict=verdict, reasons=reasons)


def decide(
    problem: Problem, search: Search[EvidenceHypothesis], *, processes: int = 1
) -> EvidenceAnswer:
    """Decide on the result of a search; the processes share the fits of the rivals.

    Nothing is missing only where no effect is found, every channel stays in its band, no effect's
    score passes the bar and no stated number lies too far off. An effect is named only where the
    error falls by it, no channel is left outside its band, and its interval does not hold zero.
    """
    best = search.best
    errors = channel_errors(search.nominal, best)
    open_answer = EvidenceAnswer(
        verdict=Verdict.cannot_tell,
        claims=(),
        disturbance_level=disturbance_level(best),
        explained=explained_share(search),
        channels=errors,
    )
    refusal = _refusal(problem, search, open_answer.disturbance_level, open_answer.explained)
    if not refusal and not best.candidates:
        return _quiet(problem, search, open_answer)
    if not refusal and _unexcited(problem, search, best):
        return _quiet(problem, search, open_answer, blind=[c.name for c in best.candidates])
    lost = unlocated(best)
    if not refusal and len(lost) == len(best.candidates):
        refusal = f"the log does not locate the point toward which {best.label} would act"
    refusal = refusal or other_power(problem, best) or better_general_law(problem, best)
    refusal = refusal or varying_flow(problem, best) or steady_change(problem, search.nominal, best)
    refusal = refusal or changing_flow(problem, search.nominal, best)
    left = _left_in_channels(problem, best, errors)
    step = problem.vehicle.simulated_step if left else None
    if refusal or (left and step is None):
        return open_answer.ended(Verdict.none_of_these, refusal or left)
    if left and step is not None:
        return open_answer.ended(Verdict.cannot_tell, f"{left}; {_of_step(step)}")
    if not _falls(search):
        return _not_falling(problem, search, open_answer)
    return _named(problem, search, open_answer, lost, processes)


def _of_step(step: float) -> str:
    """Return in words that the step of a simulation may be what is left over."""
    return (
        f"the simulation's step of {1e3 * step:g} ms may be the cause: "
        f"a run with time.step={0.25 * step:g} would tell"
    )


def _named(
    problem: Problem,
    search: Search[EvidenceHypothesis],
    open_answer: EvidenceAnswer,
    lost: Sequence[int],
    processes: int,
) -> EvidenceAnswer:
    """Claim the effects of the best model with their confidences."""
    best, policy = search.best, problem.policy
    temperature = evidence_temperature(problem)
    ties = policy.evidence_ties(assumed=problem.vehicle.assumed)
    claims = [
        _claim(search, best, k, temperature, ties, processes=processes)
        for k in range(len(best.candidates))
    ]
    if best.misfit > policy.misfit_trusted:
        claims = [replace(c, confidence=c.confidence * open_answer.explained) for c in claims]
    least = _least_share(problem, search)
    claims = [
        replace(c, confidence=0.0 if c.index in lost else min(c.confidence, least)) for c in claims
    ]
    check = self_check(best)
    if check is not None:
        deceived = max(check.gain, 0.0) / max(search.nominal.fit.cost - best.fit.cost, 1e-9)
        if deceived > policy.self_deception:
            words = (
                f"the fit misses {best.label} in a simulation that holds it, by "
                f"{100.0 * deceived:.0f} % of its gain"
            )
            return open_answer.ended(Verdict.cannot_tell, words)
        known = replace(best, fit=replace(best.fit, error=check.error))
        claims = [
            replace(c, hypothesis=known, confidence=c.confidence * (1.0 - deceived)) for c in claims
        ]
    claims.sort(key=lambda c: -c.confidence)
    claims = with_data_sheet(problem, search, claims)
    late = _pose_late(claims)
    if late:
        return open_answer.ended(Verdict.bad_data, late)
    named = [c for c in reported(claims, ties) if not holds_zero(c)]
    if not named:
        words = f"the intervals of {', '.join(c.name for c in claims)} hold zero"
        return open_answer.ended(Verdict.cannot_tell, words)
    return replace(
        open_answer,
        verdict=verdict_of(named),
        claims=tuple(named),
        stated_wrong=_wrong_numbers(problem, named[0].hypothesis),
    )


def _pose_late(claims: Sequence[Claim[EvidenceHypothesis]]) -> str:
    """Return why the data are bad where inertial sensors would have to read ahead of the pose."""
    for claim in claims:
        late = claim.hypothesis.fitter.candidate_set.sensor_delay
        delay = claim.hypothesis.fit.values[late] if late in claim.candidate.keys else 0.0
        if delay < -LATE:
            return (
                f"position and orientation are {-1e3 * delay:.0f} ms late against the inertial "
                "sensors: shift them to one clock"
            )
    return ""


def _wrong_numbers(problem: Problem, hypothesis: EvidenceHypothesis) -> tuple[MovedNumber, ...]:
    """Return the stated numbers that a model moves too far to be chance.

    Where a hull pierces the surface, and on a vehicle with an arm, inexact laws move numbers too:
    the evidence asked besides is that of effects there.
    """
    policy = problem.policy
    if not hypothesis.fit.keys:
        return ()
    pierced = surface_model_error(problem.plant, hypothesis.fitter.trajectory) is not None
    extra = policy.evidence_surface if pierced else 0.0
    extra += policy.evidence_arm if problem.vehicle.servo else 0.0
    return stated_wrong(hypothesis, extra=extra)


def _left_in_channels(problem: Problem, best: EvidenceHypothesis, errors: ChannelErrors) -> str:
    """Return the channel in which a model with effects leaves too much; empty without one.

    Play and dry friction in an arm shake the base as well: their laws are judged by the misfit.
    A flow that is hardly stronger than its gusts leaves a channel outside its band where it varies.
    """
    policy = problem.policy
    least = 0.0 if weak_flows(problem, best) else policy.channel_left
    most = (e for e in errors.outside if not e.after <= least)
    left = [e for e in most if not e.share >= policy.channel_explained]
    if not left or (problem.vehicle.servo and any(c.in_arm for c in best.candidates)):
        return ""
    worst = left[0]
    return (
        f"{worst.name} is left {worst.after:.2g} times its expected error, where a right model "
        f"leaves up to {worst.band:.2g}"
    )


def _falls(search: Search[EvidenceHypothesis]) -> bool:
    """Return true if the held-out error falls from the stated model to the best one.

    Each effect must lower it by its share. The stated model counts, not the one with its numbers
    fitted: a wrong mass that is named as an effect was taken over by its number. Where much is
    left, the error must fall below that of the fitted numbers, too.
    """
    best, nominal = search.best, search.nominal
    policy = best.fitter.candidate_set.policy
    after = held_out_misfit(best)
    if after > policy.plain_form and not after < held_out_misfit(nominal):
        return False
    least = 1.0 - policy.error_falls * len(best.candidates)
    return after < least * stated_misfit(nominal)


def _not_falling(
    problem: Problem, search: Search[EvidenceHypothesis], open_answer: EvidenceAnswer
) -> EvidenceAnswer:
    """Answer where the best model explains more, but predicts no better than the stated one.

    Nothing that matters is missing where the stated model keeps every channel in its band. Gusts
    that may be admitted do as well as a flow whose steady part is small.
    """
    best = search.best
    if all(e.stated <= e.band for e in open_answer.channels.errors):
        return _quiet(problem, search, open_answer)
    least = 100.0 * problem.policy.error_falls * len(best.candidates)
    words = (
        f"the held-out error decreases by less than {least:.2g} % from the stated model to the one "
        f"with {best.label}, or not at all from the one with its numbers fitted"
    )
    if any(c.identification.gusty for c in best.candidates):
        words += ": the steady part of the flow is small compared with its gusts"
        return open_answer.ended(Verdict.none_of_these, words)
    return open_answer.ended(Verdict.cannot_tell, words)


def explained_share(search: Search[EvidenceHypothesis]) -> float:
    """Share of the excess misfit of the stated model that the chosen one explains."""
    best, before = search.best, search.nominal.fit.cost
    policy = best.fitter.candidate_set.policy
    floor = policy.noise_floor * float(best.fitter.windows.observed)
    return (before - best.fit.cost) / max(before - min(floor, best.fit.cost), 1e-9)


def _refusal(
    problem: Problem, search: Search[EvidenceHypothesis], left: DisturbanceLevel, share: float
) -> str:
    """Return why no effect may be named although something is missing; empty where one may."""
    best, policy = search.best, problem.policy
    least = policy.disturbance_evidence * (1.0 if problem.samples.posed else policy.unposed)
    restless = left.between > policy.disturbance_refused and left.gain > least
    if restless and share < policy.explained:
        return f"a force or a sensor error is left over, {left.between:.2g} times the stated gusts"
    changed, most = _changed_data_sheet(best)
    if restless and changed > policy.data_sheet_kept:
        return (
            f"a force is left over, {left.between:.2g} times the stated gusts, although the "
            f"numbers of the data sheet are changed by {changed:.1f} tolerances, {most} most of all"
        )
    floors = best.misfit
    if not math.isfinite(floors):
        return "no model can be followed along this log: with what it lacks, they diverge"
    if not floors <= math.exp(2.0 * policy.gross_error):
        return f"the best model leaves a misfit of {floors:.3g} times the noise floor"
    if floors > policy.misfit_trusted and share < policy.explained:
        return (
            f"the best model leaves a misfit of {floors:.3g} times the noise floor and explains "
            f"{100.0 * share:.0f} % of the excess"
        )
    return ""


def _least_share(problem: Problem, search: Search[EvidenceHypothesis]) -> float:
    """Least share of the excess that the chosen model explains in any of several logs.

    One cause fits all logs of a vehicle: where one of them keeps its misfit on held-out windows,
    something else acts there, and may act in the others under the same name.
    """
    if len(problem.samples.logs) < 2:
        return 1.0
    return float(explained_by_log(search.nominal, search.best).min())


def _changed_data_sheet(best: EvidenceHypothesis) -> tuple[float, str]:
    """Root mean square change of stated numbers in tolerances, and the number changed most."""
    parameters = best.fitter.candidate_set.parameters
    changes = {
        key: value / parameters[key].tolerance
        for key, value in best.fit.values.items()
        if key not in best.fit.free and parameters[key].tolerance > 0.0
    }
    if not changes:
        return 0.0, ""
    most = max(changes, key=lambda key: abs(changes[key]))
    return math.sqrt(sum(z * z for z in changes.values()) / len(changes)), most


def evidence_temperature(problem: Problem) -> float:
    """Evidence temperature: score difference that changes the odds of two models by a factor e."""
    policy = problem.policy
    return policy.temperature * (1.0 if problem.samples.posed else policy.unposed)


def _unexcited(
    problem: Problem, search: Search[EvidenceHypothesis], best: EvidenceHypothesis
) -> bool:
    """Return true if the log could show none of the named effects at a plausible size."""
    gains = expected_gains(search.nominal)
    candidate_set, policy = best.fitter.candidate_set, problem.policy

    def shown(candidate: Candidate) -> bool:
        gain = gains.get(candidate.label, np.inf)
        if gain < policy.excitation and best.score < policy.certain:
            return False
        # a log that is moved by its own feedback: gusts that it fights look like a weaker response;
        # what falls freely has no feedback that could fight gusts
        if problem.impact or not candidate.identification.answers:
            return True
        parameters = [candidate_set.parameters[k] for k in candidate.keys]
        if any(f.tolerance == 0.0 for f in parameters):
            return True
        most = sum((f.scale / f.tolerance) ** 2 for f in parameters)
        asked = [score for share, score in policy.response if gain >= share * most]
        return best.score >= (asked[0] if asked else policy.response_evidence_weak)

    return not any(shown(c) for c in best.candidates)


def _quiet(
    problem: Problem,
    search: Search[EvidenceHypothesis],
    open_answer: EvidenceAnswer,
    blind: Sequence[str] = (),
) -> EvidenceAnswer:
    """Decide without a significant effect: nothing missing, or why that cannot be said."""
    nominal, policy = search.nominal, problem.policy
    gains = expected_gains(nominal)
    names = best_gains(gains)
    ranks = {c.name: c.identification.needs_motion for c in nominal.fitter.candidate_set.candidates}
    asked = sorted((rank, n) for n, rank in ranks.items() if rank is not None and n in names)
    # what acts in the other medium alone is nothing that this log could show
    unseen = [n for _, n in asked if policy.absent < names[n] < policy.excitation]
    if unseen:
        # nor is what its stated twin may be within a tolerance: no motion tells them apart
        endless = best_gains(expected_gains(nominal, more=policy.endless))
        unseen = [n for n in unseen if endless[n] >= policy.excitation]
    # most of what needs motion was seen: the few that were not are told beside the verdict
    still = bool(blind) or len(unseen) >= policy.unseen * len(asked) > 0.0
    blind = list(dict.fromkeys((*blind, *unseen)))
    reasons = [f"this log could not show {', '.join(blind)}"] if still else []
    if open_answer.channels.outside and not search.best.candidates:
        worst = open_answer.channels.outside[0]
        reasons.append(
            f"{worst.name} is {worst.after:.2g} times its expected error, where a right model "
            f"leaves up to {worst.band:.2g}, and no effect of the library accounts for it"
        )
    reasons += _passed(problem, search)
    step = problem.vehicle.simulated_step
    if step and len(reasons) > int(still):
        reasons[-1] += f"; {_of_step(step)}"
    wrong = _wrong_numbers(problem, nominal)
    if wrong:
        many = f"{len(wrong)} stated numbers are" if len(wrong) > 1 else "a stated number is"
        reasons.append(
            f"{many} too far off to be chance: wrong in the data sheet, or moved by an effect that "
            "looks like it"
        )
    return replace(
        open_answer,
        verdict=Verdict.cannot_tell if reasons else Verdict.nothing_missing,
        explained=1.0,
        excitation=gains,
        reasons=tuple(reasons) or ("misfit within tolerance",),
        blind=tuple(blind),
        stated_wrong=wrong,
    )


def _passed(problem: Problem, search: Search[EvidenceHypothesis]) -> list[str]:
    """Return why an effect whose score passes the bar is not named, where none is."""
    if search.best.candidates or not search.rounds:
        return []
    nominal = search.nominal
    sets = problem.plant.candidate_set
    surface = surface_model_error(problem.plant, nominal.fitter.trajectory)
    for tried in search.rounds[0]:
        added = tried.candidates[-1]
        least = required_evidence(problem, nominal, added, surface_error=surface)
        if tried.score < least or not is_significant(added, tried.fit, sets):
            continue
        calm = disturbance_level(nominal).allowance - disturbance_level(tried).allowance
        if tried.score - calm >= least:
            return [
                f"{added.label} would explain the log better (score {tried.score:.3g}, a name needs"
                f" {least:.3g}), but held-out windows, or an error below the stated noise, speak "
                "against it"
            ]
    return []


def _claim(
    search: Search[EvidenceHypothesis],
    best: EvidenceHypothesis,
    index: int,
    temperature: float,
    ties: TieRule,
    *,
    processes: int,
) -> Claim[EvidenceHypothesis]:
    """Compute the confidence in one effect against its rivals.

    Equation:
        odds of a rival = exp(-(score - its score) / T) with the evidence temperature T, scores
        twice a log of evidence.
    """
    own, found = best.candidates[index], list[Rival]()
    policy = best.fitter.candidate_set.policy
    # as in the search: what acts for a time must explain a share of what the others explain
    dues = policy.activity_share * score_without(search, best, index)
    for model in rivals_of(search, best, index, processes=processes):
        rival = model.candidates[-1]
        timed = rival.activity is not None and own.activity is None
        gap = max(best.score - model.score + (dues if timed else 0.0), 0.0)
        odds = float(np.exp(-min(gap / temperature, 50.0)))
        if rival.name != own.name:
            found.append(Rival(rival.name, gap, temperature, odds))
    return claim_against(best, index, found, ties)


def score_without(
    search: Search[EvidenceHypothesis], best: EvidenceHypothesis, index: int
) -> float:
    """Return the best known score of a model's other effects, or of some of them; 0 of none."""
    others = {c.label for k, c in enumerate(best.candidates) if k != index}
    tried = (h for r in (*search.rounds, *search.refinements) for h in r)
    return max((h.score for h in tried if {c.label for c in h.candidates} <= others), default=0.0)
