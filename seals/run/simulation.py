"""Simulation loop of one run, with results kept however it ends."""

from __future__ import annotations

import enum
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError, SealsError
from seals.logs import Log
from seals.robot.model import RobotModel
from seals.run.assembly import ROBOT, build_world, step_count
from seals.run.checkpoint import largest_state, refusals, take_up
from seals.run.fluid_book import FluidBook
from seals.run.metadata import describe_run
from seals.run.object_recorder import ObjectRecorder, describe_objects
from seals.run.pictures import Pictures
from seals.run.pilot_recorders import Aims, Commands, Contacts, Stages
from seals.run.progress import progress
from seals.run.recorder import Moment, Recorder, row_count
from seals.run.robot_recorder import RobotRecorder
from seals.run.settings import RunSettings
from seals.run.stopping import stoppable
from seals.world import Ledger, World

MOST_STEPS = 20_000_000
"""Longest run in steps: beyond it a log no longer fits into an ordinary memory."""
MANY = 1000
"""Steps that a run makes at once at most: it looks at the clock and at interruptions after them."""


class Ending(enum.Enum):
    """State in which a run ended."""

    done = "done"
    interrupted = "interrupted"
    failed = "failed"


@dataclass(frozen=True, kw_only=True, eq=False)
class Record:
    """Result of a run: log, ledger, ending.

    Args:
        log: in the native format.
        ledger: wrench of every effect at every step.
        robot: as simulated.
        objects: ledgers of the objects by name.
        stages: of the guide, and how it ended.
        fluid: what the fluid said of itself, one value a row of the log; empty without one.
        ending: how it ended.
        error: what stopped it, None when it is done.
        steps: steps that were completed.
        seconds: wall time of the steps [s].
    """

    log: Log
    ledger: Ledger
    robot: RobotModel
    objects: Mapping[str, Ledger]
    stages: Stages
    fluid: Mapping[str, Floats]
    ending: Ending
    error: BaseException | None
    steps: int
    seconds: float

    @property
    def rate(self) -> float:
        """Steps per second of wall time."""
        return self.steps / max(self.seconds, 1e-9)


def simulate(
    settings: RunSettings,
    *,
    label: str = "simulating",
    started: Callable[[], None] | None = None,
    recorders: Sequence[Recorder] = (),
    kept: Path | None = None,
    folder: Path | None = None,
) -> Record:
    """Simulate a run from start to end, or until its guide is done or gives up.

    An interruption, or an error while stepping, ends the run early; the record holds it and all
    rows up to it.

    Args:
        settings: of the run.
        label: words beside the progress bar.
        started: called when the world stands and before the first step.
        recorders: called after every step, beside those of the log.
        kept: folder of a checkpoint of the same run, to go on from.
        folder: of the run, for recorders that write files; None writes none.

    Raises:
        SealsError: the run cannot start.
    """
    steps = step_count(settings)
    if steps > MOST_STEPS:
        raise ConfigError(
            f"time.duration={settings.time.duration:g} at time.step={settings.time.step:g} makes "
            f"{steps:,} steps.\n"
            f"Allowed: up to {MOST_STEPS:,} steps in one run; take a longer step or several runs."
        )
    with stoppable():
        world = build_world(settings)
        try:
            books = _books(settings, world, steps)
            if kept is not None:
                _take_up(kept, world, books, steps, recorders)
            for recorder in (*books, *recorders):
                recorder.start(world, folder)
            stepping = _Stepping(world, books, steps, label, tuple(recorders), kept)
            return _stepped(settings, stepping, started)
        finally:
            world.close()


class _Books(NamedTuple):
    """Recorders of the log of a run; checkpoints keep them under these names."""

    recorder: RobotRecorder
    objects: ObjectRecorder
    stages: Stages
    aims: Aims
    commands: Commands
    contacts: Contacts
    fluid: FluidBook
    pictures: Pictures

    def record(self, world: World) -> Moment:
        """Record the present row."""
        past = world.actors[ROBOT].history
        before = float(self.recorder.time[-1]) if self.recorder.rows else world.time
        row = self.recorder.rows
        if past is not None:
            row, before = row + len(past.times), past.times[-1]
        moment = Moment(world, row, before, self.snapshot, past)
        for book in self:
            book.record(moment)
        return moment

    def snapshot(self) -> dict[str, Any]:
        """Return all rows so far."""
        return {name: book.snapshot() for name, book in self._asdict().items()}

    def restore(self, kept: Mapping[str, Any], folder: Path) -> None:
        """Continue after the rows of a snapshot.

        Args:
            kept: the snapshot.
            folder: of the run that it was taken in.

        Raises:
            ValueError: it is of another run.
        """
        rows = row_count(kept["recorder"]["rows"], self.recorder.most)
        for name, book in self._asdict().items():
            book.restore(kept[name], rows, folder)


