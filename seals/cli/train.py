"""``seals train``: train a learner, or resume an interrupted training."""

from __future__ import annotations

import os
from pathlib import Path

from seals.cli.hydra_app import Application, launch
from seals.cli.sweep import is_sweep
from seals.config.overrides import refuse_dangerous, typed
from seals.config.strangers import TRUST
from seals.errors import ConfigError
from seals.untrusted_io import read_plain_yaml

RESUME = "resume"
FREE = ("course", "threads", "film", "track")
"""Keys that a training taken up again may change."""
_TASK = Application("seals.learn.training.application")


def train(arguments: list[str]) -> int:
    """Run ``seals train``: compose the configuration, then call its application.

    ``resume=FOLDER`` stands for the words that began the training in that folder; it goes on there.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    kept = [word for word in arguments if word.partition("=")[0] == RESUME]
    folder = Path(kept[-1].partition("=")[2].strip("'\"")) if kept else Path()
    if not kept or is_sweep(folder):
        return launch("train", arguments, _TASK)
    others = [word for word in arguments if word.partition("=")[0] != RESUME]
    _refuse_changes(folder, [word for word in others if word != TRUST])
    place = [f"{RESUME}='{folder}'", f"hydra.run.dir='{folder}'"]
    source = f"resume={folder}: overrides.yaml"
    own = [*others, *place]
    return launch("train", [*_begun(folder), *own], _TASK, own=own, source=source)


def _refuse_changes(folder: Path, words: list[str]) -> None:
    """Refuse changes that would make it another training, before any file is written."""
    for word in words:
        if word.startswith("-") or word.partition("=")[0].partition(".")[0] not in FREE:
            raise ConfigError(
                f"resume={folder}: {word} would make another training of it.\n"
                "Allowed beside resume: course.KEY=VALUE, threads=NUMBER, film=true, track=NAME"
            )


def _begun(folder: Path) -> list[str]:
    """Return the overrides of the training in a folder."""
    import yaml

    path = folder / ".hydra" / "overrides.yaml"
    try:
        found = read_plain_yaml(path)
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as cause:
        raise ConfigError(
            f"resume={folder}: there is no training in this folder.\n"
            "Give the folder of a training; it holds .hydra/overrides.yaml and run.json."
        ) from cause
    if not isinstance(found, list | None):
        raise ConfigError(
            f"resume={folder}: {path.name} holds no list of words.\n"
            "Restore it, or begin anew without resume."
        )
    words = [str(word) for word in found or []]
    if (folder / "run.json").is_file() and (folder / "log.parquet").is_file():
        resume, repeat = (typed(key, str(folder)) for key in ("resume", "repeat"))
        raise ConfigError(
            f"resume={folder}: this folder holds a run, not a training.\n"
            f"Resume or repeat it: seals run {resume}, or {repeat}"
        )
    refuse_dangerous(
        words,
        where=f"resume={folder}: {path.name}",
        remedy="Take up trainings of seals train only, or remove that line.",
    )
    return [word for word in words if word.partition("=")[0] != RESUME]
