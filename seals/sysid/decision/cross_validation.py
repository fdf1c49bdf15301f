"""Decision by cross-validation: named effects, indistinguishable ones, or a refusal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision.answer import Answer, Claim, Rival, claim_against, verdict_of
from seals.sysid.decision.verdict import Verdict
from seals.sysid.scores.cross_validation import Margin, ValidatedHypothesis
from seals.sysid.selection.run_models import RunsSearch

RunsClaim = Claim[ValidatedHypothesis]


@dataclass(frozen=True, kw_only=True)
class RunsAnswer(Answer[ValidatedHypothesis]):
    """Answer of a diagnosis of several runs.

    Args:
        gain: of the chosen model over the nominal one.
        others: claims of the rivals, for the written form.
    """

    gain: Margin
    others: tuple[RunsClaim, ...] = ()


def decide(found: RunsSearch) -> RunsAnswer:
    """Decide on the result of a search."""
    validator, best = found.validator, found.best
    gain = validator.margin(best, found.nominal)
    if not best.candidates:
        return _quiet(found, gain)
    claims: list[RunsClaim] = []
    others: list[RunsClaim] = []
    for k in range(len(best.candidates)):
        claim, close = _claim(found, k)
        claims.append(claim)
        if claim.rivals:
            others += close
    claims.sort(key=lambda c: -c.confidence)
    return RunsAnswer(
        verdict=verdict_of(claims),
        claims=tuple(claims),
        gain=gain,
        reasons=tuple(words for c in claims for words in _words(found, c)),
        others=tuple(others),
    )


def _claim(found: RunsSearch, index: int) -> tuple[RunsClaim, list[RunsClaim]]:
    """Compute the confidence in one effect against its rivals beside the other effects."""
    validator, best = found.validator, found.best
    own = best.candidates[index]
    rest = best.candidates[:index] + best.candidates[index + 1 :]
    pool = [c for c in validator.experiment.candidate_set.candidates if c not in best.candidates]
    policy = validator.experiment.policy
    half = policy.rival_gain * validator.margin(best, found.nominal).mean
    rivals: list[Rival] = []
    settled: list[str] = []
    models = validator.fitted([((*rest, c), validator.without(best, own)) for c in pool])
    for other in models:
        margin, chosen = validator.compare_innovations(best, other), other.candidates[-1].label
        weight = _chance(margin)
        close = validator.margin(other, found.nominal).mean > half
        rivals.append(
            Rival(chosen, margin.mean, margin.error, weight / max(1.0 - weight, 1e-9), close)
        )
        if close and margin.significant and not validator.margin(best, other).significant:
            settled.append(chosen)
    claim = claim_against(best, index, rivals, policy.runs_ties, settled=settled)
    by_label = {m.candidates[-1].label: m for m in models}
    return claim, [
        Claim(
            hypothesis=by_label[r],
            index=len(by_label[r].candidates) - 1,
            confidence=1.0 - claim.confidence,
        )
        for r in claim.rivals
    ]


def _chance(margin: Margin) -> float:
    """Probability that the other model is the better of the two."""
    return 0.5 * math.erfc(margin.mean / max(margin.error, 1e-9) / math.sqrt(2.0))


def _words(found: RunsSearch, claim: RunsClaim) -> list[str]:
    """Describe the rivals of a claim, and those ruled out by innovations only."""
    own = claim.candidate.label
    out = [f"{s} follows slow changes as well, fast ones speak for {own}" for s in claim.settled]
    return [_alike(found, claim), *out] if claim.rivals else out


def _alike(found: RunsSearch, claim: RunsClaim) -> str:
    names = [claim.candidate.label, *claim.rivals]
    words = f"{', '.join(names[:-1])} and {names[-1]} cannot be told apart"
    experiment = found.validator.experiment
    speeds = [experiment.cases[c].speed for c in experiment.train]
    least = experiment.policy.one_speed * max(speeds)
    alike = max(speeds) > 0.0 and max(speeds) - min(speeds) < least
    if not alike:
        return f"{words} from these runs"
    return f"{words} from one speed ({np.mean(speeds):.2g} m/s): drop at another speed"


def _quiet(found: RunsSearch, gain: Margin) -> RunsAnswer:
    """Decide without a significant effect: nothing missing, not observable, or none of these."""
    candidate_set = found.validator.experiment.candidate_set
    left = float(found.nominal.held_out_log_rms.mean())
    gross = found.validator.experiment.policy.gross_error
    if not candidate_set.candidates:
        verdict = Verdict.cannot_tell
        words = f"no channel sees any of: {_list(candidate_set.unobservable)}"
    elif left > gross and not any(h.log_rms < found.nominal.log_rms for h in found.tried):
        verdict = Verdict.none_of_these
        words = f"the error is {math.exp(left):.2g} times the floor and no effect lowers it"
    elif left > gross:
        verdict = Verdict.cannot_tell
        words = (
            f"the error is {math.exp(left):.2g} times the floor, and no effect lowers it on "
            "held-out runs by more than twice its standard error"
        )
    else:
        verdict = Verdict.nothing_missing
        words = "no effect lowers the error on held-out runs by more than twice its standard error"
    return RunsAnswer(verdict=verdict, claims=(), gain=gain, reasons=(words,))


def _list(candidates: Sequence[Candidate]) -> str:
    return ", ".join(dict.fromkeys(c.label for c in candidates))