def _books(settings: RunSettings, world: World, steps: int) -> _Books:
    """Create the recorders with the initial row."""
    actor = world.actors[ROBOT]
    recorder = RobotRecorder(
        actor,
        steps=steps,
        gravity=settings.environment.gravity,
        water_level=settings.environment.water_level,
    )
    things = {name: other for name, other in world.actors.items() if name != ROBOT}
    books = _Books(
        recorder,
        ObjectRecorder(things, steps=steps),
        Stages(actor.pilot),
        Aims(actor.pilot, steps=steps),
        Commands(actor, steps=steps),
        Contacts(actor),
        FluidBook(world.fluid),
        Pictures(actor),
    )
    books.record(world)
    return books


def _take_up(
    kept: Path, world: World, books: _Books, steps: int, recorders: Sequence[Recorder]
) -> None:
    """Restore a world and its recorders from a checkpoint."""
    state = take_up(kept, world, most=largest_state(world, books.snapshot(), steps + 1))
    with refusals(kept):
        books.restore(state, kept.parent)
        for recorder in recorders:
            recorder.restore(None, books.recorder.rows, kept.parent)


class _Stepping(NamedTuple):
    """Run that is ready to be stepped."""

    world: World
    books: _Books
    steps: int
    label: str
    recorders: tuple[Recorder, ...]
    kept: Path | None


def _stepped(settings: RunSettings, run: _Stepping, started: Callable[[], None] | None) -> Record:
    """Take all steps, until the end or an interruption."""
    actor, books = run.world.actors[ROBOT], run.books
    recorder, objects, stages = books[:3]
    if started is not None:
        started()
    start = time.perf_counter()
    ending, error = _until_over(run)
    seconds = time.perf_counter() - start
    if ending is not Ending.done:
        # a step that failed has its row in the ledger; steps made at once have more
        rows = recorder.rows - (ending is Ending.interrupted)
        for ledger in (actor.ledger, *objects.ledgers.values()):
            ledger.rewind(rows)
    for book in (*books, *run.recorders):
        book.close()
    log = _log(settings, actor.robot, books)
    log.meta.update(stages.described() | books.contacts.described())
    return Record(
        log=log,
        ledger=actor.ledger,
        robot=actor.robot,
        objects=objects.ledgers,
        stages=stages,
        fluid=books.fluid.columns(recorder.rows),
        ending=ending,
        error=error,
        steps=recorder.rows - 1,
        seconds=seconds,
    )


def _until_over(run: _Stepping) -> tuple[Ending, BaseException | None]:
    """Step until the end, an interruption or an error."""
    world, books, steps, label, recorders, kept = run
    most = MANY if all(recorder.sparse for recorder in recorders) else 1
    try:
        with progress(label, steps, books.fluid.note) as tell:
            done = books.recorder.rows - 1
            while done < steps:
                done += world.stride(min(steps - done, most))
                moment = books.record(world)
                tell(done)
                if books.stages.outcome is not None:
                    break
                for recorder in recorders:
                    recorder.record(moment)
    except KeyboardInterrupt as stop:
        return Ending.interrupted, stop
    except (
        Exception
    ) as fault:  # whatever it is, the rows before it are worth keeping; it is raised later
        return Ending.failed, fault if kept is None else _blamed(kept, fault)
    return Ending.done, None


def _blamed(kept: Path, fault: Exception) -> Exception:
    """Return an error in a resumed run as one about its checkpoint, which may be damaged."""
    if isinstance(fault, SealsError):
        return fault
    text = " ".join(str(fault).split())[:300]
    refusal = ConfigError(
        f"the run continued from {kept} failed: {type(fault).__name__}: {text}.\n"
        "Its checkpoint may be damaged or forged; run it again: repeat=FOLDER"
    )
    refusal.__cause__ = fault
    return refusal


def _log(settings: RunSettings, robot: RobotModel, books: _Books) -> Log:
    recorder, objects = books.recorder, books.objects
    first: dict[str, Floats] = {
        name: values[0] for name, values in recorder.truth.items() if np.all(np.isfinite(values[0]))
    }
    wanted = ("position", "orientation", "velocity", "angular_velocity", "joint_position")
    initial = {name: first[name] for name in wanted if name in first}
    pilot = recorder.actor.pilot
    layout = None if pilot is None else pilot.plant.layout
    meta: dict[str, Any] = describe_run(settings, robot, layout, recorder.sources(), initial)
    if objects.actors:
        meta["objects"] = describe_objects(settings, objects.actors)
    columns = recorder.columns() | objects.columns(recorder.rows)
    columns |= books.aims.columns(recorder.rows) | books.commands.columns(recorder.rows)
    return Log(name=settings.name, columns=columns, meta=meta, source="simulated by SEALS")
