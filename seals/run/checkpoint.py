"""Keeps the state of a run on disk, so that one that was killed can be taken up where it was.

A checkpoint holds everything that changes: the world's snapshot, the rigid-body scene in the
engine's own format, the ledgers, and the rows recorded so far. It is a pickle that is read as data:
see `seals.run.unpickling`.
"""

from __future__ import annotations

import os
import pickle
import shutil
import sys
import time
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import Any

from seals.backend import Storing
from seals.errors import ConfigError, DiskFull
from seals.logs.room import room
from seals.run.settings import RunSettings
from seals.run.unpickling import DataUnpickler
from seals.world import World

FOLDER = "checkpoint"
"""Folder of a run that holds its last checkpoint."""
STATE, SCENE = "state.pkl", "scene.bin"
MINUTE = 60.0
"""Wall time between two checkpoints of a run with a fluid, unless it says otherwise [s]."""


class Checkpoints:
    """Writes a checkpoint into a run's folder every now and then.

    Args:
        folder: of the run.
        every: wall time between two [s]; 0 for none.
    """

    def __init__(self, folder: Path, every: float) -> None:
        """Start the clock."""
        self.folder, self.every = folder / FOLDER, every
        self._last = time.perf_counter()

    def tick(self, world: World, books: Any) -> None:
        """Write one when it is time.

        Args:
            world: after a step whose rows are recorded.
            books: everything recorded so far.
        """
        now = time.perf_counter()
        if self.every > 0.0 and now - self._last >= self.every:
            try:
                write_checkpoint(self.folder, world, books)
            except DiskFull as full:
                # the run itself needs no room until its end: there may be some by then
                text = " ".join(str(full).split())
                print(f"note: no checkpoint at {world.time:.4g} s: {text}", file=sys.stderr)
            self._last = time.perf_counter()

    def clear(self) -> None:
        """Remove the last one: the run is complete."""
        remove_checkpoint(self.folder.parent)


def interval_of(settings: RunSettings) -> float:
    """Return the wall time between two checkpoints of a run; 0 for none [s].

    Raises:
        ConfigError: they are asked for and the backend cannot be kept on disk.
    """
    storing = isinstance(settings.backend, Storing)
    if settings.checkpoint is None:
        return MINUTE if storing and settings.fluid is not None else 0.0
    if settings.checkpoint > 0.0 and not storing:
        raise ConfigError(
            f"checkpoint={settings.checkpoint:g}: backend '{type(settings.backend).__name__}' "
            "cannot be kept on disk.\nRun without checkpoints: checkpoint=0"
        )
    return settings.checkpoint


