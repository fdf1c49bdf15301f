"""Lock and identity of a run folder, and reuse of a folder with an earlier run."""

from __future__ import annotations

import contextlib
import errno
import importlib.util
import json
import os
import platform
import re
import secrets
import shutil
import stat
import sys
import time
from collections.abc import Iterator, Mapping
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, LogError
from seals.file_names import DIAGNOSIS, REPORT
from seals.untrusted_io import plain_json, read_bytes

LOCK = ".run.lock"
"""File that a living run keeps locked; the system lets go of it however its process ends."""
RUN_ID = "run_id"
"""Key of the run's id in ``run.json``, and below ``simulated`` in ``meta.yaml``."""
FACTS, NOTES = "run.json", ".hydra"
"""What a run notes of itself, and the configuration that began it."""
ROBOT = "robot"
"""Folder of the robot as it was simulated, in a log folder."""
FLEET = "fleet"
"""Folder of a run with a log folder for each of its further robots, by name."""
MOVING = ".earlier.part"
"""Folder into which products are moved; it gets its name, ``earlier_N``, when all have arrived."""
PRODUCTS = (
    *("log.parquet", "log.csv", "meta.yaml", "vehicle.urdf", "ledger.parquet", "fluid.parquet"),
    *(REPORT, "report.json", "plots", "pictures", "surface", "particles", "keys.csv"),
    *("checkpoint", ".checkpoint.before", "checkpoint.bin", "checkpoint.pt"),
    *("training.csv", "evaluation.csv", "policy", "tensorboard", "wandb", "mlflow.db", "film.mp4"),
    *("demonstration", "render"),
    *("comparison.json", DIAGNOSIS, FLEET),
    *(FACTS, NOTES),
)
"""Names that runs and trainings write into their folder; ``run.json`` moves last but one."""
KEPT = re.compile(r"policy_\d+")
"""Names of the policies that a training keeps from each of its evaluations."""
_TRIES, _PAUSE = 20, 0.05
"""How often, and after which pause [s], a lock is tried that somebody else may only be looking at.
"""
_MOST_WORDS = 4096
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL)
_MOST_NOTE = 1 << 24
_ID_OF_LOG = re.compile(rb"^ +run_id: (r[0-9a-f]{16})\s*$", re.MULTILINE)
_ID_OF_RUN = re.compile(rb'^ "run_id": "(r[0-9a-f]{16})",?\s*$', re.MULTILINE)
_HELD: ContextVar[Mapping[str, int]] = ContextVar("run folders held", default={})  # noqa: B039


def log_folder(run: Path, robot: str) -> Path:
    """Return the folder of the log of a robot: that of the run for the one of ``robot=``."""
    return run if robot == ROBOT else run / FLEET / robot


def run_of(folder: Path) -> Path:
    """Return the folder of the run that a log folder belongs to, itself for most.

    Example:
        >>> run_of(Path("survey/fleet/scout")).as_posix()
        'survey'
    """
    inside = folder.parent.name == FLEET and not (folder / NOTES).exists()
    return folder.parent.parent if inside else folder


def new_id() -> str:
    """Return a unique id for a run."""
    # the letter in front keeps YAML from reading a number
    return f"r{secrets.token_hex(8)}"


@contextlib.contextmanager
def held(folder: Path) -> Iterator[bool]:
    """Hold the lock of a run folder; re-entrant within the same run.

    Args:
        folder: of the run; made when it does not exist.

    Yields:
        Whether the lock was not held before.

    Raises:
        ConfigError: another run that is alive holds it.
    """
    key = os.path.realpath(folder)
    if _HELD.get().get(key) == os.getpid():
        yield False
        return
    folder.mkdir(parents=True, exist_ok=True)
    for path in (folder / name for name in (*_names(folder), MOVING)):
        inside = os.scandir(path) if path.is_dir() and not path.is_symlink() else ()
        linked = [path] if path.is_symlink() else [one.path for one in inside if one.is_symlink()]
        if linked:
            raise ConfigError(
                f"{linked[0]} is a link that leads outside its run folder.\n"
                "Replace the link by its target, or choose another folder: out=FOLDER"
            )
    descriptor = _locked(folder)
    token = _HELD.set({**_HELD.get(), key: os.getpid()})
    try:
        _roll_back(folder)
        yield True
    finally:
        _HELD.reset(token)
        if descriptor is not None:
            # whoever waits for this very file finds it gone and takes the next one
            (folder / LOCK).unlink(missing_ok=True)
            os.close(descriptor)


