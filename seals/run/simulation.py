"""Steps a world through one run, and keeps what was seen whatever ends it."""

from __future__ import annotations

import enum
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.config.run import RunSettings
from seals.errors import ConfigError
from seals.logs import Log
from seals.robot.model import RobotModel
from seals.run.assembly import ROBOT, build_world, step_count
from seals.run.description import describe_run
from seals.run.progress import progress
from seals.run.recorder import Recorder
from seals.world import Ledger, World

MOST_STEPS = 20_000_000
"""Longest run in steps: beyond it a log no longer fits into an ordinary memory."""


class Ending(enum.Enum):
    """How a run ended."""

    done = "done"
    interrupted = "interrupted"
    failed = "failed"


@dataclass(frozen=True, kw_only=True, eq=False)
class Record:
    """What a run left behind.

    Args:
        log: in the native format.
        ledger: wrench of every effect at every step.
        robot: as simulated.
        ending: how it ended.
        error: what stopped it, None when it is done.
        steps: steps that were completed.
        seconds: wall time of the steps [s].
    """

    log: Log
    ledger: Ledger
    robot: RobotModel
    ending: Ending
    error: BaseException | None
    steps: int
    seconds: float

    @property
    def rate(self) -> float:
        """Steps a second."""
        return self.steps / max(self.seconds, 1e-9)


def simulate(
    settings: RunSettings, *, label: str = "simulating", started: Callable[[], None] | None = None
) -> Record:
    """Simulate a run from start to end.

    An interruption, or an error while stepping, ends the run early; the record holds it and all
    rows up to it.

    Args:
        settings: of the run.
        label: words beside the progress bar.
        started: called when the world stands and before the first step.

    Raises:
        SealsError: the run cannot start.
    """
    steps = step_count(settings)
    _refuse_endless(settings, steps)
    with _stoppable():
        world = build_world(settings)
        try:
            if started is not None:
                started()
            return _stepped(settings, world, steps, label)
        finally:
            world.close()


def _stepped(settings: RunSettings, world: World, steps: int, label: str) -> Record:
    """Take all steps, or as many as go."""
    actor = world.actors[ROBOT]
    recorder = Recorder(
        actor,
        steps=steps,
        gravity=settings.environment.gravity,
        water_level=settings.environment.water_level,
    )
    recorder.take(world.time)
    ending = Ending.done
    error: BaseException | None = None
    start = time.perf_counter()
    try:
        with progress(label, steps) as tell:
            for done in range(1, steps + 1):
                world.step()
                recorder.take(world.time)
                tell(done)
    except KeyboardInterrupt as stop:
        ending, error = Ending.interrupted, stop
        actor.ledger.rewind(recorder.rows - 1)
    except (
        Exception
    ) as fault:  # whatever it is, the rows before it are worth keeping; it is raised later
        ending, error = Ending.failed, fault
    seconds = time.perf_counter() - start
    log = _log(settings, actor.robot, recorder)
    return Record(
        log=log,
        ledger=actor.ledger,
        robot=actor.robot,
        ending=ending,
        error=error,
        steps=recorder.rows - 1,
        seconds=seconds,
    )


def _log(settings: RunSettings, robot: RobotModel, recorder: Recorder) -> Log:
    first: dict[str, Floats] = {
        name: values[0] for name, values in recorder.truth.items() if np.all(np.isfinite(values[0]))
    }
    wanted = ("position", "orientation", "velocity", "angular_velocity", "joint_position")
    initial = {name: first[name] for name in wanted if name in first}
    meta: dict[str, Any] = describe_run(settings, robot, recorder.sources(), initial)
    return Log(
        name=settings.name, columns=recorder.columns(), meta=meta, source="simulated by SEALS"
    )


def _refuse_endless(settings: RunSettings, steps: int) -> None:
    if steps > MOST_STEPS:
        raise ConfigError(
            f"time.duration={settings.time.duration:g} at time.step={settings.time.step:g} makes "
            f"{steps:,} steps.\n"
            f"Allowed: up to {MOST_STEPS:,} steps in one run; take a longer step or several runs."
        )


@contextmanager
def _stoppable() -> Iterator[None]:
    """Let a polite kill act like Ctrl-C, so that the log so far is kept."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, frame: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
