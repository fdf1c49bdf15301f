"""Report of a diagnosis: one HTML page that works offline, and the same as JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from seals.file_names import REPORT
from seals.logs.atomic import finite, write_json, write_text
from seals.logs.check import check_log
from seals.logs.finding import Finding, Severity
from seals.logs.log import Log
from seals.report import Block, Code, Facts, Fold, Paragraph, Section, Table, page
from seals.sysid.data.robot_description import stated_robot
from seals.sysid.decision.verdict import Verdict
from seals.sysid.diagnosis import Diagnosis
from seals.sysid.report.charts import ablation_chart, gain_chart
from seals.sysid.report.gains import ablation_steps
from seals.sysid.report.naming import UNKNOWN, points
from seals.sysid.report.overlay import POINTS, levels, overlay_blocks
from seals.sysid.report.table import Entry, ranking
from seals.sysid.report.tolerances import Moved, moved, tolerance_chart
from seals.sysid.report.words import (
    alike_words,
    explanation,
    first_answers,
    headline,
    joined,
    next_steps,
    parameter_rows,
)
from seals.sysid.report.wrench import wrench_blocks
from seals.sysid.residual_force import Localisation, locate_residual_force, residual_of
from seals.sysid.residual_force.residual import Residual
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis

DATA = "report.json"
LARGEST = 1_000_000
"""Size of the page at most [byte]."""
_TONES = {Verdict.named: "good", Verdict.nothing_missing: "good", Verdict.bad_data: "bad"}
_FORCE = {
    Verdict.nothing_missing: "Is any force missing?",
    Verdict.cannot_tell: "Is any force missing?",
}
_SEVERITY = {Severity.REFUSE: "unusable", Severity.WARN: "warning", Severity.NOTE: "note"}


def write_report(
    diagnosis: Diagnosis,
    log: Log,
    folder: Path,
    *,
    localisation: Localisation | None = None,
    residual_after: Residual | None = None,
) -> Path:
    """Write ``report.html`` and ``report.json`` of a diagnosis.

    Args:
        diagnosis: what was found.
        log: that was diagnosed.
        folder: where to write; made when it is not there.
        localisation: of what the stated model lacks, when it is known already.
        residual_after: force that the model shown as 'after' lacks, when it is known already.

    Returns:
        Path of the page.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    data, entries = diagnosis.to_dict(), ranking(diagnosis)
    steps, findings = ablation_steps(diagnosis.search), check_log(log, stated_robot(log.meta))
    after = model_after(diagnosis)
    missing = localisation or locate_residual_force(diagnosis.problem, diagnosis.search.nominal)
    values, nominal = moved(after), moved(diagnosis.search.nominal)
    channels = levels(diagnosis.search.nominal, after)
    content = {
        "log": log.name,
        "headline": headline(diagnosis, data),
        "diagnosis": data,
        "rank": [e.to_dict() for e in entries],
        "ladder": [{"model": s.name, "held_out_error": s.error} for s in steps],
        "channels": channels,
        "missing_force": missing.to_dict(),
        "tolerances": [m.to_dict() for m in values],
        "data_check": [str(f) for f in findings],
    }
    write_json(folder / DATA, finite(content))
    claimed = [c.name for c in diagnosis.answer.claims]
    best = model_after(diagnosis)
    model = _names(diagnosis, best)[bool(best.candidates)]
    fixed = [
        _summary(diagnosis, data, missing, channels, folder),
        Section(
            title=_FORCE.get(diagnosis.answer.verdict, "Residual force"),
            blocks=_wrench(diagnosis, after, missing, residual_after),
            wide=True,
        ),
        _effects(diagnosis, entries),
        (
            Section(
                title="Reduction of the error, and changes of data sheet values",
                blocks=[
                    ablation_chart(steps, claimed=claimed),
                    tolerance_chart(values, model=model),
                ],
                wide=True,
            )
        ),
        _behind(values, nominal, findings),
    ]
    write_text(folder / REPORT, _small_enough(diagnosis, log, after, fixed))
    return folder / REPORT


