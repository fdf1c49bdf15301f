"""Parallel trainings, one process each, resumable after an interruption."""

from __future__ import annotations

import contextlib
import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import seals
from seals.child_process import command, environment
from seals.errors import SealsError
from seals.experiments.command import CommandParser, seconds, whole
from seals.experiments.learning_study.arms import COMPARISONS, Training
from seals.learn.evaluation.page import NUMBERS
from seals.run.progress import progress

EPISODES = 10
"""Demonstrations, all of them successful, by the scripted expert."""
SEALS = tuple(command(Path(seals.__file__).parent / "cli" / "__main__.py"))
LABELS = {"train": "training", "evaluate": "judging"}
"""What the progress display says of the processes of a verb."""
MOST_JOBS = 4096
PATIENCE = 60.0
"""Time in which a training writes its checkpoint when it is asked to stop [s]."""


def add_processes(parser: CommandParser, *, at_once: int) -> None:
    """Add the options ``--jobs`` and ``--limit`` of `run_all` to a command line."""
    help_jobs = "processes at once, one core each"
    parser.add_argument("--jobs", type=whole(1, MOST_JOBS), default=at_once, help=help_jobs)
    help_limit = "stop politely after so many s; 0 for never"
    parser.add_argument("--limit", type=_limit, default=0.0, help=help_limit)


def _limit(text: str) -> float:
    return 0.0 if text in ("0", "0.0") else seconds(text)


class VerbFailed(SealsError):
    """End of a verb with another exit code than 0.

    Args:
        verb: its name.
        code: with which it ended, negative by a signal.
    """

    def __init__(self, verb: str, code: int) -> None:
        super().__init__(
            f"seals {verb} ended with exit code {code}; the reason is told above.\n"
            "When it is mended, the same command goes on."
        )
        self.code = code


def record(folder: Path) -> Path:
    """Record the demonstrations, once."""
    if not folder.exists():
        run_verb("record", "env=reach", f"episodes={EPISODES}", f"out={folder}")
    return folder


def run_verb(*words: str) -> None:
    """Run a verb of ``seals`` to its end, on one core.

    Raises:
        VerbFailed: it was refused, in words of its own.
    """
    code = subprocess.run([*SEALS, *words], check=False, env=_alone()).returncode
    if code:
        raise VerbFailed(words[0], code)


def run_all(jobs: Sequence[Training], *, at_once: int, limit: float) -> int:
    """Run the unfinished trainings; return the number that is left.

    Args:
        jobs: all trainings, or all evaluations.
        at_once: processes at a time.
        limit: time after which all are asked to stop [s]; 0 for none.
    """
    waiting = [job for job in jobs if _state(job.folder) != "done"]
    begin = time.monotonic()
    done = len(jobs) - len(waiting)
    with (
        _stopped_together() as running,
        progress(LABELS.get(jobs[0].words[0], "") if jobs else "", len(jobs)) as tell,
    ):
        while waiting or running:
            tell(done)
            over = limit > 0.0 and time.monotonic() - begin > limit
            if over:
                break
            while waiting and len(running) < at_once:
                job = waiting.pop(0)
                running.append((job, _started(job)))
            time.sleep(0.5)
            ended = [pair for pair in running if pair[1].poll() is not None]
            for job, process in ended:
                if process.returncode:
                    print(
                        f"{job.folder} ended with exit code {process.returncode}; see "
                        f"{job.folder}/log.txt",
                        file=sys.stderr,
                    )
            running[:] = [pair for pair in running if pair not in ended]
            done += len(ended)
    return sum(_state(job.folder) != "done" for job in jobs)


def compare(out: Path) -> int:
    """Compare the arms of a study that is complete: learners with SAC, ablations with SACfD."""
    there = {folder.name for folder in out.iterdir() if folder.is_dir()}
    worst = 0
    for name, arms in COMPARISONS.items():
        chosen = [arm for arm in arms if arm in there]
        if len(chosen) > 1:
            words = [f"{arm}='{(out / arm).resolve()}/*'" for arm in chosen]
            target = out.resolve().with_name(f"{out.name}_{name}")
            code = subprocess.run(
                [*SEALS, "evaluate", "--compare", *words, f"out={target}"],
                # a checkout in the working folder would stand in for what is installed
                cwd=out,
                check=False,
            ).returncode
            worst = max(worst, code)
    return worst


def _started(job: Training) -> subprocess.Popen[bytes]:
    """Begin a training, or take it up where it stopped."""
    cut_off = (job.folder / "checkpoint.bin").exists()
    words = ("train", f"resume={job.folder}") if cut_off else job.words
    job.folder.mkdir(parents=True, exist_ok=True)
    with (job.folder / "log.txt").open("ab") as log:
        # a second Ctrl-C would cut off the checkpoint that the first one asks for
        return subprocess.Popen(
            [*SEALS, *words], stdout=log, stderr=log, env=_alone(), start_new_session=True
        )


@contextlib.contextmanager
def _stopped_together() -> Iterator[list[tuple[Training, subprocess.Popen[bytes]]]]:
    """Yield the list of processes to be; those that are left at its end are asked to stop."""
    running: list[tuple[Training, subprocess.Popen[bytes]]] = []
    try:
        yield running
    finally:
        _stop([process for _, process in running])


def _stop(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        process.send_signal(signal.SIGTERM)
    for process in processes:
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()


def _state(folder: Path) -> str:
    """What ``run.json`` says of a training, or of an evaluation; empty before its start."""
    if (folder / NUMBERS).exists():
        return "done"
    file = folder / "run.json"
    return str(json.loads(file.read_text()).get("state", "")) if file.exists() else ""


def _alone() -> dict[str, str]:
    """Return the surroundings of a process that keeps to one core."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**environment(), **threads}
