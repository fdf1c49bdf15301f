"""From the search to an answer: a name, a set of names, or an honest refusal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from seals.sysid.excitation import expected_gains
from seals.sysid.factors import Candidate
from seals.sysid.gusts import Unrest, unrest
from seals.sysid.hypothesis import Hypothesis
from seals.sysid.naming import Search, rivals_of
from seals.sysid.problem import Problem


class Verdict(Enum):
    """What a diagnosis says, and the exit code it gives."""

    nothing_missing = "nothing_missing"
    named = "named"
    ambiguous = "ambiguous"
    none_of_these = "none_of_these"
    cannot_tell = "cannot_tell"
    bad_data = "bad_data"

    @property
    def exit_code(self) -> int:
        """Exit code of the command."""
        return _CODES[self.value]


_CODES = {
    "nothing_missing": 0,
    "named": 10,
    "ambiguous": 11,
    "none_of_these": 12,
    "cannot_tell": 13,
    "bad_data": 20,
}
TEMPERATURE = 2.0
"""Score difference by which the odds of two hypotheses change by e."""
CLOSE = 3.0
"""Score difference within which two hypotheses cannot be told apart."""
ALIKE = 14.0
"""Score difference within which a hypothesis is mentioned beside the chosen one."""
DISTANT = 4.0
"""Factor on the three above, and on the evidence for stronger gusts, for a log without pose: models
are fitted to whole runs, and where one is wrong its course hardly settles, which weighs on them."""
RESTLESS = 2.0
"""Factor on the gusts above which a force is missing: their level is good to a factor of two."""
REST_GAIN = 30.0
"""Evidence for stronger gusts from which on they count."""
SURE = 0.6
"""Confidence that a further effect needs."""
EXPLAINED = 0.9
"""Share of the misfit that a name must explain."""
ANSWERED = ((0.5, 0.0), (0.15, 30.0), (0.0, 60.0))
"""Share of the information that perfect excitation would give, and the score asked for with it."""
EXCITED = 15.0
"""Expected gain below which a log could not show an effect of plausible size."""
CERTAIN = 30.0
"""Score from which on a name stands even where the log was hardly excited."""


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One effect of an answer.

    Args:
        hypothesis: model in which it was fitted.
        index: of the effect among the hypothesis's candidates.
        confidence: that it is this effect and no other.
        rivals: names that explain the log as well.
        alike: names that explain it nearly as well, rivals among them.
    """

    hypothesis: Hypothesis
    index: int
    confidence: float
    rivals: tuple[str, ...] = ()
    alike: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.hypothesis.candidates[self.index].name


@dataclass(frozen=True, kw_only=True)
class Answer:
    """A verdict with its reasons.

    Args:
        verdict: what is said.
        claims: effects, best first.
        unrest: level of what is left.
        explained: share of the misfit that the claims explain.
        excitation: expected gain by candidate.
        reasons: in words.
        blind: effects that the log could not show.
    """

    verdict: Verdict
    claims: tuple[Claim, ...]
    unrest: Unrest
    explained: float
    excitation: Mapping[str, float] = field(default_factory=dict)
    reasons: tuple[str, ...] = ()
    blind: tuple[str, ...] = ()


def judge(problem: Problem, search: Search, *, processes: int = 1) -> Answer:
    """Turn a search into an answer; the processes share the fits of the rivals."""
    best = search.best
    left = unrest(best)
    floor = _floor(search)
    before = search.nominal.fit.cost
    share = (before - best.fit.cost) / max(before - min(floor, best.fit.cost), 1e-9)
    least = REST_GAIN if problem.samples.posed else DISTANT * REST_GAIN
    restless = left.level > RESTLESS and left.gain > least
    if restless and share < EXPLAINED:
        words = f"a force or a sensor error is left over, {left.level:g} times the stated gusts"
        return Answer(
            verdict=Verdict.none_of_these,
            claims=(),
            unrest=left,
            explained=share,
            reasons=(words,),
        )
    if not best.candidates:
        return _quiet(search, left)
    if _unexcited(problem, search, best):
        return _quiet(search, left, blind=[c.name for c in best.candidates])
    if _between_powers(best):
        words = "a drag that grows neither with the first nor with the second power of the speed"
        return Answer(
            verdict=Verdict.none_of_these, claims=(), unrest=left, explained=share, reasons=(words,)
        )
    heat = temperature(problem)
    claims = [_claim(search, best, k, heat, processes) for k in range(len(best.candidates))]
    claims.sort(key=lambda c: -c.confidence)
    claims = [claims[0], *(c for c in claims[1:] if c.confidence > SURE)]
    doubtful = len(claims) == 1 and bool(claims[0].rivals)
    return Answer(
        verdict=Verdict.ambiguous if doubtful else Verdict.named,
        claims=tuple(claims),
        unrest=left,
        explained=share,
    )


