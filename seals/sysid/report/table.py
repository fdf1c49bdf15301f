"""Ranked table of candidate effects, with the reason why each was accepted or rejected."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision.evidence import evidence_temperature
from seals.sysid.decision.required_evidence import required_evidence
from seals.sysid.decision.verdict import Verdict
from seals.sysid.diagnosis import Diagnosis
from seals.sysid.predictors.linear_screen import candidate_keys, linear_gain, screen
from seals.sysid.predictors.surface_model_error import SurfaceModelError, surface_model_error
from seals.sysid.report.gains import Gain, gain_over
from seals.sysid.report.naming import candidate_words, figure, points, unit_of
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, is_significant

NAMED, POSSIBLE, REJECTED, UNTRIED = "named", "possible", "rejected", "not fitted"
NOTHING = 5e-4
"""Gain that is shown as none."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """Row of the ranked table of effects.

    Args:
        name: of the effect.
        words: name with variant.
        beside: effects that were in the model already.
        status: ``named``, ``possible``, ``rejected`` or ``not fitted``.
        gain: fall of the held-out error, in units of the noise variance; None when not fitted.
        error: standard error of the gain.
        score: fall of the misfit on the whole log less the price of the freedom, in points of
            squared standard deviations; None when not fitted.
        required: score that is required; None when not fitted.
        values: fitted values, in words.
        reason: of the status, in words.
    """

    name: str
    words: str
    beside: tuple[str, ...]
    status: str
    gain: float | None
    error: float | None
    score: float | None
    required: float | None
    values: str
    reason: str

    def to_dict(self) -> dict[str, Any]:
        """Return the entry as plain data."""
        return asdict(self)


def ranking(diagnosis: Diagnosis) -> tuple[Entry, ...]:
    """Return the fitted effects, by round and best first, then the others."""
    search = diagnosis.search
    best, out = {c.label for c in search.best.candidates}, list[Entry]()
    base = search.nominal
    trajectory = base.fitter.trajectory
    surface_error = surface_model_error(diagnosis.problem.plant, trajectory)
    for k, tried in enumerate(search.rounds[: max(1, len(diagnosis.answer.claims))]):
        entries = [_entry(diagnosis, base, h, surface_error) for h in tried]
        entries.sort(key=lambda e: (_ORDER[e.status], -(e.score or 0.0)))
        out += entries
        following = [h for h in tried if {c.label for c in h.candidates} <= best]
        if not following or k + 1 >= len(search.best.candidates):
            break
        base = max(following, key=lambda h: h.score)
    seen = {e.words for e in out}
    return (*out, *(e for e in _untried(diagnosis) if e.words not in seen))


_ORDER = {NAMED: 0, POSSIBLE: 1, REJECTED: 2, UNTRIED: 3}


def _entry(
    diagnosis: Diagnosis,
    base: EvidenceHypothesis,
    tried: EvidenceHypothesis,
    surface_error: SurfaceModelError | None,
) -> Entry:
    candidate, gain = tried.candidates[-1], gain_over(base, tried)
    status = _status(diagnosis, candidate)
    required = required_evidence(diagnosis.problem, base, candidate, surface_error=surface_error)
    candidate_set = tried.fitter.candidate_set
    out = []
    for key, name in zip(candidate.keys, candidate.reported, strict=True):
        spread = figure(tried.fit.spread(key), unit_of(candidate_set, key))
        out.append(f"{name} = {figure(tried.fit.values[key])} ± {spread}")
    return Entry(
        name=candidate.name,
        words=candidate_words(candidate),
        beside=base.names,
        status=status,
        gain=gain.value,
        error=gain.error,
        score=tried.score - base.score,
        required=required,
        values=", ".join(out),
        reason=_reason(diagnosis, base, tried, status, gain, required=required),
    )


def _status(diagnosis: Diagnosis, candidate: Candidate) -> str:
    answer = diagnosis.answer
    own = [c for c in answer.claims if c.hypothesis.candidates[c.index].label == candidate.label]
    rivals = {n for c in answer.claims for n in (*c.rivals, *c.alike)}
    if own:
        return POSSIBLE if answer.verdict is Verdict.ambiguous else NAMED
    if candidate.name in rivals and candidate.name not in {c.name for c in answer.claims}:
        return POSSIBLE
    return REJECTED


def _reason(
    diagnosis: Diagnosis,
    base: EvidenceHypothesis,
    tried: EvidenceHypothesis,
    status: str,
    gain: Gain,
    *,
    required: float,
) -> str:
    """Reason for an effect's status."""
    answer, candidate_set = diagnosis.answer, tried.fitter.candidate_set
    candidate, score = tried.candidates[-1], tried.score - base.score
    if status == NAMED:
        return "explains the log, and nothing else does as well"
    if status == POSSIBLE:
        return _possible(diagnosis, candidate, score)
    quiet = answer.verdict in (Verdict.cannot_tell, Verdict.nothing_missing)
    cases = (
        (score <= 0.0, "removes no more than its parameters are penalised"),
        (
            not is_significant(candidate, tried.fit, candidate_set),
            "the fitted change is within the tolerance of the data sheet, or negligible",
        ),
        (
            score < required,
            f"its score, {points(score)}, is below the {required:.3g} that is required",
        ),
        (
            answer.verdict is Verdict.none_of_these,
            "explains only a part; a residual force remains",
        ),
        (
            quiet,
            "stronger gusts, within their uncertainty, explain the log equally well; or the log "
            "hardly shows the effect",
        ),
    )
    words = next((text for holds, text in cases if holds), "")
    return words or _beaten(diagnosis, base, tried, gain)


