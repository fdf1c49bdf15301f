"""Report of a comparison: HTML page, picture, JSON file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from seals.learn.comparison.outcome import Band, Study
from seals.learn.comparison.words import arm_rows, claims, comparison_rows, run_rows, terms_words
from seals.logs.atomic import write_json
from seals.report import (
    Bar,
    Bars,
    Block,
    Chart,
    Choice,
    Fold,
    Mark,
    Paragraph,
    Section,
    Series,
    Table,
    write_page,
    write_picture,
)
from seals.report.style import colours_of

NUMBERS, PAGE, PICTURE = "comparison.json", "comparison.html", "comparison.png"
_TONES = {"better": "good", "worse": "warn", "open": ""}
_HOW = (
    "The line is the interquartile mean over runs: the lowest and the highest quarter are left "
    "out. The band is its percentile interval from a bootstrap of whole runs. The band is "
    "pointwise, "
    "and with few runs it is somewhat too narrow. P(improvement) is the chance that a run "
    "of the arm scores higher than one of the reference (Mann and Whitney), with Newcombe's "
    "interval; a claim is made if this interval excludes one half. The sample consists of "
    "runs, not of episodes."
)


def write_study(study: Study, out: Path, *, title: str) -> list[Path]:
    """Write the numbers, the page and the picture of a comparison.

    Args:
        study: to be written.
        out: folder, made where it is not there.
        title: of the page.

    Returns:
        The files.
    """
    out.mkdir(parents=True, exist_ok=True)
    write_json(out / NUMBERS, study.to_dict())
    write_picture(out / PICTURE, _charts(study))
    write_page(out / PAGE, title, _sections(study), subtitle=terms_words(study), light=True)
    return [out / NUMBERS, out / PICTURE, out / PAGE]


def _charts(study: Study) -> list[Chart]:
    """Return the arms' learning curves over steps and, if every run has it, over wall time."""
    terms = study.terms
    label = {"step": "control steps", "seconds": "seconds of training"}.get(terms.over, terms.over)
    out = [
        _chart(study, {a.name: a.band for a in study.arms}, f"{terms.value} over {label}", label)
    ]
    clocks = {a.name: a.clock for a in study.arms if a.clock is not None}
    if len(clocks) == len(study.arms):
        name = f"{terms.value} over time, until the fastest run of each arm ends"
        out.append(_chart(study, clocks, name, "seconds of training"))
    return out


def _chart(study: Study, bands: dict[str, Band], title: str, label: str) -> Chart:
    colours = colours_of(list(bands))
    lines = [
        Series(
            name=name,
            x=band.x,
            y=band.line,
            band=np.stack([band.line - band.low, band.high - band.line]),
            colour=colours[name],
        )
        for name, band in bands.items()
    ]
    return Chart(title=title, y_label=study.terms.value, x_label=label, series=tuple(lines))


def _sections(study: Study) -> list[Section]:
    """Return the sections of the page."""
    found = [
        Section(
            title="Conclusions from the intervals",
            blocks=[
                *(
                    Paragraph(text=text, tone=_TONES[duel.verdict])
                    for text, duel in zip(claims(study), study.duels, strict=True)
                ),
                *(Paragraph(text=text, tone="caption") for text in study.remarks),
            ],
        ),
        Section(title="Learning curves", blocks=[*_charts(study)], wide=True),
        Section(title="Arms", blocks=[_table(arm_rows(study))]),
    ]
    if study.duels:
        found.append(
            Section(
                title=f"Against {study.terms.reference}",
                blocks=[*_bars(study), _table(comparison_rows(study))],
            )
        )
    groups: dict[str, list[Block]] = {}
    for arm in study.arms:
        lines = [
            Series(name=run.name, x=arm.band.x, y=values)
            for run, values in zip(arm.runs, arm.band.runs, strict=True)
        ]
        title = f"{arm.name}: every run"
        groups[arm.name] = [
            Chart(
                title=title,
                y_label=study.terms.value,
                x_label=study.terms.over,
                series=tuple(lines),
            )
        ]
    found.append(
        Section(
            title="Every run",
            blocks=[
                Choice(label="arm", options=groups),
                Fold(title="Scores of every run", blocks=[_table(run_rows(study))]),
            ],
        )
    )
    found.append(Section(title="How it was reckoned", blocks=[Paragraph(text=_HOW)]))
    return found


def _table(parts: tuple[tuple[str, ...], list[tuple[str, ...]]]) -> Table:
    head, rows = parts
    return Table(head=head, rows=rows, right=list(range(1, len(head))))


def _bars(study: Study) -> list[Block]:
    """Probabilities of improvement as points with their intervals."""
    half = (Mark(at=0.5, label="no difference"),)
    bars = []
    for duel in study.duels:
        low, high = duel.improvement.low, duel.improvement.high
        bars.append(
            Bar(
                label=f"{duel.arm}, {duel.metric}",
                # the bar is the interval itself
                value=high,
                start=low,
                text=duel.improvement.text(),
            )
        )
    title = f"Probability of improvement over {study.terms.reference}, {study.terms.level:.0%}"
    return [Bars(title=title, x_label="probability", bars=bars, marks=half)]
