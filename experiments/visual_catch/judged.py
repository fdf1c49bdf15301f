"""Table of who caught the crab from which held-out start, kept beside this file."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.errors import ConfigError
from seals.learn.shipped import detector_folder
from seals.learn.starts import held_out_seeds
from seals.learn.statistics.interval import wilson
from seals.logs.atomic import write_table
from seals.plugins.tasks.sighting.detector import PARTS, WEIGHTS
from seals.sysid.parallel import spread

ROWS = Path(__file__).with_name("judged.parquet")
"""One row an episode."""
RATE = 10.0
"""Control steps a second [Hz]."""
HEAD = """| prey | detector | caught within 45 s (95 %) | held after, median |
|---|---|---|---|"""
ROUNDS = 3
"""Jobs of each process between two tables."""
CHUNK = 5
"""Episodes of one job, which builds a world of its own."""
SMALL = [
    "task.black=true",
    *(f"sensors.{c}.{s}=16" for c in ("front", "belly") for s in ("width", "height")),
]
"""Words of the control: black pictures are as black where they are small."""
PREY = {"walking": "catch_seen", "fleeing": "catch_seen_fleeing"}


class Flight(NamedTuple):
    """What an episode gave.

    Args:
        case: prey and detector.
        start: seed of the start.
        success: whether the animal was caught.
        steps: control steps.
        weights: first digits of the SHA-256 of the detector's weights.
    """

    case: str
    start: int
    success: bool
    steps: int
    weights: str


_KINDS: dict[str, Any] = dict(zip(Flight._fields, (str, int, bool, int, str), strict=True))


def judge(
    detectors: Sequence[str], path: Path, *, episodes: int, processes: int, limit: float
) -> None:
    """Fly from held-out starts by each detector and with black pictures; write all episodes.

    Episodes that the table holds are not flown again.

    Args:
        detectors: folders.
        path: of the table, written anew after every few jobs of a process.
        episodes: starts of each case.
        processes: that share them.
        limit: after which no episode begins [s].

    Raises:
        ConfigError: the file holds no such table, or that of other detectors.
    """
    seeds, until = held_out_seeds(episodes), time.time() + limit
    cases, weights = [], [digits_of(detector) for detector in detectors]
    for prey, env in PREY.items():
        seen = [[f"env={env}", f"task.detector={detector}"] for detector in detectors]
        named = zip(seen, weights, strict=True)
        cases += [(f"{prey}, seed {k}", *each) for k, each in enumerate(named)]
        cases.append((f"{prey}, black pictures", seen[0] + SMALL, weights[0]))
    rows = flown(path) if path.is_file() else []
    known = {case: digits for case, _, digits in cases}
    for row in rows:
        if known.get(row.case, row.weights) != row.weights:
            raise ConfigError(
                f"{path} holds '{row.case}' of another detector ({row.weights}, now "
                f"{known[row.case]}).\nGive --out another file, or the detectors that it is of."
            )
    done = {(row.case, row.start) for row in rows}
    jobs = []
    for case, words, digits in cases:
        left = [seed for seed in seeds if (case, seed) not in done]
        cuts = [left[k : k + CHUNK] for k in range(0, len(left), CHUNK)]
        jobs += [((case, digits), words, cut, until) for cut in cuts]
    at_once = ROUNDS * processes
    for k in range(0, len(jobs), at_once):
        for found in spread(_judged, jobs[k : k + at_once], processes):
            rows += found
        if rows:
            keep(rows, path)


def digits_of(detector: str) -> str:
    """Return the first digits of the SHA-256 of a detector's weights; empty without weights.

    Raises:
        ConfigError: there is no such detector.
    """
    if detector == PARTS:
        return ""
    weights = (detector_folder(detector, besides=(PARTS,)) / WEIGHTS).read_bytes()
    return hashlib.sha256(weights).hexdigest()[:16]


def _judged(job: tuple[tuple[str, str], list[str], list[int], float]) -> list[Flight]:
    """Return case, start, success and steps of the episodes of one job."""
    import torch

    from seals.config.compose import compose
    from seals.learn.environments import batched_of
    from seals.learn.evaluation.policies import policy_of
    from seals.learn.training.scoring import score

    (case, digits), words, seeds, until = job
    if time.time() > until:
        return []
    torch.set_num_threads(1)
    config = compose([*words, "backend=mujoco", "task.ends=true"], root="evaluate")
    environment, rows = batched_of(config, count=1), []
    try:
        policy = policy_of("scripted", environment, device="cpu")
        for seed in seeds:
            if time.time() < until:
                found = score(environment, policy, [seed])
                ended = bool(found.success[0]), int(found.length[0])
                rows.append(Flight(case, seed, *ended, digits))
    finally:
        environment.close()
    return rows


def flown(path: Path = ROWS) -> list[Flight]:
    """Return the episodes of a table.

    Args:
        path: of the table.

    Raises:
        ConfigError: it is no table of episodes.
    """
    import pyarrow
    import pyarrow.parquet

    try:
        rows = pyarrow.parquet.read_table(path, columns=list(Flight._fields)).to_pylist()
        return [Flight(*(kind(row[name]) for name, kind in _KINDS.items())) for row in rows]
    except (OSError, ValueError, TypeError, KeyError, pyarrow.ArrowException) as error:
        raise ConfigError(
            f"{path} is no table of episodes: {error}\n"
            "Give the file of an earlier judge, or a new name."
        ) from None


def keep(rows: Sequence[Flight], path: Path = ROWS) -> None:
    """Write episodes as a table.

    Args:
        rows: of all cases.
        path: of the table.
    """
    columns = dict(zip(Flight._fields, zip(*sorted(rows), strict=True), strict=True))
    write_table(path, {name: np.asarray(values) for name, values in columns.items()})


def lines(path: Path = ROWS) -> list[str]:
    """Return the lines of the page's table, one a case.

    Args:
        path: of the episodes.
    """
    rows = flown(path)
    return [_line(case, rows) for case in dict.fromkeys(row.case for row in rows)]


def _line(case: str, rows: Sequence[Flight]) -> str:
    prey, _, detector = case.partition(", ")
    chosen = [row for row in rows if row.case == case]
    won, steps = (np.array([getattr(row, name) for row in chosen]) for name in ("success", "steps"))
    bounds = wilson(int(won.sum()), len(won))
    took = f"{np.median(steps[won]) / RATE:.1f} s" if won.any() else ""
    share = f"{100 * bounds.low:.0f} to {100 * bounds.high:.0f} %"
    count = f"{won.sum()} of {len(won)} ({share})"
    return f"| {prey} | {detector} | {count} | {took} |"
