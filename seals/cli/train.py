"""``seals train``: train a learner, or resume an interrupted training."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from seals.cli.hydra_app import Application, launch
from seals.cli.sweep import is_sweep
from seals.config.overrides import key_of, refuse_dangerous, typed, value_of
from seals.config.strangers import TRUST
from seals.errors import ConfigError
from seals.untrusted_io import read_file

RESUME = "resume"
FREE = ("course", "threads", "film", "track")
"""Keys that a training taken up again may change."""
FIRST = (
    "env=hover_wind",
    "learner=ppo_hover",
    "course.steps=200000",
    "course.look_every=20000",
    "course.log_every=20000",
)
"""The first policy: what is trained where no word names an environment or a learner."""
SAME = (*FREE, "out", "seed", "device", "name")
"""Keys that still train the first policy; and flags that show or repeat it."""
_FLAGS = ("--cfg", "-c", "job", "all", "--resolve", "-m", "--multirun")
_TASK = Application("seals.learn.training.application")


def train(arguments: list[str]) -> int:
    """Run ``seals train``: compose the configuration, then call its application.

    ``resume=FOLDER`` stands for the words that began the training in that folder; it goes on there.
    Without words of an environment or a learner it trains the first policy.
    """
    resumed = value_of(arguments, RESUME)
    if resumed is None or is_sweep(resumed):
        return launch("train", [*_first_policy(arguments), *arguments], _TASK)
    folder = Path(resumed)
    others = [word for word in arguments if word.partition("=")[0] != RESUME]
    for word in others:
        # before any file is written
        free = not word.startswith("-") and key_of(word).partition(".")[0] in FREE
        if word != TRUST and not free:
            raise ConfigError(
                f"resume={folder}: {word} would change the training.\n"
                "Allowed with resume: course.KEY=VALUE, threads=NUMBER, film=true, track=NAME"
            )
    place = [f"{RESUME}='{folder}'", f"hydra.run.dir='{folder}'"]
    source = f"resume={folder}: overrides.yaml"
    own = [*others, *place]
    return launch("train", [*_begun(folder), *own], _TASK, own=own, source=source)


def _first_policy(arguments: list[str]) -> list[str]:
    """Return the words of the first policy, with a film where one can be written; else none."""
    plain = [word for word in arguments if word not in _FLAGS]
    if any("=" not in word or key_of(word).partition(".")[0] not in SAME for word in plain):
        return []
    return [*FIRST, "film=true"] if importlib.util.find_spec("av") else [*FIRST]


def _begun(folder: Path) -> list[str]:
    """Return the overrides of the training in a folder."""
    path = folder / ".hydra" / "overrides.yaml"
    if not path.is_file():
        raise ConfigError(
            f"resume={folder}: there is no training in this folder.\n"
            "Give the folder of a training; it contains .hydra/overrides.yaml and run.json."
        )
    remedy = "Restore it, or start again without resume."
    words: list[str] = read_file(list[str] | None, path, remedy=remedy) or []
    if (folder / "run.json").is_file() and (folder / "log.parquet").is_file():
        resume, repeat = (typed(key, str(folder)) for key in ("resume", "repeat"))
        raise ConfigError(
            f"resume={folder}: this folder contains a run, not a training.\n"
            f"Resume or repeat it: seals run {resume}, or {repeat}"
        )
    refuse_dangerous(
        words,
        where=f"resume={folder}: {path.name}",
        remedy="Resume only trainings of seals train, or remove that line.",
    )
    return [word for word in words if word.partition("=")[0] != RESUME]