def _possible(diagnosis: Diagnosis, candidate: Candidate, score: float) -> str:
    claims = diagnosis.answer.claims
    if candidate.name == claims[0].name:
        others = [n for n in claims[0].alike or claims[0].rivals if n != candidate.name]
        return f"explains the log best, but nearly as well as {' and '.join(others)}"
    best = diagnosis.search.best
    gap = max(best.score - score, 0.0) if len(best.candidates) == 1 else None
    words = f"cannot be excluded beside {claims[0].name}"
    return words + (f": its score is only {points(gap)} lower" if gap is not None else "")


def _beaten(
    diagnosis: Diagnosis, base: EvidenceHypothesis, tried: EvidenceHypothesis, gain: Gain
) -> str:
    """Score difference between an effect and the named ones tried beside the same model."""
    claims = {c.hypothesis.candidates[c.index].label: c.name for c in diagnosis.answer.claims}
    beside = {c.label for c in base.candidates}
    rivals = [
        h
        for r in diagnosis.search.rounds
        for h in r
        if h.candidates[-1].label in claims
        and {c.label for c in h.candidates[:-1]} == beside
        and h.candidates[-1].label not in beside
    ]
    if not rivals:
        return "the chosen effects together explain more"
    best = max(rivals, key=lambda h: h.score)
    name, gap = claims[best.candidates[-1].label], best.score - tried.score
    full = gain_over(base, best)
    if gap <= 0.0:
        return f"alone it does as well as {name}, but the chosen effects together explain more"
    odds = gap / evidence_temperature(diagnosis.problem) / 2.302585
    sure = f"{10**odds:,.0f} to one" if odds < 6.0 else "more than a million to one"
    part = (
        f"removes {100.0 * max(gain.value, 0.0) / full.value:.0f} % of what {name} removes"
        if full.value > 2.0 * (full.error or 0.0)
        else f"its score is {points(gap)} below that of {name}"
    )
    return f"{part}; odds {sure} against it"


def _untried(diagnosis: Diagnosis) -> list[Entry]:
    """Return the effects that the linear screen ruled out."""
    nominal = diagnosis.search.nominal
    fitter = nominal.fitter
    known = {h.candidates[-1].label for h in diagnosis.search.rounds[0]}
    left = [c for c in fitter.candidate_set.candidates if c.label not in known]
    regular = [c for c in left if not c.identification.guessed]
    table = screen(fitter, fitter.start(()), candidate_keys(regular))
    common, _ = linear_gain(fitter, table, ())
    out = []
    for candidate in regular:
        gain = linear_gain(fitter, table, candidate.all_keys)[0] - common
        points = f"{max(gain, 0.0):.2g} points of misfit"
        words = f"the preliminary test predicted {points}, less than for others"
        out.append((gain, _bare(candidate, words)))
    out.sort(key=lambda item: -item[0])
    words = "the residual force gave no indication of it"
    return [e for _, e in out] + [_bare(c, words) for c in left if c.identification.guessed]


def _bare(candidate: Candidate, reason: str) -> Entry:
    return Entry(
        name=candidate.name,
        words=candidate_words(candidate),
        beside=(),
        status=UNTRIED,
        gain=None,
        error=None,
        score=None,
        required=None,
        values="",
        reason=reason,
    )
