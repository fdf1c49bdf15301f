"""Report of a comparison: HTML page, JSON file, one picture per case."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seals.compare.case import Case
from seals.compare.predict import residuals
from seals.compare.result import Comparison, Group
from seals.compare.score import by_horizon, pooled, unit_words
from seals.compare.variants import ModelVariant
from seals.file_names import REPORT, file_name
from seals.frames import AXES
from seals.logs.atomic import write_json
from seals.report import (
    Block,
    Chart,
    Fold,
    Paragraph,
    Section,
    Series,
    Table,
    write_page,
    write_picture,
)
from seals.report.figures import Mark
from seals.report.page import Facts
from seals.report.style import MUTED, unit_text

SHOWN = 6
"""Stretches shown open; the others fold."""


def write_report(comparison: Comparison, data: dict[str, Any], folder: Path) -> dict[str, Path]:
    """Write report.html, comparison.json and plots/*.png.

    Returns:
        Paths by name.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_json(folder / "comparison.json", data)
    plots = folder / "plots"
    for group in comparison.groups:
        for k, case in enumerate(group.cases):
            plots.mkdir(exist_ok=True)
            write_picture(plots / f"{file_name(case.name)}.png", case_charts(group, k))
    path = write_page(
        folder / REPORT,
        f"Comparison: {comparison.name}",
        sections_of(comparison),
        subtitle=f"{comparison.model}; computed in {comparison.seconds:.1f} s",
    )
    return {"report": path, "data": folder / "comparison.json", "plots": plots}


def sections_of(comparison: Comparison) -> list[Section]:
    """Return the page's sections."""
    out = [_summary(comparison)]
    shown = 0
    for group in comparison.groups:
        ordered = sorted(range(len(group.cases)), key=lambda k: not group.cases[k].held_out)
        blocks: list[Block] = [_variant_table(group)]
        for k in ordered:
            charts = case_charts(group, k)
            words = Paragraph(text="; ".join((_role(group.cases[k]), *group.cases[k].notes)))
            if shown < SHOWN:
                blocks += [words, *charts]
            else:
                blocks.append(
                    Fold(
                        title=f"{group.cases[k].name} ({_role(group.cases[k])})",
                        blocks=[words, *charts],
                    )
                )
            shown += 1
        blocks += _horizon(group)
        out.append(Section(title=group.name, blocks=blocks))
    out.append(_checks(comparison))
    return out


def _summary(comparison: Comparison) -> Section:
    facts: dict[str, str] = {}
    rows = []
    for group in comparison.groups:
        for channel in _channels(group):
            first, last = group.variants[0], group.variants[-1]
            held = any(c.held_out for c in group.cases)
            before, after = first.rms(channel, held_out=held), last.rms(channel, held_out=held)
            best = min(group.variants, key=lambda r: r.rms(channel, held_out=held))
            score = pooled(best.scores, held_out=held)[channel]
            rows.append(
                [
                    group.name,
                    channel,
                    f"{before:.4g}",
                    f"{after:.4g}",
                    f"{score.rms:.4g}",
                    best.name,
                    unit_words(channel),
                    f"{score.ratio:.3g}",
                ]
            )
            if len(facts) < 6:
                judged = "held-out" if held else "fitted"
                fall = f"{before:.3g} → " if len(group.variants) > 1 else ""
                key = f"{group.name}: {channel}, {judged} error [{unit_words(channel)}]"
                facts[key] = f"{fall}{score.rms:.3g}"
    table = Table(
        head=[
            "set",
            "channel",
            "first rung",
            "last rung",
            "best",
            "best rung",
            "unit",
            "best / noise floor",
        ],
        rows=rows,
        right=(2, 3, 4, 7),
    )
    lead = (
        "Error is the root mean square of measurement minus model, on held-out stretches if there "
        "are any. The noise floor is estimated from the data only (third differences), "
        "not from a fit."
    )
    return Section(title="Summary", lead=lead, blocks=[Facts(values=facts), table], wide=True)


def _variant_table(group: Group) -> Table:
    rows = []
    for variant in group.variants:
        for channel in _channels(group):
            train, held = (pooled(variant.scores, held_out=h).get(channel) for h in (False, True))
            best = held or train
            words = []
            for f in variant.fitted:
                bound = " (at its bound)" if f.at_bound else ""
                words.append(
                    f"{f.key.removeprefix('effects.')} = {f.value:.4g} ± {f.sigma:.2g} "
                    f"{f.unit}{bound}"
                )
            rows.append(
                [
                    variant.name,
                    channel,
                    _figure(train.rms if train else math.nan),
                    _figure(held.rms if held else math.nan),
                    unit_words(channel),
                    _figure(best.ratio if best else math.nan),
                    ", ".join(words),
                ]
            )
    return Table(
        head=["model", "channel", "fitted", "held out", "unit", "× noise floor", "fitted values"],
        rows=rows,
        right=(2, 3, 5),
    )


def case_charts(group: Group, k: int) -> list[Chart]:
    """Return overlay and residual of every measured component of one case."""
    # smallest error on held-out cases, or on all without any
    held = any(c.held_out for c in group.cases)

    def size(variant: ModelVariant) -> float:
        scores = [s.total for s in variant.scores if s.held_out or not held]
        return sum(scores) / len(scores)

    case, first, best = group.cases[k], group.variants[0], min(group.variants, key=size)
    out = []
    shown = (best,) if best is first else (first, best)
    for channel in case.measured:
        for axis in range(case.measured[channel].shape[1]):
            if channel != "orientation" and np.isfinite(case.measured[channel][:, axis]).any():
                out.append(_overlay(case, channel, axis, shown, k))
        out.append(_residual(case, channel, first, best, k))
    return out


def _overlay(case: Case, channel: str, axis: int, shown: Sequence[ModelVariant], k: int) -> Chart:
    """Measurement and models, the last of which is drawn solid."""
    measured = case.measured[channel][:, axis]
    good = np.isfinite(measured)
    sigma = float(case.sigma[channel][axis])
    models = (
        Series(
            name=variant.name,
            x=case.time,
            y=variant.predicted[k][channel][:, axis],
            dashed=variant is not shown[-1],
        )
        for variant in shown
    )
    # last, for it lies on the curves, and they have the colours of their residuals
    seen = Series(
        name="measured",
        x=case.time[good],
        y=measured[good],
        points=bool(good.sum() < 200),
        band=np.full(int(good.sum()), 2.0 * sigma),
        colour=MUTED,
    )
    return Chart(
        title=f"{case.name}: {_component(channel, axis, case)}",
        y_label=f"{_component(channel, axis, case)} [{unit_text(unit_words(channel))}]",
        series=(*models, seen),
        marks=_marks(case),
    )


def _residual(case: Case, channel: str, first: ModelVariant, last: ModelVariant, k: int) -> Chart:
    series = []
    for variant in (last,) if first is last else (first, last):
        values = residuals(case, variant.predicted[k])[channel]
        for axis in range(values.shape[1]):
            good = np.isfinite(values[:, axis])
            if good.any():
                name = f"{variant.name}, {_component(channel, axis, case)}"
                series.append(
                    Series(
                        name=name,
                        x=case.time[good],
                        y=values[good, axis],
                        dashed=variant is not last,
                    )
                )
    return Chart(
        title=f"{case.name}: measured less model, {channel.replace('_', ' ')}",
        y_label=f"residual [{unit_text(unit_words(channel))}]",
        series=tuple(series),
        marks=(*_marks(case), Mark(at=0.0, label="", level=True)),
    )


def _marks(case: Case) -> tuple[Mark, ...]:
    """Times at which the regime changes."""
    from seals.compare.case import Regime

    change = np.flatnonzero(np.diff(case.regime)) + 1
    return tuple(
        Mark(at=float(case.time[i]), label=Regime(int(case.regime[i])).name) for i in change[:8]
    )


def _horizon(group: Group) -> list[Block]:
    """Error against the time since the start, last variant, one chart a channel."""
    out: list[Block] = []
    last = group.variants[-1]
    for channel in _channels(group):
        series = []
        for k, case in enumerate(group.cases):
            if channel in case.measured:
                times, sizes = by_horizon(case, last.predicted[k])[channel]
                series.append(Series(name=case.name, x=times, y=sizes, dashed=not case.held_out))
        floor = float(
            np.nanmin([np.min(c.sigma[channel]) for c in group.cases if channel in c.sigma])
        )
        marks = (Mark(at=floor, label="noise floor", level=True),)
        out.append(
            Chart(
                title=f"Error against horizon: {channel}, {last.name}",
                x_label="time since the start [s]",
                y_label=f"rms error [{unit_text(unit_words(channel))}]",
                series=tuple(series),
                marks=marks,
            )
        )
    return out


def _checks(comparison: Comparison) -> Section:
    rows = [
        [name, str(finding)] for name, found in comparison.findings.items() for finding in found
    ]
    regimes = [
        [s.name, r.name, regime, f"{value:.3g}"]
        for g in comparison.groups
        for r in (g.variants[0], g.variants[-1])
        for s in r.scores
        for regime, value in s.regimes.items()
    ]
    sources = [[name, text] for name, text in comparison.sources.items()]
    offsets = [
        [case, channel, f"{1e3 * lag:+.2f}", f"{match:.3f}"]
        for g in comparison.groups
        for case, found in g.offsets.items()
        for channel, (lag, match) in found.items()
    ]
    blocks: list[Block] = [
        Fold(
            title="Data check",
            blocks=[Table(head=["log", "finding"], rows=rows or [["all", "nothing to report"]])],
        ),
        Fold(
            title="Error by regime, as a multiple of the noise floor",
            blocks=[
                Table(
                    head=["stretch", "model", "regime", "× noise floor"], rows=regimes, right=(3,)
                )
            ],
        ),
        Fold(title="Sources and licences", blocks=[Table(head=["log", "source"], rows=sources)]),
    ]
    if offsets:
        head = ["stretch", "channel", "lag [ms]", "correlation"]
        blocks.insert(
            1,
            Fold(
                title="Clock offset against the model",
                blocks=[Table(head=head, rows=offsets, right=(2, 3))],
            ),
        )
    return Section(title="Behind the figures", blocks=blocks)


def _channels(group: Group) -> list[str]:
    return sorted({c for case in group.cases for c in case.measured})


def _role(case: Case) -> str:
    return "held out" if case.held_out else "fitted"


def _component(channel: str, axis: int, case: Case) -> str:
    width, words = case.measured[channel].shape[1], channel.replace("_", " ")
    if width == 1:
        return words
    return f"{words} {AXES[axis]}" if width == 3 else f"{words} {axis + 1}"


def _figure(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "–"
