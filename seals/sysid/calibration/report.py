"""HTML report of a calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from seals.file_names import REPORT
from seals.logs.atomic import write_text
from seals.report import Block, Code, Facts, Paragraph, Section, Table, page
from seals.sysid.calibration.calibration import Calibration
from seals.sysid.calibration.words import HEAD, error_sentence, remarks, row
from seals.sysid.report.naming import figure
from seals.sysid.report.overlay import POINTS, overlay_blocks
from seals.sysid.report.tolerances import moved, tolerance_chart
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis


def models(found: Calibration) -> tuple[EvidenceHypothesis, EvidenceHypothesis]:
    """Return the model with the numbers as stated and the calibrated one, in the same windows."""
    fit, fitter = found.solution.fit, found.solution.fitter
    stated = {**fit.values, **{n.key: 0.0 for n in found.numbers}}
    both = (replace(fit, values=stated), fit)
    before, after = (
        EvidenceHypothesis(candidates=(), fit=one, fitter=fitter, score=0.0) for one in both
    )
    return before, after


def overlays(found: Calibration) -> list[Block]:
    """Return the charts of all channels, largest residual of the stated model first."""
    before, after = models(found)
    problem = replace(found.problem, fitter=found.solution.fitter)
    return overlay_blocks(problem, before, after, names=("as stated", "calibrated"), most=POINTS)


def write_report(
    found: Calibration,
    folder: Path,
    *,
    diff: str = "",
    notes: Sequence[str] = (),
    more: Sequence[str] = (),
) -> Path:
    """Write the HTML report of a calibration and return its path.

    Args:
        found: the calibration.
        folder: where to write.
        diff: change of the robot's folder; empty for none.
        notes: what of it must be done by hand.
        more: further sentences of the summary.
    """
    values = moved(models(found)[1])
    sections = [
        _summary(found, more),
        Section(title="Measured and modelled", blocks=overlays(found), wide=True),
        Section(title="What goes together", blocks=[_correlation(found)], wide=True),
        Section(
            title="Everything else",
            blocks=[tolerance_chart(values, model="calibrated")] if values else [],
            wide=True,
        ),
    ]
    if diff or notes:
        edits: list[Block] = [Code(text=diff)] if diff else []
        edits += [Paragraph(text=note) for note in notes]
        sections.insert(1, Section(title="Change of the robot's folder", blocks=edits, wide=True))
    samples = found.problem.samples
    text = page(
        f"Calibration of {found.problem.vehicle.name}",
        sections,
        subtitle=f"{samples.seconds:.1f} s in {len(samples.runs)} runs, {samples.rows} rows; "
        f"computed in {found.seconds:.1f} s",
        light=True,
    )
    write_text(folder / REPORT, text)
    return folder / REPORT


def _summary(found: Calibration, more: Sequence[str]) -> Section:
    held = found.held_out
    fine = held["after"] < 2.0 * held["noise_floor"]
    blocks: list[Block] = [
        Paragraph(text=error_sentence(found), tone="good" if fine else "warn", large=True),
        Facts(
            values={
                "error before → after [× noise]": f"{figure(held['before'], digits=3)} → "
                f"{figure(held['after'], digits=3)}",
                "floor (noise alone)": figure(held["noise_floor"], digits=3),
                "intervals widened by": figure(found.widening, digits=3),
            }
        ),
        Table(
            head=list(HEAD),
            rows=[list(row(found, n)) for n in found.numbers],
            right=(1, 2, 3, 4),
        ),
    ]
    blocks += [Paragraph(text=remark, tone="warn") for remark in remarks(found)]
    blocks += [Paragraph(text=sentence) for sentence in more]
    return Section(title="Summary", blocks=blocks, wide=True)


def _correlation(found: Calibration) -> Table:
    table, names = found.correlation, [n.name for n in found.numbers]
    rows = [
        [name, *(f"{table[i, j]:+.2f}" for j in range(len(names)))] for i, name in enumerate(names)
    ]
    return Table(head=["correlation", *names], rows=rows, right=tuple(range(1, len(names) + 1)))
