"""Games of every hunter against every prey, and the Elo of each from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.experiments.command import markdown
from seals.experiments.self_play.pursuit import HUNTER, PREY, Pursuit, Squad
from seals.learn.policy import Policy
from seals.learn.starts import held_out_seeds
from seals.learn.statistics.interval import wilson
from seals.learn.training.scoring import score
from seals.report import Chart, Series, write_picture

SCALE = 400.0 / np.log(10.0)
"""Points of Elo in a unit of log odds: ten to one is 400 points."""
DRAWN = 0.5
"""Games that each is taken to have won, and to have lost, against one of rating 0: without them
whoever never lost had no finite rating."""
RESAMPLES = 200
GAMES = Path(__file__).with_name("games.parquet")
"""One row a game in batch dynamics."""
FULL_WORLD = Path(__file__).with_name("full_world.parquet")
"""One row a game in full worlds with contacts."""
_STEPS = 60
"""Of Newton's method, which needs a dozen."""

Games = Mapping[str, NDArray[np.generic]]
"""Columns ``hunter`` and ``prey`` (turns after which each was kept, 0 for the scripts), ``start``
(seed), ``caught`` (0 or 1) and ``steps``, each of shape (games,)."""


class Ratings(NamedTuple):
    """Elo of one role by the turn, 0 for the script.

    Args:
        turn: shape (k,).
        elo: shape (k,).
        low: of the 95 % interval over the starts.
        high: its upper end.
    """

    turn: Floats
    elo: Floats
    low: Floats
    high: Floats


def tournament(
    hunters: Sequence[Policy], prey: Sequence[Policy], *, starts: int
) -> dict[str, NDArray[np.int64]]:
    """Play each hunter against each prey from the same held-out starts.

    Args:
        hunters: the script first.
        prey: likewise.
        starts: of each pair.
    """
    pairs = len(hunters) * len(prey)
    row = np.arange(pairs * starts, dtype=np.int64)
    hunter, runner = row % pairs // len(prey), row % len(prey)
    seeds = np.repeat(held_out_seeds(starts), pairs)
    pursuit = Pursuit(HUNTER, count=len(row))
    pursuit.opponent = Squad(prey, runner)
    found = score(pursuit, Squad(hunters, hunter), seeds.tolist())
    columns = {"hunter": hunter, "prey": runner, "start": seeds}
    columns |= {"caught": found.success, "steps": found.length}
    return {name: values.astype(np.int64) for name, values in columns.items()}


def elo(games: Games) -> tuple[Floats, Floats]:
    """Return the ratings of hunters and prey, mean 0, shapes (h,) and (p,).

    Equation:
        P(hunter i catches prey j) = 1 / (1 + 10^((r_j - r_i) / 400)), by maximum likelihood, with
        `DRAWN` games won and lost by each against one of rating 0

    Args:
        games: all numbers from 0 to the largest occur.

    References:
        Elo 1978, The rating of chessplayers; Bradley and Terry 1952, doi 10.2307/2334029.
    """
    hunter, prey = (np.asarray(games[name], dtype=int) for name in (HUNTER, PREY))
    count = hunter.max() + 1
    size = count + prey.max() + 1
    design = np.zeros((len(hunter), size))
    design[np.arange(len(hunter)), hunter] = 1.0
    design[np.arange(len(prey)), count + prey] = -1.0
    design = np.concatenate((design, np.eye(size)))
    won = np.concatenate((np.asarray(games["caught"], dtype=float), np.full(size, 0.5)))
    weight = np.concatenate((np.ones(len(hunter)), np.full(size, 2.0 * DRAWN)))
    odds = np.zeros(size)
    for _ in range(_STEPS):
        share = 1.0 / (1.0 + np.exp(-design @ odds))
        slope = design.T @ (weight * (won - share))
        bend = design.T @ (design * (weight * share * (1.0 - share))[:, None])
        odds += np.clip(np.linalg.solve(bend, slope), -1.0, 1.0)
    points = SCALE * (odds - odds.mean())
    return points[:count], points[count:]


