"""A detector of the crab in RGB-D pictures: recorded, trained, measured, judged; see README.md."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, refuse_unlisted
from seals.experiments.command import (
    CommandParser,
    checked_file,
    checked_folder,
    seconds,
    whole,
)
from seals.experiments.visual_catch.accuracy import accuracy, report
from seals.experiments.visual_catch.judged import HEAD, judge, lines
from seals.experiments.visual_catch.pictures import Pictures, load_pictures, record
from seals.experiments.visual_catch.strip import show
from seals.experiments.visual_catch.training import Course, train
from seals.learn.devices import usable_device
from seals.learn.metadata import refuse_other
from seals.plugins.tasks.catch_seen import DETECTOR
from seals.plugins.tasks.sighting.detector import FORM, load_detector

USED = {
    "record": ("flights", "processes", "held_out", "limit"),
    "train": ("pictures", "seed", "updates", "device"),
    "measure": ("pictures", "detector"),
    "judge": ("detector", "episodes", "processes", "limit"),
    "show": ("more",),
}
"""Options of each step beside ``--out``."""


def main(words: Sequence[str] | None = None) -> int:
    """Run one step: ``record``, ``train``, ``measure``, ``judge`` or ``show``.

    Raises:
        ConfigError: there is no such step, or it has no such option.
    """
    parser = _parser()
    given = parser.parse_intermixed_args(words)
    refuse_unlisted(given.step, STEPS, f"there is no step '{given.step}'")
    used = USED[given.step]
    for name, value in vars(given).items():
        if name not in ("step", "out", *used) and value != parser.get_default(name):
            asked = " ".join(value) if name == "more" else _flag(name)
            options = ", ".join(map(_flag, ("out", *used)))
            raise ConfigError(f"{asked} is not of {given.step}.\nOptions of it: {options}")
    given.detector = given.detector or [DETECTOR]
    STEPS[given.step](given)
    return 0


def _parser() -> CommandParser:
    name = "python -m seals.experiments.visual_catch"
    parser = CommandParser(prog=name, description=__doc__)
    parser.add_argument("step", help=", ".join(STEPS))
    parser.add_argument("--out", type=Path, required=True, help="folder; of judge, show: a file")
    parser.add_argument("--pictures", type=Path, help="folder that record wrote")
    parser.add_argument("--detector", action="append", default=[], help="folder that train wrote")
    parser.add_argument("--flights", type=whole(1, 100_000), default=300)
    parser.add_argument(
        "--episodes", type=whole(1, 100_000), default=100, help="of judge: starts of each case"
    )
    parser.add_argument("--processes", type=whole(1, 1000), default=2)
    parser.add_argument("--held-out", action="store_true", help="of record: flights that judge")
    parser.add_argument(
        "--limit", type=seconds, default=1e9, help="begin no flight after so many s"
    )
    parser.add_argument("--seed", type=whole(0, 2**31 - 1), default=0)
    parser.add_argument("--updates", type=whole(1, 10**7), default=Course.updates)
    parser.add_argument("--device", default="cpu")
    parser.add_argument(
        "more", nargs="*", default=[], help="of show: words of the environment, as env=..."
    )
    return parser


def _flag(name: str) -> str:
    return "KEY=VALUE" if name == "more" else f"--{name.replace('_', '-')}"


def _recorded(given: Any) -> None:
    work = {name: getattr(given, name) for name in ("flights", "processes", "held_out", "limit")}
    print(f"{given.out}: {record(checked_folder(given.out), **work)} pictures")


def _pictures(given: Any) -> Pictures:
    if given.pictures is None:
        raise ConfigError("--pictures is not given.\nGive the folder that record wrote.")
    return load_pictures(given.pictures)


def _trained(given: Any) -> None:
    refuse_other(checked_folder(given.out), form=FORM, key="task.detector")
    course = Course(seed=given.seed, updates=given.updates, device=usable_device(given.device))
    print(train(_pictures(given), given.out, course))


def _measured(given: Any) -> None:
    if len(given.detector) > 1:
        raise ConfigError("--detector is given more than once.\nMeasure one after the other.")
    folder = checked_folder(given.out)
    report(accuracy(_pictures(given), given.detector[0]), folder)


def _judged(given: Any) -> None:
    path = checked_file(given.out, (".parquet",))
    for name in given.detector:
        load_detector(name, animal="crab", stance=0.0)
    work = {name: getattr(given, name) for name in ("episodes", "processes", "limit")}
    judge(given.detector, path, **work)
    if not path.is_file():
        raise ConfigError(f"--limit {given.limit:g}: no episode ended.\nAllow more time.")
    print("\n".join((HEAD, *lines(path))))


def _shown(given: Any) -> None:
    print(show(given.more, checked_file(given.out, (".webp", ".png"))))


STEPS: dict[str, Callable[[Any], None]] = {
    "record": _recorded,
    "train": _trained,
    "measure": _measured,
    "judge": _judged,
    "show": _shown,
}
