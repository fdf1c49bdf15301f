"""One job of a sweep: skipped when done, resumed when interrupted, logged at its end.

Before the start of a sweep the mode of its command and its jobs are composed as seldom as possible.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import re
import shutil
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from seals.config.roots import conf_folders
from seals.errors import ConfigError, DiskFull, LogError, SealsError
from seals.logs.atomic import write_yaml
from seals.logs.run_folder import LOCK, clear, held, open_own
from seals.sweep.book import DONE, FAILED, REFUSED, Job, JobLock, claimed, read_jobs
from seals.untrusted_io import read_plain_yaml

WHOLE, REAL = re.compile(r"[-+]?\d+"), re.compile(r"[-+]?(\d+\.\d*|\.?\d+)([eE][-+]?\d+)?")


@contextlib.contextmanager
def checked_by_value() -> Iterator[None]:
    """Reduce the jobs that Hydra's sweepers compose beforehand.

    Hydra composes every job before the first one starts, in one process: with hundreds of them the
    others wait for that. A wrong value is wrong in whatever company, so a job is composed only for
    a value that none before it had; and where one whole number can be composed, so can another.
    What is wrong only together, or out of its bounds, is refused when its job begins.
    """
    from hydra.plugins.sweeper import Sweeper

    before = Sweeper.validate_batch_is_legal

    def check(self: Any, batch: Sequence[Sequence[str]]) -> None:
        before(self, newcomers(batch))

    Sweeper.validate_batch_is_legal = check  # type: ignore[method-assign]
    try:
        yield
    finally:
        Sweeper.validate_batch_is_legal = before  # type: ignore[method-assign]


def sets_mode(words: Sequence[str]) -> bool:
    """Return whether a word, or a file of an installed package, may set ``hydra.mode``."""
    if any(re.search(r"hydra(/|=|\.mode|\.searchpath)", word) for word in words):
        return True
    return any(
        re.search(rb"\bmode\s*:\s*\W?MULTIRUN\b", file.read_bytes())
        for _, folder in conf_folders()
        for file in folder.rglob("*.yaml")
    )


def newcomers(batch: Sequence[Sequence[str]]) -> list[Sequence[str]]:
    """Return the jobs with an override of a kind that no earlier job has.

    Example:
        >>> newcomers([["a=x", "b=1"], ["a=x", "b=2"], ["a=y", "b=1"], ["a=y", "b=2.5"]])
        [['a=x', 'b=1'], ['a=y', 'b=1'], ['a=y', 'b=2.5']]
    """
    seen: set[str] = set()
    found = []
    for words in batch:
        kinds = {kind(word) for word in words}
        if not seen.issuperset(kinds):
            found.append(words)
            seen |= kinds
    return found


def kind(word: str) -> str:
    """Return an override with a number in it replaced by its type, as a key for comparison.

    Example:
        >>> kind("seed=12"), kind("a.b=-1.5e3"), kind("robot=crab"), kind("+x@y=z")
        ('seed=whole', 'a.b=real', 'robot=crab', '+x@y=z')
    """
    key, equals, value = word.partition("=")
    for pattern, name in ((WHOLE, "whole"), (REAL, "real")):
        if pattern.fullmatch(value):
            return f"{key}{equals}{name}"
    return word


SAID = "stdout.txt"
"""What a job printed, in its folder: on the terminal a sweep has one line for each job."""
HYDRA = ".hydra"


def perform(task: Callable[[Any], int | None], config: Any) -> int:
    """Run one job of a sweep and return its exit code; an error is recorded, not raised.

    Args:
        task: takes the composed configuration; may return an exit code.
        config: composed for this job.

    Raises:
        ConfigError: the folder of the sweep holds another one, or nobody watches it.
    """
    from hydra.core.hydra_config import HydraConfig
    from omegaconf import OmegaConf, open_dict

    hydra = HydraConfig.get()
    sweep, folder = Path(hydra.sweep.dir), Path(hydra.runtime.output_dir)
    number, words = int(hydra.job.num), tuple(str(word) for word in hydra.overrides.task)
    if began(hydra) is None:
        raise ConfigError(
            "hydra.callbacks.sweep is missing: the end of this sweep would not be recorded.\n"
            "Leave out the overrides of hydra.callbacks.sweep."
        )
    if not folder.resolve().is_relative_to(sweep.resolve()):
        # what an earlier run left in the folder of a job is removed
        raise ConfigError(
            f"the folder of job {number} leads outside its sweep: {folder} is {folder.resolve()}.\n"
            "Remove the link, or choose another folder: hydra.sweep.dir=FOLDER"
        )
    with claimed(sweep, number) as claim, contextlib.ExitStack() as stack:
        before = read_jobs(sweep).get(number)
        if before is not None and sorted(before.words) != sorted(words):
            raise ConfigError(
                f"{sweep} contains another sweep: its job {number} is {' '.join(before.words)}.\n"
                "Choose another folder: hydra.sweep.dir=FOLDER"
            )
        if before is not None and before.state == DONE:
            return before.code
        stack.enter_context(held(folder))
        if _goes_on(folder, config, hydra, words, before):
            with open_dict(config):
                config.resume = str(folder)
        else:
            clear(folder)
            # Hydra's notes, each file atomically
            nodes = {"config": config, "hydra": OmegaConf.create({"hydra": hydra})}
            for name, node in nodes.items():
                plain = OmegaConf.to_container(node, enum_to_str=True)
                write_yaml(folder / HYDRA / f"{name}.yaml", plain)
            write_yaml(folder / HYDRA / "overrides.yaml", list(words))
        return _done(task, config, claim, folder, Job(number, DONE, 0, 0.0, words, ""))


def _done(
    task: Callable[[Any], int | None], config: Any, claim: JobLock, folder: Path, job: Job
) -> int:
    """Run the task with its output redirected to a file, and record how it ended."""
    start = time.perf_counter()
    # what is printed goes into a file
    descriptor = open_own(folder / SAID, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    with (
        os.fdopen(descriptor, "a", encoding="utf-8") as file,
        contextlib.redirect_stdout(file),
        contextlib.redirect_stderr(file),
    ):
        try:
            job = job._replace(code=task(config) or 0)
        except SealsError as refusal:
            text = " ".join(str(refusal).split())
            fresh = {entry.name for entry in folder.iterdir()} <= {HYDRA, SAID, LOCK}
            job = job._replace(state=REFUSED if fresh else FAILED, code=refusal.exit_code)
            job = job._replace(message=f"{type(refusal).__name__}: {text}")
            print(job.message)
        except Exception as fault:  # whatever it is, the other jobs go on; it is told at the end
            traceback.print_exc()
            text = " ".join(str(fault).split())
            job = job._replace(state=FAILED, code=1, message=f"{type(fault).__name__}: {text}")
    claim.note(job._replace(seconds=time.perf_counter() - start))
    if job.state == REFUSED:
        shutil.rmtree(folder, ignore_errors=True)
    return job.code


def _goes_on(
    folder: Path, config: Any, hydra: Any, words: Sequence[str], before: Job | None
) -> bool:
    """Return whether a job resumes from its checkpoint; checkpoints of other jobs are removed.

    Args:
        folder: of the job.
        config: composed for it.
        hydra: Hydra's part of that.
        words: its overrides.
        before: what the book says of it. A job that failed begins anew: what is mended since would
            not be in its checkpoint. One that had no room on the disk has nothing to be mended, and
            one whose words were refused has lost nothing yet.
    """
    if "resume" not in config:
        return False
    training = str(hydra.job.config_name) == "train"
    room = "seals.learn.training" if training else "seals.run"
    checkpoints = importlib.import_module(f"{room}.checkpoint")
    if not checkpoints.has_checkpoint(folder):
        return False
    kept = (DiskFull.__name__, ConfigError.__name__)
    cut_off = before is None or before.message.startswith(kept)
    if cut_off and _is_own(folder, hydra, words):
        return True
    checkpoints.remove_checkpoint(folder)
    return False


def _is_own(folder: Path, hydra: Any, words: Sequence[str]) -> bool:
    """Return whether the job in a folder belongs to this sweep and has the same overrides."""
    import yaml

    try:
        noted = read_plain_yaml(folder / HYDRA / "hydra.yaml")
        same = read_plain_yaml(folder / HYDRA / "overrides.yaml") == list(words)
        return bool(same and noted["hydra"]["callbacks"]["sweep"]["began"] == began(hydra))
    except (OSError, ValueError, yaml.YAMLError, LogError, KeyError, TypeError):
        # notes of a single run, or none: whoever was at work here was no job of this sweep
        return False


def began(hydra: Any) -> str | None:
    """Return the start time of a job's sweep, which identifies it; None without a sweep."""
    watch = hydra.callbacks.get("sweep") if hydra.get("callbacks") else None
    found = watch.get("began") if watch else None
    return None if found is None else str(found)
