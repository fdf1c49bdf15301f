"""Report of a diagnosis of several runs: ranked effects, then the charts of a comparison."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from seals.compare.report import case_charts, sections_of
from seals.compare.result import Comparison, Group
from seals.report import Block, Paragraph, Section, Table, write_page, write_picture
from seals.sysid.runs import RunsDiagnosis


def write_runs_report(found: Sequence[RunsDiagnosis], folder: Path) -> Path:
    """Write report.html and, for every diagnosis, a picture of measurement and models."""
    folder.mkdir(parents=True, exist_ok=True)
    sections = [_rank(one) for one in found]
    for one in found:
        group = group_of(one)
        picture = folder / f"{re.sub(r'[^A-Za-z0-9_.-]+', '_', one.name)}.png"
        write_picture(picture, case_charts(group, _shown(group)))
        for section in sections_of(_comparison(one, group)):
            sections.append(section)
    return write_page(folder / "report.html", f"Diagnosis: {found[0].name}", sections)


def group_of(one: RunsDiagnosis) -> Group:
    """Return nominal and chosen model as the variants of a comparison."""
    cases = one.search.validator.experiment.cases
    return Group(
        name=one.name, cases=cases, variants=one.variants, offsets={c.name: {} for c in cases}
    )


def _shown(group: Group) -> int:
    """Return the first held-out run, or the first run without any."""
    return next((k for k, c in enumerate(group.cases) if c.held_out), 0)


def _comparison(one: RunsDiagnosis, group: Group) -> Comparison:
    nominal = ", ".join(one.search.validator.experiment.candidate_set.nominal)
    return Comparison(
        name=one.name,
        model=f"nominal: {nominal}",
        groups=[group],
        findings={},
        sources={},
        seconds=one.seconds,
    )


def _rank(one: RunsDiagnosis) -> Section:
    rows = [
        [
            " + ".join(t["effects"]) or "nominal model",
            f"{t['gain']:+.3f}",
            f"{t['standard_error']:.3f}",
            f"{t['price']:.2f}",
            f"{t['seen']:.3f}",
            f"{t['held_out']:.3f}",
        ]
        for t in one.to_dict()["tried"]
    ]
    head = ["added", "gain", "standard error", "price", "log error, fitted", "log error, held out"]
    words = "; ".join(one.answer.reasons)
    lead = (
        f"{one.answer.verdict.value}: {', '.join(c.candidate.label for c in one.answer.claims)}. "
        "Gain is the fall of the logarithm of the error on held-out runs, less the price of every "
        "further parameter; it counts from twice its standard error on."
    )
    blocks: list[Block] = [Paragraph(text=words)] if words else []
    blocks.append(Table(head=head, rows=rows, right=(1, 2, 3, 4, 5)))
    return Section(title=f"{one.name}: what was tried", lead=lead, blocks=blocks)
