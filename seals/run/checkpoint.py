"""Checkpoints of a run on disk, from which an interrupted run resumes.

A checkpoint holds everything that changes: the world's snapshot, the ledgers and the rows recorded
so far, as arrays and JSON (`seals.state_file`), and the rigid-body scene in the engine's own
format.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

from seals.backend import Storing
from seals.errors import ConfigError, DiskFull
from seals.logs.room import room
from seals.run.recorder import Moment, Recorder
from seals.run.settings import RunSettings
from seals.state_file import MOST_BYTES, open_regular, read_state, write_state
from seals.state_tree import checked_generator, conform, packed
from seals.world import World

FOLDER = "checkpoint"
"""Folder of a run that holds its last checkpoint."""
STATE, SCENE = "state.bin", "scene.bin"
OLD = "state.pkl"
"""State as it was written before, a pickle; it is refused."""
KIND = "run"
MOST_SCENE = 1 << 26
"""Largest scene in the engine's own format [byte]."""
MINUTE = 60.0
"""Wall time between two checkpoints of a run with a fluid, unless it says otherwise [s]."""


class Checkpoints(Recorder):
    """Periodic checkpoints in a run's folder.

    Args:
        folder: of the run.
        every: wall time between two [s]; 0 for none.
    """

    sparse: ClassVar[bool] = True

    def __init__(self, folder: Path, every: float) -> None:
        self.folder, self.every = folder / FOLDER, every
        self._last, self._full = time.perf_counter(), False

    def record(self, moment: Moment) -> None:
        """Write a checkpoint when one is due."""
        now = time.perf_counter()
        if self.every > 0.0 and now - self._last >= self.every:
            world = moment.world
            try:
                write_checkpoint(self.folder, world, moment.snapshot())
                self._full = False
            except DiskFull as full:
                # the run itself needs no room until its end: there may be some by then
                text = " ".join(str(full).split())
                if not self._full:
                    print(f"note: no checkpoint at {world.time:.4g} s: {text}", file=sys.stderr)
                self._full = True
            self._last = time.perf_counter()

    def clear(self) -> None:
        """Remove the last checkpoint, after the run is complete."""
        remove_checkpoint(self.folder.parent)


def interval_of(settings: RunSettings) -> float:
    """Return the wall time between two checkpoints of a run; 0 for none [s].

    Raises:
        ConfigError: they are asked for and the backend cannot be saved.
    """
    storing = isinstance(settings.backend, Storing)
    if settings.checkpoint is None:
        return MINUTE if storing and settings.fluid is not None else 0.0
    if settings.checkpoint > 0.0 and not storing:
        raise ConfigError(
            f"checkpoint={settings.checkpoint:g}: backend '{type(settings.backend).__name__}' "
            "cannot be saved.\nRun without checkpoints: checkpoint=0"
        )
    return settings.checkpoint