def rated(games: Games, *, seed: int = 0) -> dict[str, Ratings]:
    """Return the ratings of both roles with percentile intervals over the starts.

    Args:
        games: of a tournament.
        seed: of the resamples.
    """
    random, starts = np.random.default_rng(seed), np.unique(games["start"])
    rows = [np.flatnonzero(games["start"] == start) for start in starts]
    drawn = []
    for _ in range(RESAMPLES):
        chosen = np.concatenate([rows[k] for k in random.integers(len(rows), size=len(rows))])
        drawn.append(elo({name: values[chosen] for name, values in games.items()}))
    found = {}
    for k, (role, best) in enumerate(zip((HUNTER, PREY), elo(games), strict=True)):
        low, high = np.percentile([each[k] for each in drawn], (2.5, 97.5), axis=0)
        found[role] = Ratings(np.arange(len(best), dtype=float), best, low, high)
    return found


def _names_of(count: int) -> list[str]:
    """Return the names of the script and of the policies after each turn."""
    return ["script", *(f"turn {k}" for k in range(1, count))]


def elo_table(games: Games) -> str:
    """Return the table of all ratings, in Markdown."""
    found = rated(games)
    columns = [
        [f"{e:.0f} ({a:.0f} to {b:.0f})" for e, a, b in zip(r.elo, r.low, r.high, strict=True)]
        for r in found.values()
    ]
    names = _names_of(len(columns[0]))
    rows = [list(row) for row in zip(names, *columns, strict=True)]
    return markdown(("policy", "hunter: Elo (95 %)", "prey: Elo (95 %)"), rows)


def cross_table(games: Games) -> str:
    """Return how many of its games each hunter won against each prey, in Markdown."""
    hunters, prey = (int(games[name].max()) + 1 for name in (HUNTER, PREY))
    rows = []
    for h, name in enumerate(_names_of(hunters)):
        cells = []
        for p in range(prey):
            chosen = games["caught"][(games[HUNTER] == h) & (games[PREY] == p)]
            cells.append(f"{int(chosen.sum())} of {len(chosen)}")
        rows.append([name, *cells])
    return markdown(("hunter, against prey", *_names_of(prey)), rows)


def full_table(games: Games) -> str:
    """Return how often each pair of the full worlds ended in a catch, in Markdown."""
    pairs = np.stack((games[HUNTER], games[PREY]), axis=1)
    last = int(pairs.max())
    names = {0: "script", last: f"turn {last}"}
    rows = []
    for h, p in np.unique(pairs, axis=0):
        chosen = games["caught"][(pairs == (h, p)).all(axis=1)]
        low, high = wilson(int(chosen.sum()), len(chosen))[1:]
        share = f"({100 * low:.0f} to {100 * high:.0f} %)"
        rows.append([names[int(h)], names[int(p)], f"{int(chosen.sum())} of {len(chosen)} {share}"])
    return markdown(("hunter", "prey", "caught in full worlds (95 %)"), rows)


def draw(games: Games, path: Path, *, steps: int) -> Path:
    """Draw the ratings over the control steps that each role has learned.

    Args:
        games: of a tournament.
        path: of the picture.
        steps: control steps of a turn.
    """
    series = []
    for role, found in rated(games).items():
        x = found.turn * steps / 1e3
        band = np.stack((found.elo - found.low, found.high - found.elo))[:, 1:]
        series.append(Series(name=role, x=x[1:], y=found.elo[1:], band=band))
        level = np.full(2, found.elo[0])
        series.append(Series(name=f"{role}, script", x=x[[1, -1]], y=level, dashed=True))
    chart = Chart(
        title="Both learn",
        y_label="Elo [1]",
        x_label="control steps of each role [thousand]",
        series=tuple(series),
    )
    return write_picture(path, chart)
