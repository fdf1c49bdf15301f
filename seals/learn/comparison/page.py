"""Results of a comparison of arms: numbers, sentences, tables, and their page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.learn.comparison.runs import Run
from seals.learn.comparison.settings import AnalysisPlan
from seals.learn.statistics.curve import LAST
from seals.learn.statistics.interval import Interval
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
                Fold(title="Scores of every run", blocks=[_table(_run_rows(study))]),
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


@dataclass(frozen=True, kw_only=True, eq=False)
class Band:
    """Interquartile mean of an arm's learning curves, with interval.

    Args:
        x: shape (points,).
        line: interquartile mean of the runs, shape (points,).
        low: lower limit at each point.
        high: upper limit at each point.
        runs: each run's curve, shape (runs, points).
    """

    x: Floats
    line: Floats
    low: Floats
    high: Floats
    runs: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Arm:
    """Results of one arm: runs, scores with intervals, learning curves.

    Args:
        name: of the arm.
        runs: that belong to it.
        scores: of each run by metric, each of shape (runs,).
        middle: interquartile mean of the scores by metric.
        band: its curves over the budget.
        clock: its curves over seconds, or None where the runs did not say.
    """

    name: str
    runs: Sequence[Run]
    scores: Mapping[str, Floats]
    middle: Mapping[str, Interval]
    band: Band
    clock: Band | None

    def to_dict(self) -> dict[str, Any]:
        """Return runs with their scores, interval of the mean, and curves, as plain data."""
        bands = {"over_budget": self.band, "over_seconds": self.clock}
        return {
            "runs": [
                {
                    "folder": run.folder,
                    "seed": run.seed,
                    "state": run.state,
                    **{key: float(values[k]) for key, values in self.scores.items()},
                }
                for k, run in enumerate(self.runs)
            ],
            "iqm": {key: list(value) for key, value in self.middle.items()},
            "curves": {
                key: {n: getattr(band, n) for n in ("x", "line", "low", "high")}
                for key, band in bands.items()
                if band is not None
            },
        }


@dataclass(frozen=True, kw_only=True)
class ArmComparison:
    """Comparison of two arms in one metric.

    Args:
        arm: in question.
        against: the reference.
        metric: by name.
        improvement: probability that a run of the arm scores higher; claims go by this.
        bootstrap: the same with the interval that published tables use.
        p: exact two-sided p of the rank-sum test.
        pairs: share of paired seeds in which the arm is above, or None without pairs.
    """

    arm: str
    against: str
    metric: str
    improvement: Interval
    bootstrap: Interval
    p: float
    pairs: Interval | None

    @property
    def verdict(self) -> str:
        """Return ``better``, ``worse`` or ``open``, as the interval allows."""
        if self.improvement.low > 0.5:
            return "better"
        return "worse" if self.improvement.high < 0.5 else "open"


@dataclass(frozen=True, kw_only=True, eq=False)
class Study:
    """Arms, their comparisons, and the analysis plan.

    Args:
        terms: with budget and reference filled in.
        arms: in the order given.
        duels: of every arm with the reference, in every metric.
        remarks: what a reader must know before believing the table.
    """

    terms: AnalysisPlan
    arms: Sequence[Arm]
    duels: Sequence[ArmComparison]
    remarks: Sequence[str]

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers as plain data."""
        return {
            "terms": vars(self.terms),
            "remarks": list(self.remarks),
            "arms": {a.name: a.to_dict() for a in self.arms},
            "duels": [
                {
                    **{
                        key: getattr(d, key) for key in ("arm", "against", "metric", "p", "verdict")
                    },
                    "improvement": list(d.improvement),
                    "bootstrap": list(d.bootstrap),
                    "pairs": None if d.pairs is None else list(d.pairs),
                }
                for d in self.duels
            ],
        }


METRIC_NAMES = {"area": "area under the curve", "last": f"mean of the last {LAST:.0%}"}
_SAYS = {
    ("area", "better"): "learns faster than",
    ("area", "worse"): "learns more slowly than",
    ("last", "better"): "ends higher than",
    ("last", "worse"): "ends lower than",
}
_SAYS_OF_OTHERS = {
    ("area", "better"): "lies above",
    ("area", "worse"): "lies below",
    **{key: words for key, words in _SAYS.items() if key[0] == "last"},
}
"""Where the value is none that learning raises, such as a distance."""

Rows = list[tuple[str, ...]]


def claims(study: Study) -> list[str]:
    """Return one sentence per comparison: the claim that its interval supports, or ``open``."""
    return [_claim(duel, study) for duel in study.duels]


def _claim(duel: ArmComparison, study: Study) -> str:
    found = duel.improvement
    chance = (
        f"probability of improvement {found.value:.2f}, {study.terms.level:.0%} interval "
        f"{found.low:.2f} to {found.high:.2f}"
    )
    if duel.verdict == "open":
        return (
            f"{duel.arm} against {duel.against}, {METRIC_NAMES[duel.metric]}: "
            f"no difference is shown ({chance})."
        )
    says = _SAYS if study.terms.value in ("success", "return") else _SAYS_OF_OTHERS
    return f"{duel.arm} {says[duel.metric, duel.verdict]} {duel.against} ({chance})."


def arm_rows(study: Study) -> tuple[tuple[str, ...], Rows]:
    """Return header and rows of the table of arms."""
    level = f"{study.terms.level:.0%}"
    head = (
        "arm",
        "runs",
        *(f"{METRIC_NAMES[key]}, IQM ({level})" for key in METRIC_NAMES),
        "lowest run, end",
        "highest run, end",
    )
    rows = [
        (
            arm.name,
            str(len(arm.runs)),
            *(arm.middle[key].text(3) for key in METRIC_NAMES),
            f"{arm.scores['last'].min():.3f}",
            f"{arm.scores['last'].max():.3f}",
        )
        for arm in study.arms
    ]
    return head, rows


def comparison_rows(study: Study) -> tuple[tuple[str, ...], Rows]:
    """Return header and rows of the table of comparisons."""
    head = (
        f"against {study.terms.reference}",
        "metric",
        "P(improvement)",
        "the same, bootstrap",
        "paired seeds above",
        "exact p",
        "verdict",
    )
    return head, [
        (
            duel.arm,
            METRIC_NAMES[duel.metric],
            duel.improvement.text(),
            duel.bootstrap.text(),
            "no pairs" if duel.pairs is None else duel.pairs.text(),
            f"{duel.p:.4f}" if duel.p >= 1e-4 else "<0.0001",
            duel.verdict,
        )
        for duel in study.duels
    ]


def _run_rows(study: Study) -> tuple[tuple[str, ...], Rows]:
    """Return header and rows of the table of all runs."""
    head = ("arm", "seed", *METRIC_NAMES.values(), "state", "folder")
    rows = []
    for arm in study.arms:
        for k, run in enumerate(arm.runs):
            seed = "" if run.seed is None else str(run.seed)
            scores = (f"{arm.scores[key][k]:.3f}" for key in METRIC_NAMES)
            rows.append((arm.name, seed, *scores, run.state, run.folder.as_posix()))
    return head, rows


def terms_words(study: Study) -> str:
    """Return the analysis plan of the comparison in a sentence."""
    terms = study.terms
    return (
        f"{terms.value} over {terms.over} up to {terms.budget:g}; reference {terms.reference}; "
        f"{terms.level:.0%} intervals, {terms.resamples} resamples of whole runs, "
        f"seed {terms.seed}."
    )


def text_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table as lines of text, columns aligned."""
    from seals.text_table import table

    return table([tuple(head), *(tuple(row) for row in rows)], indent="")
