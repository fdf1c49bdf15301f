"""A detector of the crab in RGB-D pictures: recorded, trained, measured, judged; see README.md."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, suggestion
from seals.experiments.command import CommandParser
from seals.experiments.visual_catch.accuracy import accuracy, report
from seals.experiments.visual_catch.judged import HEAD, judge, lines
from seals.experiments.visual_catch.pictures import Pictures, load_pictures, record
from seals.experiments.visual_catch.strip import show
from seals.experiments.visual_catch.training import Course, train
from seals.plugins.tasks.catch_seen import DETECTOR


def main(words: Sequence[str] | None = None) -> int:
    """Run one step: ``record``, ``train``, ``measure``, ``judge`` or ``show``.

    Raises:
        ConfigError: there is no such step.
    """
    parser = CommandParser(prog="visual_catch", description=__doc__)
    parser.add_argument("step", help=", ".join(STEPS))
    parser.add_argument("--out", type=Path, required=True, help="folder; of judge, show: a file")
    parser.add_argument("--pictures", type=Path, help="folder that record wrote")
    parser.add_argument("--detector", action="append", default=[], help="folder that train wrote")
    parser.add_argument("--flights", type=int, default=300)
    parser.add_argument("--episodes", type=int, default=100, help="of judge: starts of each case")
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
    given.detector = given.detector or [DETECTOR]
    STEPS[given.step](given)
    return 0


def _recorded(given: Any) -> None:
    work = {name: getattr(given, name) for name in ("flights", "processes", "held_out", "limit")}
    print(f"{given.out}: {record(given.out, **work)} pictures")


def _pictures(given: Any) -> Pictures:
    if given.pictures is None:
        raise ConfigError("--pictures is not given.\nGive the folder that record wrote.")
    return load_pictures(given.pictures)


def _trained(given: Any) -> None:
    course = Course(seed=given.seed, updates=given.updates, device=given.device)
    print(train(_pictures(given), given.out, course))


def _measured(given: Any) -> None:
    report(accuracy(_pictures(given), given.detector[0]), given.out)


def _judged(given: Any) -> None:
    work = {name: getattr(given, name) for name in ("episodes", "processes", "limit")}
    judge(given.detector, given.out, **work)
    print("\n".join((HEAD, *lines(given.out))))


def _shown(given: Any) -> None:
    print(show(given.more, given.out))


STEPS: dict[str, Callable[[Any], None]] = {
    "record": _recorded,
    "train": _trained,
    "measure": _measured,
    "judge": _judged,
    "show": _shown,
}
