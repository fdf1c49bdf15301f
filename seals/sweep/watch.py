"""Progress of a sweep: one line per job with the remaining time, and a final summary.

Its run folders are named by date and time.
"""

from __future__ import annotations

import contextlib
import datetime
import itertools
import math
import sys
import threading
import time
from collections.abc import Collection, Iterator, Sequence
from contextvars import ContextVar
from itertools import count
from pathlib import Path
from typing import Any

from hydra.experimental.callback import Callback
from omegaconf import OmegaConf, read_write

from seals.config.overrides import key_of
from seals.errors import ConfigError, SealsError
from seals.logs.atomic import write_json
from seals.logs.run_folder import Claim
from seals.run.progress import spoken
from seals.sweep.book import DONE, LOCK, NOTE, REFUSED, TABLE, Job, opened, read_jobs
from seals.sweep.metrics import best_of
from seals.untrusted_io import read_json


def fresh_folder(path: Path) -> Path:
    """Create a new folder and return it; a number is appended when the path exists.

    Example:
        >>> import tempfile
        >>> folder = Path(tempfile.mkdtemp()) / "12-00-00_ball"
        >>> fresh_folder(folder).name, fresh_folder(folder).name
        ('12-00-00_ball', '12-00-00_ball_2')
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    for number in count(1):
        folder = path if number == 1 else path.with_name(f"{path.name}_{number}")
        try:
            folder.mkdir()
        except FileExistsError:
            continue
        break
    return folder


def place(config: Any, kind: str) -> None:
    """Create the folder of a run or sweep; add a number when it exists.

    A folder that a word names is the user's own business.

    Args:
        config: composed by Hydra, before it makes a folder.
        kind: ``run`` or ``sweep``.

    Raises:
        ConfigError: the run's name cannot be part of a folder's name.
        OSError: it cannot be made.
    """
    hydra, key = config.hydra, f"hydra.{kind}.dir"
    named = any(key_of(word) == key for word in hydra.overrides.hydra)
    raw = OmegaConf.to_container(hydra[kind], resolve=False)
    assert isinstance(raw, dict)
    if named or "${now:" not in str(raw["dir"]):
        return
    folder = str(fresh_folder(Path(hydra[kind].dir)))
    with read_write(hydra):
        hydra[kind].dir = folder
        # jobs of a sweep are composed anew, from these words
        quoted = folder.replace("'", "\\'")
        hydra.overrides.hydra.append(f"{key}='{quoted}'")


def _same_place(given: Any, folder: Path) -> bool:
    """Return whether a setting names a folder; False where it is not set.

    Example:
        >>> _same_place("runs/a/", Path("runs/a")), _same_place(None, Path("."))
        (True, False)
    """
    return given is not None and Path(str(given)).resolve() == folder.resolve()


HYDRAS = "multirun.yaml"
"""Hydra's own note in the folder of a sweep."""
MOST_JOBS = 100_000
"""Jobs of a sweep: they are listed before the first one begins."""
LOOK = 0.5
"""Time between two looks at the book [s]."""
_MOST_WORDS = 60
_MOST_NUMBERS = 10


