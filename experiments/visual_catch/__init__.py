"""A detector of the crab in RGB-D pictures: recorded, trained, measured; see README.md."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from seals.errors import ConfigError, suggestion
from seals.experiments.command import CommandParser
from seals.experiments.visual_catch.accuracy import accuracy, report
from seals.experiments.visual_catch.pictures import load_pictures, record
from seals.experiments.visual_catch.strip import show
from seals.experiments.visual_catch.training import Course, train

STEPS = ("record", "train", "measure", "show")


def main(words: Sequence[str] | None = None) -> int:
    """Run one step: ``record`` pictures, ``train`` a detector, ``measure`` it, ``show`` a flight.

    Raises:
        ConfigError: there is no such step.
    """
    parser = CommandParser(prog="visual_catch", description=__doc__)
    parser.add_argument("step", help=", ".join(STEPS))
    parser.add_argument("--out", type=Path, required=True, help="folder; of show: a picture")
    parser.add_argument("--pictures", type=Path, help="folder that record wrote")
    parser.add_argument("--detector", default="", help="of measure: folder that train wrote")
    parser.add_argument("--flights", type=int, default=300)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--held-out", action="store_true", help="of record: flights that judge")
    parser.add_argument("--limit", type=float, default=1e9, help="begin no flight after so many s")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--updates", type=int, default=Course.updates)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("more", nargs="*", help="of show: words of the environment, as env=...")
    given = parser.parse_intermixed_args(words)
    if given.step not in STEPS:
        raise ConfigError(f"there is no step '{given.step}'.\n{suggestion(given.step, STEPS)}")
    if given.step == "record":
        count = record(
            given.out,
            flights=given.flights,
            processes=given.processes,
            held_out=given.held_out,
            limit=given.limit,
        )
        print(f"{given.out}: {count} pictures")
        return 0
    if given.step == "show":
        print(show(given.more, given.out))
        return 0
    if given.pictures is None:
        raise ConfigError("--pictures is not given.\nGive the folder that record wrote.")
    pictures = load_pictures(given.pictures)
    if given.step == "train":
        course = Course(seed=given.seed, updates=given.updates, device=given.device)
        print(train(pictures, given.out, course))
        return 0
    report(accuracy(pictures, given.detector), given.out)
    return 0
