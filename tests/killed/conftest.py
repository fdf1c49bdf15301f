"""Commands that are killed hard, again and again, and what has to come of them all the same."""

from __future__ import annotations

import csv
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import yaml

from seals.logs.table import read_parquet

SEALS = (sys.executable, "-c", "import sys; from seals.cli.main import main; sys.exit(main())")
PATIENCE = 300.0
"""Time after which a command that was left alone hangs [s]."""
SOON = 0.3
"""Longest time from a checkpoint to a kill that follows it [s]."""
_CLOCK = ("seconds", "planning_seconds", "steps_per_second", "started", "created", "date")
_LIFE = ("git", "overrides", "resume_of", "repeat_of", "remarks", "run_id")
_PLACES = ("log", "out", "path", "file", "folder")
OF_ITS_OWN = frozenset((*_CLOCK, *_LIFE, *_PLACES))
"""What two lives of one command may tell differently: times of the clock, places."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """One long command.

    Args:
        words: of the command.
        place: word that says where it writes; ``{}`` stands for the folder.
        again: words that take up what was cut off; ``{}`` stands for the folder of the last life.
            None for the same words once more.
        kept: file in that folder without which nothing can be taken up.
        apart: whether a life taken up writes a folder of its own.
        codes: exit codes of a command that came to its end.
        loose: endings of files that hold times of the clock and are looked at for being there.
    """

    words: Sequence[str]
    place: str
    again: Sequence[str] | None = None
    kept: str = ""
    apart: bool = False
    codes: Sequence[int] = (0,)
    loose: Sequence[str] = field(default=(".html",))


class Killer:
    """Runs jobs in a folder, killing them at moments drawn from their own duration."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder, self.random = folder, random.Random(seed)

    def haunt(self, words: Sequence[str], *, kills: int = 5, **more: Any) -> None:
        """Assert that a command that is killed several times ends like one left alone.

        Args:
            words: of the command.
            kills: how often.
            more: see `Job`.
        """
        job = Job(words=words, **more)
        took = self.alone(job)
        same(self.folder / "alone", self.haunted(job, took, kills=kills), job)

    def alone(self, job: Job, name: str = "alone") -> float:
        """Run a job without a kill; return how long it took [s]."""
        begin = time.monotonic()
        code, said = self.finish([*job.words, job.place.format(self.folder / name)])
        assert code in job.codes, said
        return time.monotonic() - begin

    def haunted(self, job: Job, took: float, *, kills: int) -> Path:
        """Run a job that is killed several times and taken up each time; return its folder.

        Args:
            job: to be run.
            took: how long it takes when left alone [s].
            kills: how often.
        """
        lives: list[Path] = []
        for _ in range(kills):
            words, place = self._next(job, lives)
            lives.append(place)
            # every other time soon after a checkpoint: most of a short command is its start
            mark = place / job.kept if job.kept and not job.apart and len(lives) % 2 == 0 else None
            after = self.random.uniform(0.0, took if mark is None else SOON)
            if not self._kill(words, after=after, mark=mark):
                break  # it was done sooner than that
        words, place = self._next(job, lives)
        code, said = self.finish(words)
        # killed in the moment between its last file and its exit, it has nothing left to do
        assert code in job.codes or (code == 2 and "exists already" in said), said
        return place

    def _next(self, job: Job, lives: Sequence[Path]) -> tuple[list[str], Path]:
        """Words and folder of the next life."""
        fresh = self.folder / (f"life_{len(lives)}" if job.apart else "life")
        cut = next((life for life in reversed(lives) if self._can(job, life)), None)
        if job.again is None or cut is None:
            return [*job.words, job.place.format(fresh)], fresh
        words = [word.format(cut) for word in job.again]
        return ([*words, job.place.format(fresh)], fresh) if job.apart else (words, cut)

    @staticmethod
    def _can(job: Job, life: Path) -> bool:
        return bool(job.kept) and (life / job.kept).exists()

    def _kill(self, words: Sequence[str], *, after: float, mark: Path | None = None) -> bool:
        """Start a command, kill it after a while; return whether it still ran.

        Args:
            words: of the command.
            after: time from its start, or from the moment at which it writes `mark` [s].
            mark: file, or None.
        """
        before = _written(mark)
        with subprocess.Popen(
            [*SEALS, *words],
            cwd=self.folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        ) as child:
            try:
                while mark is not None and _written(mark) == before and child.poll() is None:
                    time.sleep(0.01)
                child.wait(after)
                return False
            except subprocess.TimeoutExpired:
                os.kill(child.pid, signal.SIGKILL)
                child.wait()
            self._refuse_orphans(child.pid)
        return True

    @staticmethod
    def _refuse_orphans(group: int) -> None:
        """Helpers of a command that was killed end by themselves."""
        begin = time.monotonic()
        while True:
            try:
                os.killpg(group, 0)
            except ProcessLookupError:
                return
            if time.monotonic() - begin > 20.0:
                os.killpg(group, signal.SIGKILL)
                pytest.fail("processes of a command that was killed stayed behind")
            time.sleep(0.1)

    def finish(self, words: Sequence[str]) -> tuple[int, str]:
        """Run a command to its end; return its exit code and what it said."""
        done = subprocess.run(
            [*SEALS, *words],
            cwd=self.folder,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        return done.returncode, f"seals {' '.join(words)}\n{done.stdout}{done.stderr}"


def _written(path: Path | None) -> int:
    """Time at which a file was written last [ns]; 0 without one."""
    return path.stat().st_mtime_ns if path is not None and path.exists() else 0


def same(one: Path, other: Path, job: Job) -> None:
    """Assert that two folders, or files, hold the same but for times of the clock."""
    names = _names(one)
    assert names, f"{one} is empty"
    assert names == _names(other)
    for name in names:
        if not name.endswith(tuple(job.loose)):
            assert _content(one / name) == _content(other / name), name


def _names(place: Path) -> list[str]:
    """Files of a folder; hidden ones, and those of earlier lives set aside, are no result."""
    found = (p.relative_to(place) for p in place.rglob("*") if p.is_file())
    aside = (".", "earlier_")
    return sorted(str(p) for p in found if not any(part.startswith(aside) for part in p.parts))


def _content(path: Path) -> Any:
    readers: dict[str, Callable[[Path], Any]] = {
        ".parquet": lambda p: {k: v.tobytes() for k, v in read_parquet(p).items()},
        ".json": lambda p: _lasting(json.loads(p.read_text())),
        ".yaml": lambda p: _lasting(yaml.safe_load(p.read_text())),
        ".csv": _rows,
    }
    return readers.get(path.suffix, Path.read_bytes)(path)


def _rows(path: Path) -> Any:
    with path.open(newline="") as file:
        return [_lasting(row) for row in csv.DictReader(file)]


def _lasting(value: Any) -> Any:
    """Leave out what belongs to one life of a command."""
    if isinstance(value, dict):
        return {k: _lasting(v) for k, v in value.items() if k not in OF_ITS_OWN}
    return [_lasting(child) for child in value] if isinstance(value, list) else value


@pytest.fixture
def killer(tmp_path: Path) -> Killer:
    """A folder to run in; ``SEALS_KILLS`` is the seed of the moments, printed when a test fails."""
    seed = int(os.environ.get("SEALS_KILLS", random.SystemRandom().randrange(10_000)))
    print(f"SEALS_KILLS={seed}")
    return Killer(tmp_path, seed)