class Sweep:
    """One sweep in the process that the user started.

    Args:
        verb: root of its jobs, such as ``run``.
        words: overrides, without those of Hydra itself.
        resumed: whether it was begun before.

    Attributes:
        folder: of the sweep, None until Hydra has composed it.
        claim: to the folder of a single run.
    """

    def __init__(self, verb: str, words: Sequence[str], *, resumed: bool) -> None:
        self.verb, self.words, self.resumed = verb, list(words), resumed
        self.folder: Path | None = None
        self.claim = Claim()
        self._fresh = False
        self._size = 0
        self._before: dict[int, Job] = {}
        self._total: int | None = None
        self._ended: set[int] = set()
        self._out = sys.stdout
        self._start = time.perf_counter()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def begin(self, folder: Path, total: int | None) -> str:
        """Record the sweep and start its progress display.

        Args:
            folder: of the sweep.
            total: number of jobs, None when only the sweeper knows.

        Returns:
            When the sweep began.

        Raises:
            ConfigError: the folder holds another sweep.
        """
        self._total, self._start = total, time.perf_counter()
        began = self._noted(folder)
        self.folder = folder
        jobs = read_jobs(folder) if self.resumed else {}
        # a job that failed is run again: only those that are done are not reported
        self._ended = {number for number, job in jobs.items() if job.state == DONE}
        self._before = {number: job for number, job in jobs.items() if job.state != DONE}
        known = f"{total} jobs" if total is not None else "jobs"
        gone = f", {len(self._ended)} of them done before" if self._ended else ""
        print(f"sweep of {known}{gone}: {folder}", file=self._out, flush=True)
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()
        return began

    def _noted(self, folder: Path) -> str:
        """Write the record of a sweep, or check the present one; return the start time."""
        note = folder / NOTE
        with opened(folder):
            for path in (folder / name for name in (NOTE, TABLE, HYDRAS)):
                # Hydra itself opens its note, whatever lies there
                strange = path.exists() and not (path.is_file() and path.stat().st_nlink == 1)
                if path.is_symlink() or strange:
                    raise ConfigError(
                        f"{path} is a link, which leads outside the folder of the sweep, or is "
                        "not a regular file.\nReplace it by a regular file, or start a new sweep."
                    )
            if self.resumed:
                return str(read_json(note).get("started", ""))
            if note.exists():
                raise ConfigError(
                    f"hydra.sweep.dir={folder} already contains a sweep.\n"
                    "Add --resume to continue it, or choose another folder."
                )
            started = datetime.datetime.now().astimezone().isoformat(timespec="microseconds")
            facts = {"verb": self.verb, "words": self.words, "jobs": self._total}
            write_json(note, {**facts, "started": started})
            self._fresh = True
            return started

    def _watch(self) -> None:
        known = len(self._ended)
        while not self._stop.wait(LOOK):
            try:
                self._tell(known)
            except (SealsError, OSError, ValueError):
                return  # `stop` meets it again, where it can be told

    def _tell(self, known: int) -> None:
        """Print a line for every job that ended since the last call."""
        assert self.folder is not None
        book = self.folder / TABLE
        size = book.stat().st_size if book.is_file() else 0
        if size == self._size:
            return
        jobs = read_jobs(self.folder)
        self._size = size
        news = [
            job
            for number, job in jobs.items()
            if number not in self._ended and self._before.get(number) != job
        ]
        for job in news:
            self._ended.add(job.number)
            self._before.pop(job.number, None)
            own = self._own(job)
            own = own if len(own) <= _MOST_WORDS else f"{own[:_MOST_WORDS]}..."
            ended, fresh = len(self._ended), len(self._ended) - known
            of = left = ""
            if self._total is not None:
                of = f" of {self._total}"
                # from the mean duration of the jobs that ended
                pace = (time.perf_counter() - self._start) / max(fresh, 1)
                left = f"; {spoken(pace * (self._total - ended))} left"
            left = left if fresh and self._total is not None and ended < self._total else ""
            text = f"job {job.number}  {own}: {job.state} in {job.seconds:.1f} s"
            print(f"{ended}{of}  {text}{left}", file=self._out, flush=True)

    def _own(self, job: Job) -> str:
        """Return the overrides of a job that its sweep does not share."""
        return " ".join(word for word in job.words if word not in self.words)

    def stop(self) -> None:
        """Stop the progress display after a last update."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._tell(0)

    def discard(self) -> None:
        """Remove the folder of a sweep in which no job began.

        It stays where some job ran.
        """
        if self.folder is None or not self._fresh:
            return
        if any(job.state != REFUSED for job in read_jobs(self.folder).values()):
            return
        # a job that could not note its end, on a full disk say, has a folder but no line
        if any(self.folder.glob("[0-9]*/*")):
            return
        for name in (NOTE, TABLE, LOCK, HYDRAS):
            (self.folder / name).unlink(missing_ok=True)

    def cut_short(self, fault: Exception) -> SealsError:
        """Return the message about a sweep whose launcher failed."""
        assert self.folder is not None
        self.discard()
        text = f"{type(fault).__name__}: {' '.join(str(fault).split())}"
        if not (self.folder / NOTE).exists():
            advice = "No job began. Correct it and start again; SEALS_DEBUG=1 shows more."
            return SealsError(f"the sweep could not start: {text:.300}\n{advice}")
        without = self._without_end(read_jobs(self.folder))
        jobs = f"Without an end: {without}." if without else "Every job finished."
        advice = "The same command with --resume continues; SEALS_DEBUG=1 shows more."
        return SealsError(f"the sweep was interrupted: {text:.300}\n{jobs} {advice}")

    def _without_end(self, jobs: Collection[int]) -> str:
        """Return the numbers of jobs without an entry in the job log, if their count is known."""
        missing = [str(number) for number in range(self._total or 0) if number not in jobs]
        if not missing:
            return ""
        more = f" and {len(missing) - _MOST_NUMBERS} more" if len(missing) > _MOST_NUMBERS else ""
        return f"job{'s' * (len(missing) > 1)} {', '.join(missing[:_MOST_NUMBERS])}{more}"

    def report(self) -> int:
        """Print how the sweep ended and return its exit code.

        0 when all jobs are done, 2 when every one was refused, 1 when some failed or did not end.
        """
        if self.folder is None:
            return 0
        jobs = read_jobs(self.folder)
        bad = [job for job in jobs.values() if job.state != DONE]
        without = self._without_end(jobs)
        seconds = time.perf_counter() - self._start
        counts = f"{len(jobs) - len(bad)} done" + (f", {len(bad)} failed" if bad else "")
        print(f"{len(jobs)} jobs: {counts}, in {spoken(seconds)}", file=self._out)
        if without:
            print(f"Without an end: {without}.", file=sys.stderr)
        if not bad and not without:
            print(best_of(self.folder), end="", file=self._out)
            print(f"table: seals runs {self.folder}", file=self._out)
            return 0
        for job in sorted(bad):
            print(f"job {job.number}  {self._own(job)}: {job.message}", file=sys.stderr)
        if not without and len(bad) == len(jobs) and all(job.state == REFUSED for job in bad):
            self.discard()
            return 2
        mended = "After correction, the same command with --resume runs these again"
        print(f"{mended}; if an argument is wrong, start another sweep.", file=sys.stderr)
        return 1


_PRESENT: ContextVar[Sweep | None] = ContextVar("present sweep", default=None)


@contextlib.contextmanager
def watched(sweep: Sweep) -> Iterator[None]:
    """Make a sweep available to Hydra's callback in this process."""
    token = _PRESENT.set(sweep)
    try:
        yield
    except Stopped as stop:
        sweep.claim.give_back()
        raise stop.cause from stop.cause.__cause__
    except BaseException:
        sweep.claim.give_back()
        raise
    finally:
        _PRESENT.reset(token)
        try:
            sweep.claim.close()
        finally:
            sweep.stop()