def _between_powers(best: Hypothesis) -> bool:
    """Whether two laws that differ only by the power of the speed act in one variant."""
    laws = {
        (c.identification.family, c.label.partition(" ")[2], c.name)
        for c in best.candidates
        if c.identification.family
    }
    return len({law[:2] for law in laws}) < len(laws)


def temperature(problem: Problem) -> float:
    """Score difference by which the odds of two hypotheses change by e on this log."""
    return TEMPERATURE if problem.samples.posed else DISTANT * TEMPERATURE


def _floor(search: Search) -> float:
    """Misfit that noise and gusts alone would leave."""
    return 0.985 * float(search.best.fitter.windows.observed)


def _unexcited(problem: Problem, search: Search, best: Hypothesis) -> bool:
    """Whether the log could not show any of the named effects at a plausible size."""
    gains = expected_gains(search.nominal)
    library = best.fitter.library

    def shown(candidate: Candidate) -> bool:
        gain = gains.get(candidate.label, np.inf)
        if gain < EXCITED and best.score < CERTAIN:
            return False
        # a log that is moved by its own feedback: gusts that it fights look like a weaker response;
        # what falls freely has no feedback that could fight gusts
        if problem.impact or not candidate.identification.answers:
            return True
        factors = [library.factors[k] for k in candidate.keys]
        if any(f.tolerance == 0.0 for f in factors):
            return True
        most = sum((f.scale / f.tolerance) ** 2 for f in factors)
        asked = [score for share, score in ANSWERED if gain >= share * most]
        return best.score >= (asked[0] if asked else ANSWERED[-1][1])

    return not any(shown(c) for c in best.candidates)


def _quiet(search: Search, left: Unrest, blind: Sequence[str] = ()) -> Answer:
    """Nothing stands out: because nothing is missing, or because the log could not show it."""
    gains = expected_gains(search.nominal)
    names: dict[str, float] = {}
    for label, gain in gains.items():
        name = label.partition(" ")[0]
        names[name] = max(names.get(name, 0.0), gain)
    ranks = {
        c.name: c.identification.needs_motion for c in search.nominal.fitter.library.candidates
    }
    asked = sorted((rank, n) for n, rank in ranks.items() if rank is not None and n in names)
    blind = [*blind, *(n for _, n in asked if names[n] < EXCITED)]
    verdict = Verdict.cannot_tell if blind else Verdict.nothing_missing
    words = f"this log could not show {', '.join(blind)}" if blind else "misfit within tolerance"
    return Answer(
        verdict=verdict,
        claims=(),
        unrest=left,
        explained=1.0,
        excitation=gains,
        reasons=(words,),
        blind=tuple(blind),
    )


def _claim(search: Search, best: Hypothesis, index: int, heat: float, processes: int) -> Claim:
    """Confidence in one effect against what could stand in its place."""
    rivals = rivals_of(search, best, index, processes=processes)
    name = best.candidates[index].name
    odds: dict[str, float] = {}
    for rival in rivals:
        other = rival.candidates[-1].name
        if other != name:
            gap = (best.score - rival.score) / heat
            odds[other] = max(odds.get(other, 0.0), float(np.exp(-min(max(gap, 0.0), 50.0))))
    confidence = 1.0 / (1.0 + sum(odds.values()))
    ordered = sorted(odds, key=lambda n: -odds[n])
    near = [n for n in ordered if odds[n] > np.exp(-CLOSE / TEMPERATURE)]
    alike = [n for n in ordered if odds[n] > np.exp(-ALIKE / TEMPERATURE)]
    return Claim(
        hypothesis=best,
        index=index,
        confidence=confidence,
        rivals=tuple(_few(near)),
        alike=tuple(_few(alike)),
    )


def _few(names: Sequence[str], most: int = 3) -> Sequence[str]:
    return names[:most]
