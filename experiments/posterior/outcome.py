"""Results of the experiment: a table of episodes, paired differences and curves."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import SealsError
from seals.experiments.command import markdown
from seals.experiments.posterior.tasks import ARMS
from seals.experiments.trials import read_rows
from seals.learn.statistics.interval import LEVEL
from seals.logs.atomic import write_table
from seals.logs.table import read_parquet
from seals.report import Chart, Series, write_picture

EPISODES = "episodes.parquet"
COLUMNS = ("success", "distance", "reached_after", "return")
"""Facts of an episode that are kept."""
PAIRS = (("posterior", "tolerances"), ("posterior", "nominal"), ("oracle", "posterior"))
"""Compared arms; the first pair decides."""


class Difference(NamedTuple):
    """Paired difference of two arms.

    Args:
        mean: over the seeds.
        low: lower end of its interval.
        high: upper end.
        seeds: number of pairs.
    """

    mean: float
    low: float
    high: float
    seeds: int

    @property
    def verdict(self) -> str:
        """Verdict by the decision rule of the experiment."""
        return "higher" if self.low > 0.0 else "lower" if self.high < 0.0 else "not shown"


def gather(out: Path) -> dict[str, Floats]:
    """Read the evaluated episodes of all trainings and write them as one table.

    Args:
        out: folder with ``ARM/SEED/judged/STEP/episodes.csv``.

    Returns:
        Columns ``arm`` (number in the order of the arms), ``seed``, ``step``, ``start`` and the
        facts of the episode, each of shape (episodes,).

    Raises:
        SealsError: nothing was judged.
    """
    rows: list[tuple[float, ...]] = []
    for number, arm in enumerate(ARMS):
        for file in sorted((out / arm).glob("*/judged/*/episodes.csv")):
            seed, step = float(file.parents[2].name), float(file.parent.name)
            for row in read_rows(file):
                facts = (float(row[name] or "nan") for name in COLUMNS)
                rows.append((number, seed, step, float(row["seed"]), *facts))
    if not rows:
        raise SealsError(f"{out}: nothing was judged.\nTrain and judge first.")
    table = np.array(rows)
    names = ("arm", "seed", "step", "start", *COLUMNS)
    columns: dict[str, Floats] = {name: table[:, k] for k, name in enumerate(names)}
    write_table(out / EPISODES, columns)
    return columns


def scores(table: Mapping[str, Floats]) -> dict[str, dict[int, dict[int, float]]]:
    """Return the share of successes by arm, seed and step."""
    found: dict[str, dict[int, dict[int, float]]] = {arm: {} for arm in ARMS}
    keys = np.stack([table[name] for name in ("arm", "seed", "step")], axis=1).astype(int)
    for arm, seed, step in np.unique(keys, axis=0):
        here = (keys == (arm, seed, step)).all(axis=1)
        share = float(table["success"][here].mean())
        found[ARMS[arm]].setdefault(int(seed), {})[int(step)] = share
    return found


def difference(x: Mapping[int, float], y: Mapping[int, float]) -> Difference:
    """Return the mean difference of two arms over the seeds that both have, with a t interval.

    Raises:
        SealsError: fewer than two seeds are in both.

    References:
        Student 1908, doi:10.1093/biomet/6.1.1.

    Example:
        >>> difference({0: 0.9, 1: 0.8, 2: 1.0}, {0: 0.5, 1: 0.5, 2: 0.5}).verdict
        'higher'
    """
    from scipy.stats import t

    both = sorted(x.keys() & y.keys())
    if len(both) < 2:
        raise SealsError(f"{len(both)} seeds are in both arms.\nAllowed: at least two pairs.")
    apart = np.array([x[seed] - y[seed] for seed in both])
    mean = float(apart.mean())
    half = float(t.ppf(0.5 + 0.5 * LEVEL, len(both) - 1) * apart.std(ddof=1) / np.sqrt(len(both)))
    return Difference(mean, mean - half, mean + half, len(both))


def tell(table: Mapping[str, Floats], out: Path) -> str:
    """Write curves into a folder and return the tables of arms and differences."""
    every, final = scores(table), int(table["step"].max())
    # a policy that was not judged after its whole training says nothing of its arm
    ended = {a: {s for s, x in seeds.items() if final in x} for a, seeds in every.items()}
    # and one whose pair is missing in another arm is left out, as declared
    whole = set.intersection(*(seeds for seeds in ended.values() if seeds))
    found = {a: {s: every[a][s] for s in sorted(whole)} for a in every if ended[a]}
    last = {arm: {s: steps[final] for s, steps in seeds.items()} for arm, seeds in found.items()}
    rows = []
    for arm in found:
        shares = last[arm]
        here = (table["arm"] == ARMS.index(arm)) & (table["step"] == final)
        away = f"{np.median(table['distance'][here & np.isin(table['seed'], list(shares))]):.3f}"
        of_each = list(shares.values())
        rows.append(
            (
                f"`{arm}`",
                f"{np.mean(of_each):.3f}",
                ", ".join(f"{share:.2f}" for share in of_each),
                away,
            )
        )
    pairs = []
    for better, worse in PAIRS:
        if better in last and worse in last:
            apart = difference(last[better], last[worse])
            interval = f"{apart.mean:+.3f} ({apart.low:+.3f} to {apart.high:+.3f})"
            pairs.append((f"`{better}` - `{worse}`", interval, str(apart.seeds), apart.verdict))
    write_picture(out / "curves.png", _chart(found))
    head = ("arm", "success, mean of seeds", "of each seed", "final distance, median [m]")
    apart_head = ("difference", "of success (95 %)", "seeds", "verdict")
    return markdown(head, rows) + "\n" + markdown(apart_head, pairs)


def _chart(found: Mapping[str, Mapping[int, Mapping[int, float]]]) -> Chart:
    """Return the mean share of successes over control steps, with the range of the seeds."""
    lines = []
    for arm, seeds in found.items():
        steps = sorted(set.intersection(*(set(curve) for curve in seeds.values())))
        values = np.array([[curve[step] for step in steps] for curve in seeds.values()])
        mean = values.mean(axis=0)
        reach = np.stack([mean - values.min(axis=0), values.max(axis=0) - mean])
        lines.append(Series(name=arm, x=np.array(steps) / 1e6, y=mean, band=reach))
    return Chart(
        title="Success in the test world",
        x_label="control steps of training [million]",
        y_label="share of held-out starts",
        series=tuple(lines),
        note="mean of the seeds, band from the lowest to the highest",
    )


def kept(file: Path) -> dict[str, Floats]:
    """Read a table of episodes that `gather` wrote."""
    return dict(read_parquet(file))
