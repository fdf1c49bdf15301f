"""Job log of a sweep: one line per finished job, written by the job.

Jobs run in processes that know nothing of each other, on one machine or on many. Each claims its
number before it begins, so that none is done twice even when a sweep is taken up while a job of
the cut-off one still runs; a claim ends with the process that holds it, however it ends.
"""

from __future__ import annotations

import contextlib
import csv
import io
import os
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from seals.drawn_text import in_table
from seals.errors import ConfigError
from seals.logs.room import room
from seals.logs.run_folder import open_own
from seals.schema import read
from seals.untrusted_io import read_bytes

NOTE, TABLE, LOCK = "sweep.json", "jobs.csv", ".jobs.lock"
DONE, FAILED, REFUSED = "done", "failed", "refused"
COLUMNS = ("number", "state", "code", "seconds", "words", "message")
MOST = 1 << 28
"""Largest book that is read [bytes]."""


class Job(NamedTuple):
    """Entry of the job log: one finished job.

    Args:
        number: within the sweep, from 0 on.
        state: ``done``, ``failed``, or ``refused`` before anything was written.
        code: exit code of its verb.
        seconds: wall time [s].
        words: its overrides.
        message: why it failed, one line; empty when it is done.
    """

    number: int
    state: str
    code: int
    seconds: float
    words: tuple[str, ...]
    message: str = ""


def read_jobs(folder: Path) -> dict[int, Job]:
    """Return the last entry of every finished job, by number; empty without a job log.

    A line that was cut off in the middle counts as not written.

    Raises:
        ConfigError: the book is damaged.
    """
    path = folder / TABLE
    # a full disk, or a kill, may leave one without a single byte
    if not path.is_file() or path.stat().st_size == 0:
        return {}
    whole = read_bytes(path, most=MOST).rpartition(b"\n")[0].decode("utf-8", "replace")
    found = {}
    for line, row in enumerate(csv.DictReader(io.StringIO(whole)), start=2):
        try:
            words = shlex.split(row["words"])
            job = read(Job, {**row, "words": words}, where=f"line {line}:")
        except (ConfigError, AttributeError, KeyError, TypeError, ValueError) as cause:
            why = str(cause).partition("\n")[0]
            raise ConfigError(
                f"{path}, line {line}, is damaged: {why}.\n"
                "Remove that line: its job will be run again."
            ) from cause
        found[job.number] = job
    return found


class JobLock:
    """Exclusive lock of one job number.

    Args:
        folder: of the sweep.
        descriptor: of the lock file.
    """

    def __init__(self, folder: Path, descriptor: int) -> None:
        self._folder, self._descriptor = folder, descriptor

    def note(self, job: Job) -> None:
        """Append one line to the job log and flush it to disk.

        Raises:
            DiskFull: there is no room for it; the job counts as cut off.
        """
        path = self._folder / TABLE
        flags = os.O_RDWR | os.O_CREAT | os.O_APPEND
        with (
            _held(self._descriptor, 0),
            room(path),
            os.fdopen(open_own(path, flags), "a+b") as file,
        ):
            _forget_torn_line(file)
            text = io.StringIO()
            writer = csv.writer(text, lineterminator="\n")
            if file.tell() == 0:
                writer.writerow(COLUMNS)
            seconds, words = f"{job.seconds:.3f}", shlex.join(job.words)
            writer.writerow(
                (job.number, job.state, job.code, seconds, words, in_table(job.message))
            )
            file.write(text.getvalue().encode("utf-8"))
            file.flush()
            os.fsync(file.fileno())


@contextlib.contextmanager
def opened(folder: Path) -> Iterator[None]:
    """Lock the folder of a sweep while its owner is read and written."""
    with _locked(folder, 0):
        yield


@contextlib.contextmanager
def claimed(folder: Path, number: int) -> Iterator[JobLock]:
    """Lock the job of a number, waiting for other processes."""
    # byte 0 is the book's own
    with _locked(folder, number + 1) as descriptor:
        yield JobLock(folder, descriptor)


@contextlib.contextmanager
def _locked(folder: Path, place: int) -> Iterator[int]:
    """Lock one byte of a sweep's lock file; yield its descriptor."""
    folder.mkdir(parents=True, exist_ok=True)
    descriptor = open_own(folder / LOCK, os.O_RDWR | os.O_CREAT)
    try:
        with _held(descriptor, place):
            yield descriptor
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def _held(descriptor: int, place: int) -> Iterator[None]:
    """Lock one byte of a file against other processes, also those of other machines."""
    try:
        import fcntl
    except ImportError as cause:
        raise ConfigError(
            "a sweep needs file locks of POSIX, which this system does not have.\n"
            "Run it on Linux or macOS, or run its jobs one by one."
        ) from cause
    fcntl.lockf(descriptor, fcntl.LOCK_EX, 1, place)
    try:
        yield
    finally:
        fcntl.lockf(descriptor, fcntl.LOCK_UN, 1, place)


def _forget_torn_line(file: Any) -> None:
    """Remove an incomplete last line that a killed process left."""
    file.seek(0)
    content = file.read()
    whole = content.rfind(b"\n") + 1
    if whole < len(content):
        file.truncate(whole)
    file.seek(whole)