def alive(folder: Path) -> bool | None:
    """Return whether a running process holds a folder; None where that is unknown."""
    try:
        import fcntl

        descriptor = open_own(folder / LOCK, os.O_RDONLY)
    except (OSError, ImportError, ConfigError):
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return None
    finally:
        os.close(descriptor)
    return False


def lockable() -> bool:
    """Return whether this system has locks that end with their process."""
    return importlib.util.find_spec("fcntl") is not None


def _locked(folder: Path) -> int | None:
    """Return the locked file; None if the system or the disk has no locks."""
    try:
        import fcntl
    except ImportError:
        return None
    path = folder / LOCK
    for _ in range(_TRIES):
        descriptor = open_own(path, os.O_RDWR | os.O_CREAT)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if path.exists() and os.path.samestat(os.fstat(descriptor), path.stat()):
                # write the owner into the lock file, for error messages only
                words = json.dumps(
                    {"pid": os.getpid(), "machine": platform.node(), "since": time.ctime()}
                )
                # on a full disk the lock holds without a word
                with contextlib.suppress(OSError):
                    os.ftruncate(descriptor, 0)
                    os.pwrite(descriptor, words.encode(), 0)
                return descriptor
        except OSError as error:
            if error.errno in _NO_LOCKS:
                os.close(descriptor)
                print(f"note: {folder} is on a disk without file locks: {error}", file=sys.stderr)
                return None
            if not isinstance(error, BlockingIOError):
                os.close(descriptor)
                raise
        os.close(descriptor)
        time.sleep(_PAUSE)
    raise ConfigError(
        f"{folder} is in use: {_holder(path)} writes into it.\n"
        "Wait until it ends, or choose another folder: out=FOLDER"
    )


