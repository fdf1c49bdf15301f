"""Comparison of learners on a reaching task, with and without demonstrations; see README.md."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from seals.experiments.command import CommandParser, whole
from seals.experiments.learning_study.arms import ARMS, MOST_SEEDS, trainings
from seals.experiments.learning_study.looks import keep, restore
from seals.experiments.learning_study.running import add_processes, compare, record, run_all
from seals.learn.learner import MOST


def main(words: Sequence[str] | None = None) -> int:
    """Train every arm with every seed, resuming an interrupted call; compare them."""
    parser = CommandParser(prog="learning_study", description=__doc__)
    parser.add_argument("--out", default="runs/learning_study", help="folder of the study")
    add_processes(parser, at_once=2)
    steps = "control steps of a training"
    parser.add_argument("--steps", type=whole(1, MOST), default=50_000, help=steps)
    parser.add_argument("--arms", nargs="+", default=sorted(ARMS), help="arms to train")
    seeds = "seeds of each arm; 0: as declared"
    parser.add_argument("--seeds", type=whole(0, MOST_SEEDS), default=0, help=seeds)
    parser.add_argument("--looks", type=Path, help="table of a study: compare it, train nothing")
    given = parser.parse_args(words)
    out = Path(given.out)
    if given.looks:
        return compare(restore(given.looks, out))
    # beside the study, which holds arms alone
    shown = record(out.with_name(f"{out.name}_demonstrations"))
    jobs = trainings(out, shown, arms=given.arms, steps=given.steps, seeds=given.seeds)
    left = run_all(jobs, at_once=given.jobs, limit=given.limit)
    if left:
        print(f"{left} of {len(jobs)} trainings are not finished: the same command goes on.")
        return 1
    print(keep(out))
    return compare(out)
