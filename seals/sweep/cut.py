"""Resumption of interrupted jobs of a sweep from their own checkpoints."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, DiskFull, LogError
from seals.sweep.book import Job
from seals.untrusted_io import read_plain_yaml

HYDRA = ".hydra"


def goes_on(
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
    checkpoints = _checkpoints(str(hydra.job.config_name))
    if not checkpoints.has_checkpoint(folder):
        return False
    kept = (DiskFull.__name__, ConfigError.__name__)
    cut_off = before is None or before.message.startswith(kept)
    if cut_off and _is_own(folder, hydra, words):
        return True
    checkpoints.remove_checkpoint(folder)
    return False


def _checkpoints(verb: str) -> Any:
    """Return the checkpoint module of a verb."""
    if verb == "train":
        from seals.learn.training import checkpoint as of_trainings

        return of_trainings
    from seals.run import checkpoint as of_runs

    return of_runs


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