class Stopped(BaseException):
    """Error that ends a Hydra callback or a search; Hydra notes plain exceptions and goes on.

    Args:
        cause: to be raised in its place.
    """

    def __init__(self, cause: Exception) -> None:
        # raised from None: an error that is the cause of what it comes from goes round for ever
        self.cause = cause


class Watch(Callback):
    """Hydra callback that assigns folders to runs, sweeps and jobs.

    Args:
        began: when the sweep began; the jobs find it in their own configuration.
        objective: metric that a job returns to its sweeper, or several of them.
    """

    def __init__(self, began: str | None = None, objective: Any = None) -> None:
        self.began, self.objective = began, objective

    def on_run_start(self, config: Any, **kwargs: Any) -> None:
        """Lock the folder of the run."""
        try:
            place(config, "run")
            sweep = _PRESENT.get()
            if sweep is not None and config.hydra.output_subdir is not None:
                folder = Path(config.hydra.run.dir).absolute()
                goes_on = _same_place(config.get("resume"), folder)
                # a run that is looked at has a process of its own
                sweep.claim.take(folder, goes_on=goes_on, keep=sweep.verb != "view")
        except Exception as cause:
            raise Stopped(cause) from None

    def on_multirun_start(self, config: Any, **kwargs: Any) -> None:
        """Start the progress display, before the first job is composed."""
        sweep = _PRESENT.get()
        if sweep is None:
            return
        try:
            total = count_of(config)
            place(config, "sweep")
            began = sweep.begin(Path(config.hydra.sweep.dir), total)
            # a job writes its notes itself, once it has claimed its number
            for_jobs = ["hydra.output_subdir=null", f"hydra.callbacks.sweep.began='{began}'"]
            with read_write(config.hydra):
                config.hydra.overrides.hydra += for_jobs
        except Exception as cause:
            raise Stopped(cause) from None


def count_of(config: Any) -> int | None:
    """Return the number of jobs of a composed sweep; None when the sweeper decides it.

    Raises:
        ConfigError: there are more than `MOST_JOBS`.
    """
    from hydra.core.global_hydra import GlobalHydra
    from hydra.core.override_parser.overrides_parser import OverridesParser

    if not str(config.hydra.sweeper.get("_target_")).endswith(".BasicSweeper"):
        return None
    extra = [f"{key}={value}" for key, value in (config.hydra.sweeper.params or {}).items()]
    words = [*extra, *(str(word) for word in config.hydra.overrides.task)]
    # glob(...) asks it for the options of a group
    loader = GlobalHydra.instance().config_loader()
    found = OverridesParser.create(config_loader=loader).parse_overrides(words)
    # a key that is given twice counts by its last value, as for the sweeper
    last = {override.get_key_element(): override for override in found}
    several = [o for o in last.values() if o.is_discrete_sweep()]
    most = MOST_JOBS + 1  # range(...) may be of any length, and Hydra writes it out
    sizes = (len(list(itertools.islice(o.sweep_string_iterator(), most))) for o in several)
    jobs = math.prod(sizes)
    if jobs >= most:
        raise ConfigError(
            f"the sweep has more than {MOST_JOBS:,} jobs.\n"
            "Leave out some values, or let a sweeper choose among them: hydra/sweeper=optuna"
        )
    return jobs