def open_own(path: Path, flags: int) -> int:
    """Open a file of a run folder; links are not followed, pipes not waited for.

    Raises:
        ConfigError: it is a link, a folder, a pipe, a device, or known by a second name.
    """
    more = (getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC"))
    try:
        descriptor = os.open(path, flags | sum(more), 0o666)
    except OSError as error:
        if error.errno in (errno.ELOOP, errno.ENXIO, errno.EISDIR):
            raise _strange(path) from error
        raise
    found = os.fstat(descriptor)
    if not stat.S_ISREG(found.st_mode) or found.st_nlink > 1:
        os.close(descriptor)
        raise _strange(path)
    return descriptor


def _strange(path: Path) -> ConfigError:
    return ConfigError(f"{path} is not a regular file.\nRemove it, or choose another folder.")


def _holder(path: Path) -> str:
    try:
        descriptor = open_own(path, os.O_RDONLY)
        try:
            found = plain_json(os.read(descriptor, _MOST_WORDS))
        finally:
            os.close(descriptor)
        return f"process {found['pid']} on {found['machine']}, since {found['since']},"
    except (OSError, ValueError, KeyError, TypeError, ConfigError):
        return "another run"


class Claim:
    """Claim of a run folder by this process, from before the first write to the end.

    Attributes:
        earlier: folder that holds what an earlier run had left there, or None.
    """

    def __init__(self) -> None:
        self._held = contextlib.ExitStack()
        self._folder: Path | None = None
        self.earlier: Path | None = None

    def take(self, folder: Path, *, goes_on: bool, keep: bool = True) -> None:
        """Lock a folder until `close`.

        Args:
            folder: of the run.
            goes_on: whether the run takes up what lies there; otherwise that is moved aside.
            keep: whether the lock is kept; a run in a process of its own takes it itself.

        Raises:
            ConfigError: another run that is alive holds it.
        """
        self._held.enter_context(held(folder))
        self._folder = folder
        if not goes_on:
            self.earlier = set_aside(folder)
        if not keep:
            self._held.close()

    def give_back(self) -> None:
        """Restore a folder in which no run began."""
        earlier, folder, self.earlier = self.earlier, self._folder, None
        if earlier is None or folder is None:
            return
        # what is there before a run begins is Hydra's configuration alone
        if not any((folder / name).exists() for name in PRODUCTS if name != NOTES):
            bring_back(earlier)

    def close(self) -> None:
        """Release the lock."""
        if self.earlier is not None and self.earlier.is_dir():
            print(f"note: files of an earlier run were moved to {self.earlier}", file=sys.stderr)
        self._held.close()


def _names(folder: Path) -> tuple[str, ...]:
    """Return `PRODUCTS` behind the names of the policies that are kept in a folder."""
    own = folder.name == MOVING or (folder / "meta.yaml").exists()
    # without a log beside it, a folder of this name is the user's
    return (*sorted(path.name for path in folder.glob("policy_*") if KEPT.fullmatch(path.name)),
            *([ROBOT] if own else []), *PRODUCTS)  # fmt: skip


def set_aside(folder: Path, *, notes: bool = True) -> Path | None:
    """Move the files of an earlier run in a folder to its subfolder ``earlier_N``.

    A kill on the way is mended by whoever holds the folder next: what had been moved comes back.

    Args:
        folder: of a run; its lock is held.
        notes: whether the configuration is an earlier run's, too.

    Returns:
        The folder that holds it now; None where there was nothing.
    """
    names = _names(folder) if notes else _names(folder)[:-1]
    if not any((folder / name).exists() for name in names):
        return None
    moving = folder / MOVING
    moving.mkdir(exist_ok=True)
    _move(folder, moving, names)
    number = 1
    while (folder / f"earlier_{number}").exists():
        number += 1
    aside = folder / f"earlier_{number}"
    moving.rename(aside)
    return aside


def bring_back(aside: Path) -> None:
    """Undo `set_aside`, after a new run that never began."""
    folder = aside.parent
    clear(folder, notes=(aside / NOTES).exists())
    aside.rename(folder / MOVING)
    _roll_back(folder)


def clear(folder: Path, *, notes: bool = True) -> None:
    """Remove the files of a run from a folder, ``run.json`` first.

    Args:
        folder: of a run; its lock is held.
        notes: whether its configuration goes, too.
    """
    for name in reversed(_names(folder) if notes else _names(folder)[:-1]):
        path = folder / name
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def _roll_back(folder: Path) -> None:
    """Restore the files that a killed process had moved aside."""
    moving = folder / MOVING
    if not moving.is_dir():
        return
    names = reversed(_names(moving))
    _move(moving, folder, [name for name in names if not (folder / name).exists()])
    with contextlib.suppress(OSError):  # it stays where it holds more than products
        moving.rmdir()


def _move(source: Path, target: Path, names: Any) -> None:
    for name in names:
        with contextlib.suppress(FileNotFoundError):
            os.rename(source / name, target / name)


def refuse_cut_run(folder: Path) -> None:
    """Refuse the folder of a run that wrote no log; the one of an earlier run is another's.

    Args:
        folder: without a log of its own.

    Raises:
        LogError: a run was cut off there, or still goes on.
    """
    earlier = sorted(path.parent for path in folder.glob("earlier_*/meta.yaml"))
    begun = (FACTS, LOCK, *((NOTES,) if earlier else ()))
    if not any((folder / name).exists() for name in begun):
        return
    state = "still goes on" if alive(folder) else "was interrupted before it wrote one"
    other = f"; that of the run before it is in {earlier[-1]}" if earlier else ""
    raise LogError(
        f"'{folder}' holds no log: the run in it {state}{other}.\n"
        "Complete a run there, or give the folder of another log."
    )


def id_of_log(folder: Path) -> str | None:
    """Return the id of the run that wrote the log in a folder; None for a log without one."""
    return _found(folder / "meta.yaml", _ID_OF_LOG)


def foreign_log(folder: Path) -> str:
    """Return a remark where the log in a run folder belongs to another run, else an empty text.

    Raises:
        LogError: a file that names an id is too large to be one of a run.
    """
    own, logged = _found(folder / FACTS, _ID_OF_RUN), id_of_log(folder)
    if not own or not logged or own == logged:
        return ""
    return f"the log in {folder} is of run {logged}, its {FACTS} of run {own}"


def _found(path: Path, pattern: re.Pattern[bytes]) -> str | None:
    """Return an id by searching its line, a hundred times as fast as parsing the YAML."""
    if not path.is_file() or path.stat().st_size == 0:
        return None
    found = pattern.search(read_bytes(path, most=_MOST_NOTE))
    return None if found is None else found.group(1).decode()
