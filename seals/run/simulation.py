"""Simulation loop of one run, with results kept however it ends."""

from __future__ import annotations

import enum
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError, SealsError
from seals.logs import Log
from seals.logs.run_folder import log_folder
from seals.robot.model import RobotModel
from seals.run.assembly import build_world, step_count
from seals.run.checkpoint import largest_state, refusals, take_up
from seals.run.fleet import ROBOT, fleet_of
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
    """Result of a run: log and ledger of one of its robots, ending.

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
        fleet: records of all robots of the run by name, this one's among them, in their order.
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
    fleet: dict[str, Record]

    @property
    def rate(self) -> float:
        """Steps per second of wall time."""
        return self.steps / max(self.seconds, 1e-9)

    def checked(self) -> Record:
        """Return the record of a run that was not stopped.

        Raises:
            BaseException: what stopped the run.
        """
        if self.error is not None:
            raise self.error
        return self


def simulate(
    settings: RunSettings,
    *,
    label: str = "simulating",
    started: Callable[[], None] | None = None,
    recorders: Sequence[Recorder] = (),
    kept: Path | None = None,
    folder: Path | None = None,
) -> Record:
    """Simulate a run from start to end, or until every guide is done or gives up.

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

    Returns:
        The record of the first robot, which holds those of the others.
    """
    steps, fleet = step_count(settings), fleet_of(settings)
    if steps * len(fleet) > MOST_STEPS:
        several = f" of {len(fleet)} robots" if len(fleet) > 1 else ""
        raise ConfigError(
            f"time.duration={settings.time.duration:g} at time.step={settings.time.step:g} makes "
            f"{steps:,} steps{several}.\n"
            f"Allowed: up to {MOST_STEPS:,} steps in one run; take a longer step or several runs."
        )
    with stoppable():
        world = build_world(settings)
        try:
            books = _Books(settings, world, fleet, steps)
            if kept is not None:
                state = take_up(kept, world, most=largest_state(world, books.snapshot(), steps + 1))
                with refusals(kept):
                    books.restore(state, kept.parent)
                    for one in recorders:
                        one.restore(None, books.first.rows, kept.parent)
            books.start(folder)
            for recorder in recorders:
                recorder.start(world, folder)
            stepping = _Stepping(world, books, steps, label, tuple(recorders), kept)
            return _stepped(fleet, stepping, started)
        finally:
            world.close()


class _Own(NamedTuple):
    """Recorders of the log of one robot."""

    recorder: RobotRecorder
    stages: Stages
    aims: Aims
    commands: Commands
    contacts: Contacts
    pictures: Pictures


class _Books:
    """Recorders of the logs of a run, with the initial row.

    Args:
        settings: of the run.
        world: at its start.
        fleet: settings of every robot.
        steps: of the run.

    Attributes:
        robots: recorders of every robot by name.
        objects: recorder of the objects.
        fluid: recorder of the fluid.
        first: recorder of the first robot, which counts the rows.
    """

    def __init__(
        self, settings: RunSettings, world: World, fleet: Mapping[str, RunSettings], steps: int
    ) -> None:
        e, self._world = settings.environment, world
        self.robots: dict[str, _Own] = {}
        for name in fleet:
            actor = world.actors[name]
            self.robots[name] = _Own(
                RobotRecorder(actor, steps=steps, gravity=e.gravity, water_level=e.water_level),
                Stages(actor.pilot),
                Aims(actor.pilot, steps=steps),
                Commands(actor, steps=steps),
                Contacts(actor),
                Pictures(actor),
            )
        things = {name: actor for name, actor in world.actors.items() if name not in fleet}
        self.objects, self.fluid = ObjectRecorder(things, steps=steps), FluidBook(world.fluid)
        self.first = next(iter(self.robots.values())).recorder
        self.record()

    def named(self) -> Iterator[tuple[str, str, Recorder]]:
        """Yield every recorder with its robot, `ROBOT` for none, and its key in checkpoints."""
        for name, own in self.robots.items():
            for key, book in own._asdict().items():
                yield name, f"{name}.{key}", book
        yield ROBOT, "objects", self.objects
        yield ROBOT, "fluid", self.fluid

    def start(self, folder: Path | None) -> None:
        """Write to the folder of a run from now on."""
        for name, _, book in self.named():
            book.start(self._world, None if folder is None else log_folder(folder, name))

    def record(self) -> Moment:
        """Record the present row."""
        world, row = self._world, self.first.rows
        past = self.first.actor.history
        before = float(self.first.time[-1]) if row else world.time
        if past is not None:
            row, before = row + len(past.times), past.times[-1]
        moment = Moment(world, row, before, self.snapshot, past)
        for own in self.robots.values():
            theirs = moment._replace(history=own.recorder.actor.history)
            for book in own:
                book.record(theirs)
        self.objects.record(moment)
        self.fluid.record(moment)
        return moment

    def snapshot(self) -> dict[str, Any]:
        """Return all rows so far."""
        return {key: book.snapshot() for _, key, book in self.named()}

    def restore(self, kept: Mapping[str, Any], folder: Path) -> None:
        """Continue after the rows of a snapshot.

        Args:
            kept: the snapshot.
            folder: of the run that it was taken in.

        Raises:
            ValueError: it is of another run.
        """
        first = next(iter(self.robots))
        rows = row_count(kept[f"{first}.recorder"]["rows"], self.first.most)
        for name, key, book in self.named():
            book.restore(kept[key], rows, log_folder(folder, name))

    @property
    def over(self) -> bool:
        """Whether every guide is done or gave up; false where there is none."""
        led = [own.stages for own in self.robots.values() if own.recorder.actor.pilot is not None]
        return bool(led) and all(stages.outcome is not None for stages in led)


class _Stepping(NamedTuple):
    """Run that is ready to be stepped."""

    world: World
    books: _Books
    steps: int
    label: str
    recorders: tuple[Recorder, ...]
    kept: Path | None


def _stepped(
    fleet: Mapping[str, RunSettings], run: _Stepping, started: Callable[[], None] | None
) -> Record:
    """Take all steps, until the end or an interruption."""
    books, rows = run.books, run.books.first
    if started is not None:
        started()
    start = time.perf_counter()
    ending, error = _until_over(run)
    seconds = time.perf_counter() - start
    if ending is not Ending.done:
        # a step that failed has its row in the ledger; steps made at once have more
        for actor in run.world.actors.values():
            actor.ledger.rewind(rows.rows - (ending is Ending.interrupted))
    for _, _, book in books.named():
        book.close()
    for recorder in run.recorders:
        recorder.close()
    records: dict[str, Record] = {}
    for name, settings in fleet.items():
        own, actor = books.robots[name], run.world.actors[name]
        records[name] = Record(
            log=_log(settings, actor.robot, own, books.objects),
            ledger=actor.ledger,
            robot=actor.robot,
            objects=books.objects.ledgers,
            stages=own.stages,
            fluid=books.fluid.columns(rows.rows),
            ending=ending,
            error=error,
            steps=rows.rows - 1,
            seconds=seconds,
            fleet=records,
        )
    return next(iter(records.values()))


def _until_over(run: _Stepping) -> tuple[Ending, BaseException | None]:
    """Step until the end, an interruption or an error."""
    world, books, steps, label, recorders, kept = run
    # the rows of objects are those of single steps
    several = len(world.actors) == len(books.robots) and all(r.sparse for r in recorders)
    most = MANY if several else 1
    try:
        with progress(label, steps, books.fluid.note) as tell:
            done = books.first.rows - 1
            while done < steps:
                done += world.stride(min(steps - done, most))
                moment = books.record()
                tell(done)
                if books.over:
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


def _log(settings: RunSettings, robot: RobotModel, own: _Own, objects: ObjectRecorder) -> Log:
    recorder = own.recorder
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
    meta |= own.stages.described() | own.contacts.described()
    columns = recorder.columns() | objects.columns(recorder.rows)
    columns |= own.aims.columns(recorder.rows) | own.commands.columns(recorder.rows)
    return Log(name=settings.name, columns=columns, meta=meta, source="simulated by SEALS")