def write_checkpoint(folder: Path, world: World, books: Any) -> None:
    """Write the state of a run atomically, replacing an earlier one.

    At every moment a whole one stands at ``folder``, or the one before it stands beside.

    Args:
        folder: of the checkpoint.
        world: after a step.
        books: what was recorded so far: arrays, numbers, text, containers and registered records.

    Raises:
        ConfigError: a part of the run cannot be saved.
        DiskFull: there is no room; the earlier one stands.
    """
    beside = folder.with_name(f".{folder.name}.new")
    shutil.rmtree(beside, ignore_errors=True)
    try:
        with room(folder):
            beside.mkdir(parents=True)
            _write(beside, world, books)
            # replace the last checkpoint by a complete new one, by renaming
            before = _before(folder)
            if folder.exists():
                shutil.rmtree(before, ignore_errors=True)
                folder.rename(before)
            beside.rename(folder)
            shutil.rmtree(before, ignore_errors=True)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _write(beside: Path, world: World, books: Any) -> None:
    backend: Any = world.backend
    snapshot = world.snapshot()._replace(scene=backend.store(beside / SCENE))
    ledgers = {
        name: (actor.ledger.time, actor.ledger.wrenches) for name, actor in world.actors.items()
    }
    state = {
        "world": _description(world),
        "scene": _digest((beside / SCENE).read_bytes()),
        "snapshot": snapshot,
        "ledgers": ledgers,
        "books": books,
    }
    try:
        write_state(beside / STATE, KIND, state)
    except TypeError as cause:
        raise ConfigError(
            f"the state of this run cannot be saved: {cause}.\n"
            "Run without checkpoints: checkpoint=0"
        ) from cause
    descriptor = os.open(beside / SCENE, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _before(folder: Path) -> Path:
    return folder.with_name(f".{folder.name}.before")


def take_up(kept: Path, world: World, *, most: int = MOST_BYTES) -> Any:
    """Restore a world from a checkpoint.

    Args:
        kept: folder of the checkpoint.
        world: built from the same settings.
        most: largest state that such a run can have [byte].

    Returns:
        The books as they were given to `write_checkpoint`.

    Raises:
        ConfigError: the checkpoint is damaged, of another version, or of another run.
    """
    with refusals(kept):
        if kept.is_symlink():
            raise ValueError("it is a link")
        state = read_state(kept / STATE, KIND, most=most)
        if not isinstance(state, dict) or set(state) != _ENTRIES:
            raise ValueError("its state has different entries")
        _refuse_other_world(state["world"], world)
        _restore(state, _scene(kept / SCENE, state["scene"]), world)
        return state["books"]


def largest_state(world: World, books: Any, rows: int) -> int:
    """Return the largest state that a run can have [byte]."""
    now, own = (packed(state)[1] for state in (world.snapshot()._replace(scene=None), books))
    row = sum(array.nbytes for array in own) + _A_PICTURE
    for actor in world.actors.values():
        row += 8 + 48 * len(actor.ledger.effects) * len(actor.ledger.links)
    return _ROOM + 4 * sum(array.nbytes for array in now) + rows * row


_ROOM = 1 << 26
_A_PICTURE = 256
_ENTRIES = {"world", "scene", "snapshot", "ledgers", "books"}


@contextlib.contextmanager
def refusals(kept: Path) -> Iterator[None]:
    """Convert every error of the block to an error about the checkpoint.

    Raises:
        ConfigError: there was one.
    """
    try:
        yield
    except Exception as cause:  # parts restore themselves, and say in their own ways what is amiss
        text = " ".join(str(cause).split()) or type(cause).__name__
        raise ConfigError(
            f"the checkpoint in {kept} cannot be resumed: {text}.\n"
            "It belongs to the run and version that wrote it; run it again: "
            "repeat=FOLDER"
        ) from cause


def _restore(state: dict[str, Any], scene: bytes, world: World) -> None:
    """Restore a world from a state of the same structure."""
    snapshot, backend = state["snapshot"], world.backend
    assert isinstance(backend, Storing)
    with tempfile.TemporaryDirectory(prefix="seals_scene_") as beside:
        like = world.snapshot()._replace(scene=backend.store(Path(beside) / "now.bin"))
        conform(snapshot, like)
        if snapshot.time != snapshot.steps * world.step_size or snapshot.steps < 0:
            raise ValueError(f"{snapshot.steps} steps do not end at {snapshot.time:g} s")
        random = {name: checked_generator(own) for name, own in snapshot.random.items()}
        # the engine opens it by its name: a copy that nobody else can write to
        (Path(beside) / SCENE).write_bytes(scene)
        recalled = backend.recall(Path(beside) / SCENE, snapshot.scene)
    world.restore(snapshot._replace(scene=recalled, random=random))
    for name, actor in world.actors.items():
        times, wrenches = state["ledgers"][name]
        actor.ledger.load(times, wrenches)


def _description(world: World) -> dict[str, Any]:
    """Return the properties that a world must share with that of a checkpoint."""
    actors = {
        name: [len(actor.robot.links), actor.robot.tree.joints, list(actor.effects.names)]
        for name, actor in world.actors.items()
    }
    parts = {"backend": world.backend, "fluid": world.fluid}
    kinds = {name: type(part).__qualname__ for name, part in parts.items()}
    return {"actors": actors, "step": world.step_size, **kinds}


def _refuse_other_world(kept: Any, world: World) -> None:
    own = _description(world)
    if kept == own:
        return
    named = kept if isinstance(kept, dict) else {}
    name = next((name for name in own if named.get(name) != own[name]), "entries")
    raise ValueError(
        f"its world has {name} {str(named.get(name))[:120]}, this one {str(own.get(name))[:120]}"
    )


def _scene(path: Path, digest: Any) -> bytes:
    """Return the engine's own file if its digest is that of the state."""
    with open_regular(path) as file:
        content = file.read(MOST_SCENE + 1)
    if len(content) > MOST_SCENE:
        raise ValueError(f"{path.name} has more than {MOST_SCENE:,} bytes")
    if _digest(content) != digest:
        raise ValueError(f"{path.name} is truncated or damaged, or belongs to another state")
    return content


def _digest(content: bytes) -> str:
    return hashlib.blake2b(content, digest_size=32).hexdigest()


def checkpoint_of(run: Path) -> Path:
    """Return the folder of a run's last checkpoint.

    Raises:
        ConfigError: there is none.
    """
    folder = _last(run)
    if (folder / STATE).is_file():
        return folder
    if (folder / OLD).exists():
        raise ConfigError(
            f"resume={run}: the checkpoint in this folder is a pickle, as written by earlier "
            "versions "
            "of SEALS; such a file could run commands, so it is not read.\n"
            "Run it again: repeat=FOLDER"
        )
    raise ConfigError(
        f"resume={run}: there is no checkpoint in this folder; a completed run has no "
        "checkpoint.\nStart again with repeat=FOLDER, and save checkpoints: checkpoint=60"
    )


def has_checkpoint(run: Path) -> bool:
    """Return whether a run can be resumed."""
    return (_last(run) / STATE).is_file()


def remove_checkpoint(run: Path) -> None:
    """Remove the checkpoint of a run that is complete or restarted."""
    folder, before = run / FOLDER, _before(run / FOLDER)
    shutil.rmtree(before, ignore_errors=True)
    if folder.is_dir() and not folder.is_symlink():
        # a kill leaves no half of it under its name
        folder.rename(before)
    shutil.rmtree(before, ignore_errors=True)


def _last(run: Path) -> Path:
    whole = run / FOLDER
    # cut off between two renames, the one before stands beside
    return whole if whole.exists() else _before(whole)
