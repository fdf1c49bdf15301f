"""Evaluation results as a JSON file, a table of episodes, and a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seals.learn.evaluation.result import QUANTILES, EvaluationResult
from seals.learn.evaluation.words import label, rows_of, sentences
from seals.logs.atomic import write_json, write_table
from seals.report import (
    Bar,
    Bars,
    Chart,
    Paragraph,
    Section,
    Series,
    Table,
    write_page,
)

NUMBERS, EPISODES, PAGE = "evaluation.json", "episodes.csv", "evaluation.html"
_HOW = (
    "Every policy starts from the same places, which no training has seen, and acts without "
    "chance. Shares carry Wilson's 95% interval: it tells how well this policy is known, not how "
    "well its learner does. For learners, compare training runs: seals evaluate --compare."
)


def write_results(
    found: Sequence[EvaluationResult], out: Path, *, facts: Mapping[str, Any]
) -> list[Path]:
    """Write numbers, episodes and page into a folder.

    Args:
        found: judgements, the policy in question first.
        out: folder, made where it is not there.
        facts: of the evaluation, kept with the numbers.

    Returns:
        The files.
    """
    out.mkdir(parents=True, exist_ok=True)
    numbers = {
        **facts,
        "quantiles": list(QUANTILES),
        "judgements": [judged.to_dict() for judged in found],
    }
    write_json(out / NUMBERS, numbers)
    write_table(out / EPISODES, _episodes_of(found))
    words = f"{found[0].episodes} held-out starts, {facts['env']}"
    write_page(out / PAGE, f"Evaluation of {label(found[0])}", _sections(found), subtitle=words)
    return [out / NUMBERS, out / EPISODES, out / PAGE]


def _episodes_of(found: Sequence[EvaluationResult]) -> dict[str, Any]:
    """Return a row for each episode of all results; NaN for missing columns."""
    names = list(dict.fromkeys(name for judged in found for name in judged.columns))
    columns: dict[str, Any] = {
        "policy": [judged.policy for judged in found for _ in range(judged.episodes)],
        "world": [judged.world for judged in found for _ in range(judged.episodes)],
    }
    for name in names:
        parts = [j.columns.get(name, np.full(j.episodes, np.nan)) for j in found]
        columns[name] = np.concatenate(parts)
    # seeds have ten digits: as real numbers they would be rounded by some readers
    columns["seed"] = columns["seed"].astype(np.int64)
    return columns


def _sections(found: Sequence[EvaluationResult]) -> list[Section]:
    head, rows = rows_of(found)
    bars = [
        Bar(label=_name(j), value=j.share().high, start=j.share().low, text=j.share().text())
        for j in found
    ]
    blocks = [Bars(title="Success, 95% interval", x_label="share of episodes", bars=bars)]
    lines = tuple(_distances(judged) for judged in found if "distance" in judged.columns)
    values = [Paragraph(text=text) for text in sentences(found)]
    sections = [
        Section(title="Success", blocks=[*values, *blocks]),
        Section(title="Table", blocks=[Table(head=head, rows=rows, right=range(1, len(head)))]),
    ]
    if lines:
        chart = Chart(
            title="Episodes that ended within a distance",
            y_label="share of episodes",
            x_label="final distance [m]",
            series=lines,
        )
        sections.append(Section(title="Final distance", blocks=[chart], wide=True))
    sections.append(Section(title="How it was judged", blocks=[Paragraph(text=_HOW)]))
    return sections


def _name(found: EvaluationResult) -> str:
    return f"{label(found)}, {found.world}" if found.world else label(found)


def _distances(found: EvaluationResult) -> Series:
    """Fraction of episodes below each distance, as a step curve."""
    ordered = np.sort(found.columns["distance"])
    share = np.arange(1, len(ordered) + 1) / len(ordered)
    return Series(
        name=_name(found), x=np.repeat(ordered, 2), y=np.stack([share - share[0], share], 1).ravel()
    )
