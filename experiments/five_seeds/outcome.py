"""Results of all seeds: a table and the learning curves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.experiments.command import markdown
from seals.experiments.five_seeds.episode_tables import BESIDE, Tables
from seals.learn.evaluation.page import FURTHER, SHARE, share_words
from seals.learn.statistics.interval import bootstrap, wilson
from seals.report import Chart, Series, write_picture


class _Judged(NamedTuple):
    """One policy in one world.

    Args:
        policy: its name.
        shares: times that each property was true, by its name.
        medians: of facts over the episodes that tell them, NaN without one.
        episodes: number of starts.
    """

    policy: str
    shares: dict[str, int]
    medians: dict[str, float]
    episodes: int

    def success(self) -> str:
        """Return the successes with Wilson's interval."""
        won = self.shares[SHARE]
        low, high = wilson(won, self.episodes)[1:]
        return f"{won} of {self.episodes} ({100.0 * low:.0f} to {100.0 * high:.0f} %)"


def _judged(number: int, rows: dict[str, Floats], world: float) -> _Judged:
    names = {value: name for name, value in BESIDE.items()}
    here = {k: values[rows["world"] == world] for k, values in rows.items()}
    shares = [k for k in here if k.startswith(SHARE) and np.isfinite(here[k]).all()]
    medians = {k: here[k][np.isfinite(here[k])] for k in FURTHER if k in here}
    return _Judged(
        names.get(number, f"seed {number}"),
        {name: int(here[name].sum()) for name in shares},
        {k: float(np.median(x)) if len(x) else np.nan for k, x in medians.items()},
        len(here[SHARE]),
    )


def table_of(tables: Tables, worlds: Sequence[str], *, enough: float) -> str:
    """Return the table of all policies in Markdown, and how many seeds did as asked.

    Over seeds the share is an interquartile mean with the interval of a bootstrap of seeds.

    Args:
        tables: of the recipe.
        worlds: names of the other worlds.
        enough: share of its held-out starts that a seed is asked for [1].
    """
    numbers = tables.episodes["policy"]
    found = []
    for seed in sorted(set(numbers), key=lambda n: (n < 0, abs(n))):
        rows = {k: values[numbers == seed] for k, values in tables.episodes.items()}
        found.append({int(w): _judged(int(seed), rows, w) for w in np.unique(rows["world"])})
    head, columns = ["policy"], [[one[min(one)].policy for one in found]]
    for number, world in enumerate(("", *worlds)):
        here = [one.get(number) for one in found]
        known = [x for x in here if x is not None]
        if not known:
            continue
        before = f"{world}: " if world else ""
        head.append(f"{before}success (95 %)")
        columns.append(["" if x is None else x.success() for x in here])
        for name in (k for k in known[0].shares if k != SHARE):
            head.append(before + share_words(name))
            columns.append(["" if x is None else str(x.shares.get(name, "")) for x in here])
        for name in known[0].medians:
            values = [np.nan if x is None else x.medians.get(name, np.nan) for x in here]
            if np.isfinite(values).any():
                head.append(before + FURTHER[name])
                columns.append([f"{x:.2f}" if np.isfinite(x) else "" for x in values])
    seconds = {f"seed {s:.0f}": _curve(tables, s, "seconds")[-1] for s in _seeds(tables)}
    head.append("training [s]")
    columns.append([f"{seconds[name]:.0f}" if name in seconds else "" for name in columns[0]])
    seeds = [one[0] for one in found if 0 in one and one[0].policy in seconds]
    good = sum(one.shares[SHARE] >= enough * one.episodes for one in seeds)
    said = f"{good} of {len(seeds)} seeds reach {enough:.0%} of their held-out starts."
    if len(seeds) > 1:
        over = bootstrap([[one.shares[SHARE] / one.episodes for one in seeds]])
        said += f" Over seeds: {over.value:.0%} ({over.low:.0%} to {over.high:.0%})."
    return markdown(head, list(zip(*columns, strict=True))) + f"\n{said}\n"


def write_curves(tables: Tables, path: Path) -> Path:
    """Draw the share of successes on validation starts over control steps, by seed."""
    lines = [
        Series(name=f"seed {s:.0f}", x=_curve(tables, s, "step"), y=_curve(tables, s, "success"))
        for s in _seeds(tables)
    ]
    chart = Chart(
        title="Success on validation starts",
        x_label="control steps",
        y_label="share of episodes",
        series=tuple(lines),
    )
    return write_picture(path, chart)


def _seeds(tables: Tables) -> list[float]:
    return sorted(set(tables.looks["seed"]))


def _curve(tables: Tables, seed: float, name: str) -> Floats:
    found: Floats = tables.looks[name][tables.looks["seed"] == seed]
    return found
