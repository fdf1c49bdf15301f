"""From the search to an answer: names, sets of names that cannot be told apart, or a refusal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.sysid.decision.verdict import Verdict
from seals.sysid.rivals.candidates import Candidate
from seals.sysid.rivals.score import Hypothesis, Margin
from seals.sysid.rivals.search import Search


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One effect of an answer.

    Args:
        candidate: the effect.
        model: in which it was fitted.
        confidence: that it is this one and not one of its rivals.
        rivals: labels of those that could stand in its place.
        settled: labels of those that only the news in their errors rule out.
    """

    candidate: Candidate
    model: Hypothesis
    confidence: float
    rivals: tuple[str, ...] = ()
    settled: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Answer:
    """A verdict with its reasons.

    Args:
        verdict: what is said.
        claims: effects, best first.
        gain: of the chosen model over the nominal one.
        reasons: in words.
        others: claims of the rivals, for the written form.
    """

    verdict: Verdict
    claims: tuple[Claim, ...]
    gain: Margin
    reasons: tuple[str, ...] = ()
    others: tuple[Claim, ...] = ()


def judged(found: Search) -> Answer:
    """Turn a search into an answer."""
    judge, best = found.judge, found.best
    gain = judge.margin(best, found.nominal)
    if not best.candidates:
        return _quiet(found, gain)
    claims: list[Claim] = []
    others: list[Claim] = []
    for k in range(len(best.candidates)):
        claim, close = _claim(found, k)
        claims.append(claim)
        if claim.rivals:
            others += close
    claims.sort(key=lambda c: -c.confidence)
    sure = any(not c.rivals for c in claims)
    return Answer(
        verdict=Verdict.named if sure else Verdict.ambiguous,
        claims=tuple(claims),
        gain=gain,
        reasons=tuple(words for c in claims for words in _words(found, c)),
        others=tuple(others),
    )


def _claim(found: Search, index: int) -> tuple[Claim, list[Claim]]:
    """Confidence in one effect against what could stand in its place beside the others."""
    judge, best = found.judge, found.best
    own = best.candidates[index]
    rest = best.candidates[:index] + best.candidates[index + 1 :]
    pool = [c for c in judge.experiment.library.candidates if c not in best.candidates]
    odds, close, settled = 0.0, [], []
    half = judge.experiment.policy.rival_gain * judge.margin(best, found.nominal).mean
    for other in judge.fitted([((*rest, c), _without(found, own)) for c in pool]):
        margin = judge.contest(best, other)
        weight = _chance(margin)
        odds += weight / max(1.0 - weight, 1e-9)
        if judge.margin(other, found.nominal).mean <= half:
            continue
        if not margin.sure:
            close.append((margin.mean, other))
        elif not judge.margin(best, other).sure:
            settled.append(other.candidates[-1].label)
    close.sort(key=lambda pair: pair[0])
    confidence = 1.0 / (1.0 + odds)
    rivals = [
        Claim(candidate=h.candidates[-1], model=h, confidence=1.0 - confidence) for _, h in close
    ]
    labels = tuple(r.candidate.label for r in rivals)
    claim = Claim(
        candidate=own,
        model=best,
        confidence=confidence,
        rivals=labels,
        settled=tuple(settled),
    )
    return claim, rivals


def _without(found: Search, own: Candidate) -> Floats:
    judge = found.judge
    values: Floats = found.best.fit.values.copy()
    for key in own.keys:
        values[judge.index[key]] = judge.experiment.key(judge.index[key]).off
    return values


def _chance(margin: Margin) -> float:
    """Chance that the other one is the better of the two."""
    return 0.5 * math.erfc(margin.mean / max(margin.error, 1e-9) / math.sqrt(2.0))


def _words(found: Search, claim: Claim) -> list[str]:
    """What stands beside a claim, and what is ruled out by fast changes only."""
    own = claim.candidate.label
    out = [f"{s} follows slow changes as well, fast ones speak for {own}" for s in claim.settled]
    return [_alike(found, claim), *out] if claim.rivals else out


def _alike(found: Search, claim: Claim) -> str:
    names = [claim.candidate.label, *claim.rivals]
    words = f"{', '.join(names[:-1])} and {names[-1]} cannot be told apart"
    experiment = found.judge.experiment
    speeds = [experiment.cases[c].speed for c in experiment.train]
    least = experiment.policy.one_speed * max(speeds)
    alike = max(speeds) > 0.0 and max(speeds) - min(speeds) < least
    if not alike:
        return f"{words} from these runs"
    return f"{words} from one speed ({np.mean(speeds):.2g} m/s): drop at another speed"


def _quiet(found: Search, gain: Margin) -> Answer:
    """Nothing stands out: nothing is missing, the runs cannot show it, or it is something else."""
    library = found.judge.experiment.library
    left = float(found.nominal.losses.mean())
    gross = found.judge.experiment.policy.gross_error
    if not library.candidates:
        verdict = Verdict.cannot_tell
        words = f"no channel sees any of: {_list(library.unfelt)}"
    elif left > gross and not any(h.loss < found.nominal.loss for h in found.tried):
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
    return Answer(verdict=verdict, claims=(), gain=gain, reasons=(words,))


def _list(candidates: Sequence[Candidate]) -> str:
    return ", ".join(dict.fromkeys(c.label for c in candidates))