def _small_enough(
    diagnosis: Diagnosis, log: Log, after: EvidenceHypothesis, fixed: Sequence[Section]
) -> str:
    """Return the page with as many points in its overlays as its size allows."""
    text = ""
    for most in (POINTS, POINTS // 2, POINTS // 4):
        before = diagnosis.search.nominal
        same = not after.candidates
        overlay = Section(
            title="Measured and modelled",
            blocks=overlay_blocks(
                diagnosis.problem,
                before,
                before if same else after,
                names=_names(diagnosis, after),
                most=most,
            ),
            wide=True,
        )
        samples = diagnosis.problem.samples
        runs = f" in {len(samples.runs)} runs" if len(samples.runs) > 1 else ""
        text = page(
            f"Diagnosis of {log.name}",
            [fixed[0], overlay, *fixed[1:]],
            subtitle=(
                f"{diagnosis.problem.vehicle.name}, {samples.seconds:.1f} s{runs}, "
                f"{samples.rows} rows; computed in {diagnosis.seconds:.1f} s"
            ),
            light=True,
        )
        if len(text.encode("utf-8")) <= LARGEST:
            break
    return text


def model_after(diagnosis: Diagnosis) -> EvidenceHypothesis:
    """Return the model shown as 'after': the chosen one, or the best of the candidates."""
    answer, search = diagnosis.answer, diagnosis.search
    if answer.claims:
        return answer.claims[0].hypothesis
    return search.best if answer.verdict is Verdict.none_of_these else search.nominal


def _names(diagnosis: Diagnosis, after: EvidenceHypothesis) -> tuple[str, str]:
    if diagnosis.answer.claims:
        return "model before", f"model with {joined(list(after.names))}"
    return "model", f"with {joined(list(after.names) or [''])} (best fit, not named)"


def _summary(
    diagnosis: Diagnosis,
    data: dict[str, Any],
    missing: Localisation,
    channels: Mapping[str, Mapping[str, float]],
    folder: Path,
) -> Section:
    verdict = diagnosis.answer.verdict
    facts = first_answers(diagnosis, data, missing, channels)
    words, commands = next_steps(diagnosis, data, missing.formula, folder)
    blocks: list[Block] = [
        Paragraph(text=headline(diagnosis, data), tone=_TONES.get(verdict, "warn"), large=True),
        Facts(values=facts),
        Paragraph(text=explanation(diagnosis, data)),
    ]
    rows = parameter_rows(data)
    if rows:
        head = ["value of", "fitted", "90 % interval"]
        blocks.append(Table(head=head, rows=rows, right=(1, 2)))
    blocks += [Paragraph(text=text, tone="warn") for text in alike_words(diagnosis)]
    blocks.append(Paragraph(text="What to do next: " + " ".join(words)))
    if commands:
        blocks.append(Code(text=commands))
    return Section(title="Summary", blocks=blocks, wide=True)


def _wrench(
    diagnosis: Diagnosis,
    after: EvidenceHypothesis,
    missing: Localisation,
    known: Residual | None,
) -> list[Block]:
    """Blocks of the residual wrench: over time, in words, and by condition."""
    problem = diagnosis.problem
    then = residual_of(problem, after) if known is None and after.candidates else known
    named = [claim.candidate for claim in diagnosis.answer.claims]
    blocks = wrench_blocks(problem, missing.residual, then, named)
    if missing.signature.sentences:
        blocks.insert(0, Paragraph(text=" ".join(missing.signature.sentences)))
    law = missing.formula
    if law is not None and diagnosis.answer.verdict is Verdict.none_of_these:
        words = (
            f"A formula for it: {law}. On parts of the log that it was not fitted to it explains "
            # beyond all of it lies within the estimate's error
            f"{100 * min(law.share, 1.0):.0f} ± {100 * min(law.share_sd, 1.0):.0f} % of the "
            "misfit above the noise."
        )
        blocks.insert(1, Paragraph(text=words))
    rows = [
        [
            r.name,
            f"{r.force:.3g} N",
            f"{r.force_ratio:.2g}",
            f"{r.torque:.3g} N·m",
            f"{r.torque_ratio:.2g}",
        ]
        for r in missing.regimes
    ]
    head = ["regime", "force", "× its uncertainty", "torque", "× its uncertainty"]
    table = Table(head=head, rows=rows, right=(1, 2, 3, 4))
    words = (
        "Typical size in excess of error bars and gusts, and the size in units of both; 1 means "
        "that nothing is missing."
    )
    blocks.append(
        Fold(title="Size by condition", blocks=[table, Paragraph(text=words, tone="caption")])
    )
    return blocks


def _effects(diagnosis: Diagnosis, entries: Sequence[Entry]) -> Section:
    """Bars and reasons of all effects that were tried."""
    blocks: list[Block] = []
    seen = diagnosis.search.nominal.fitter.windows.observed
    before = diagnosis.held_out["before"]
    fitted = [e for e in entries if e.gain is not None]
    for beside in dict.fromkeys(e.beside for e in fitted):
        group = [e for e in fitted if e.beside == beside]
        required = min(e.required for e in group if e.required is not None) / seen
        chart = gain_chart(group, before=before, required=required)
        if chart is not None:
            blocks.append(chart)
        best = [e.gain or 0.0 for e in group if e.status == "named"]
        before -= max(best, default=0.0)
    head = ["effect", "verdict", "why", "score", "fitted value ± 1 σ"]
    rows = [
        [
            e.words + (f" (beside {' + '.join(e.beside)})" if e.beside else ""),
            e.status,
            e.reason,
            points(e.score or 0.0),
            e.values,
        ]
        for e in fitted
    ]
    if any(
        e.status != "rejected" and (e.gain or 0.0) * seen < 0.5 * (e.score or 0.0) for e in fitted
    ):
        words = (
            "If a bar is short although the score is high, the held-out error cannot rank the "
            "effects: "
            "without the effect the model follows the log only with data sheet values far from "
            "their tolerances. The score penalises this, and it decides."
        )
        blocks.append(Paragraph(text=words, tone="warn"))
    blocks.append(Table(head=head, rows=rows, right=(3,)))
    blocks.append(
        Paragraph(
            text="Score: reduction of the misfit on the whole log, in squared standard deviations, "
            "minus a penalty for the parameters. Two more points make an effect 2.7 "
            "times as probable."
        )
    )
    left = [e for e in entries if e.gain is None]
    if left:
        rows = [[e.words, e.reason] for e in left]
        title = f"{len(left)} more effects were excluded by a preliminary test"
        blocks.append(Fold(title=title, blocks=[Table(head=["effect", "why"], rows=rows)]))
    return Section(title="Which effects were tried", blocks=blocks, wide=True)


def _behind(
    values: tuple[Moved, ...], nominal: tuple[Moved, ...], findings: Sequence[Finding]
) -> Section:
    checks = [
        [
            _SEVERITY[f.severity],
            f.channel or "log",
            f"{f.where:.4g} s" if f.where is not None else "",
            f.message,
        ]
        for f in findings
    ]
    head = ["kind", "channel", "first at", "what was seen"]
    blocks: list[Block] = [
        Table(head=head, rows=checks)
        if checks
        else Paragraph(
            text="Time base, units, frames and values of the log passed the data check."
        ),
    ]
    first = {m.key: m.sigmas for m in nominal}
    rows = [
        [
            m.words,
            f"{m.change:.3g} {m.unit}".removesuffix(" 1"),
            f"{first.get(m.key, 0.0):+.2f}",
            f"{m.sigmas:+.2f}",
            f"{m.uncertainty:.2f}" if isfinite(m.uncertainty) else UNKNOWN,
        ]
        for m in values
    ]
    head = ["value", "change", "before [σ]", "after [σ]", "uncertainty after the fit [σ]"]
    table = Table(head=head, rows=rows, right=(1, 2, 3, 4))
    blocks.append(Fold(title="Changes of all data sheet values", blocks=[table]))
    return Section(title="Data check", blocks=blocks, wide=True)