def write_checkpoint(folder: Path, world: World, books: Any) -> None:
    """Write the state of a run, whole or not at all; an earlier one gives way.

    At every moment a whole one stands at ``folder``, or the one before it stands beside.

    Raises:
        ConfigError: a part of the run cannot be kept on disk.
        DiskFull: there is no room; the earlier one stands.
    """
    beside = folder.with_name(f".{folder.name}.new")
    shutil.rmtree(beside, ignore_errors=True)
    try:
        with room(folder):
            beside.mkdir(parents=True)
            _write(beside, world, books)
            _take_place(beside, folder)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _write(beside: Path, world: World, books: Any) -> None:
    backend: Any = world.backend
    snapshot = world.snapshot()._replace(scene=backend.store(beside / SCENE))
    ledgers = {
        name: (actor.ledger.time.copy(), actor.ledger.wrenches.copy())
        for name, actor in world.actors.items()
    }
    state = {"snapshot": snapshot, "ledgers": ledgers, "books": books}
    with (beside / STATE).open("wb") as file:
        try:
            _Pickler(file, _live(world)).dump(state)
        except (pickle.PicklingError, TypeError, AttributeError) as cause:
            raise ConfigError(
                f"the state of this run cannot be kept on disk: {' '.join(str(cause).split())}.\n"
                "Run without checkpoints: checkpoint=0"
            ) from cause
    for name in (STATE, SCENE):
        descriptor = os.open(beside / name, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _take_place(beside: Path, folder: Path) -> None:
    """Put a whole checkpoint in the place of the last one, which steps aside by a rename."""
    before = _before(folder)
    if folder.exists():
        shutil.rmtree(before, ignore_errors=True)
        folder.rename(before)
    beside.rename(folder)
    shutil.rmtree(before, ignore_errors=True)


def _before(folder: Path) -> Path:
    return folder.with_name(f".{folder.name}.before")


def take_up(kept: Path, world: World) -> Any:
    """Put a world into the state of a checkpoint.

    Args:
        kept: folder of the checkpoint.
        world: built from the same settings.

    Returns:
        The books, which go on in this world.

    Raises:
        ConfigError: the checkpoint is damaged, or of another version.
    """
    try:
        state = _Unpickler(BytesIO((kept / STATE).read_bytes()), _live(world)).load()
        snapshot = state["snapshot"]
        backend: Any = world.backend
        scene = backend.recall(kept / SCENE, snapshot.scene)
        world.restore(snapshot._replace(scene=scene))
        for name, (times, wrenches) in state["ledgers"].items():
            world.actors[name].ledger.load(times, wrenches)
        return state["books"]
    except Exception as cause:  # a damaged pickle lets errors of every kind through
        text = " ".join(str(cause).split())
        raise ConfigError(
            f"the checkpoint in {kept} cannot be taken up: {text}.\n"
            "It belongs to the very version that wrote it; begin the run anew: repeat=FOLDER"
        ) from cause


def checkpoint_of(run: Path) -> Path:
    """Return the folder of a run's last checkpoint.

    Raises:
        ConfigError: there is none.
    """
    folder = _last(run)
    if (folder / STATE).is_file():
        return folder
    raise ConfigError(
        f"resume={run}: there is no checkpoint in this folder; a run that came to its end keeps "
        "none.\nBegin anew with repeat=FOLDER, and keep checkpoints: checkpoint=60"
    )


def has_checkpoint(run: Path) -> bool:
    """Return whether a run can be taken up."""
    return (_last(run) / STATE).is_file()


def remove_checkpoint(run: Path) -> None:
    """Remove whatever checkpoint there is: the run is complete, or begins anew."""
    shutil.rmtree(run / FOLDER, ignore_errors=True)
    shutil.rmtree(_before(run / FOLDER), ignore_errors=True)


def _last(run: Path) -> Path:
    whole = run / FOLDER
    # cut off between two renames, the one before stands beside
    return whole if whole.exists() else _before(whole)


def _live(world: World) -> Mapping[str, Any]:
    """Parts that belong to a process and are never written, by name."""
    live: dict[str, Any] = {"fluid": world.fluid} if world.fluid is not None else {}
    for name, actor in world.actors.items():
        live[f"actor {name}"] = actor
        if actor.pilot is not None:
            live[f"pilot {name}"] = actor.pilot
    return live


def _view(values: dict[str, Any]) -> Mapping[str, Any]:
    """A read-only view: its own class has no name to be found by."""
    return MappingProxyType(values)


class _Pickler(pickle.Pickler):
    """Writes names in place of live parts."""

    def __init__(self, file: Any, live: Mapping[str, Any]) -> None:
        super().__init__(file, protocol=pickle.HIGHEST_PROTOCOL)
        self._names = {id(part): name for name, part in live.items()}

    def persistent_id(self, obj: Any) -> str | None:
        return self._names.get(id(obj))

    def reducer_override(self, obj: Any) -> Any:
        # a read-only view of a mapping, such as that of an order to no joint
        if isinstance(obj, MappingProxyType):
            return _view, (dict(obj),)
        return NotImplemented


class _Unpickler(DataUnpickler):
    """Reads live parts by their names."""

    def __init__(self, file: Any, live: Mapping[str, Any]) -> None:
        super().__init__(file)
        self._live = live

    def persistent_load(self, name: str) -> Any:
        if name not in self._live:
            raise pickle.UnpicklingError(f"it speaks of '{name}', which this run does not have")
        return self._live[name]
