"""Resumption of a sweep: ``--resume`` with the same command, or ``resume=FOLDER``."""

from __future__ import annotations

import datetime
import importlib.util
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from seals.cli.slips import RESUME
from seals.config.overrides import key_of, refuse_dangerous, value_of
from seals.errors import ConfigError, MissingExtra, refuse_unlisted
from seals.sweep.book import NOTE
from seals.untrusted_io import read_file

MULTIRUN = ("--multirun", "-m")

_FOLDER = "hydra.sweep.dir"
_LAUNCHER, _SWEEPER = "hydra/launcher", "hydra/sweeper"
_OBJECTIVE = "hydra.callbacks.sweep.objective"
_PACKAGES = {
    _LAUNCHER: {
        "basic": ("", ""),
        "joblib": ("hydra_plugins.hydra_joblib_launcher", "aam-seals[sweep]"),
        "submitit_local": ("hydra_plugins.hydra_submitit_launcher", "aam-seals[sweep]"),
        "submitit_slurm": ("hydra_plugins.hydra_submitit_launcher", "aam-seals[sweep]"),
        "ray": ("hydra_plugins.hydra_ray_launcher", "aam-seals[ray]"),
        "ray_aws": ("hydra_plugins.hydra_ray_launcher", "aam-seals[ray]"),
    },
    _SWEEPER: {
        "basic": ("", ""),
        "optuna": ("hydra_plugins.hydra_optuna_sweeper", "aam-seals[sweep]"),
    },
}
"""Module and extra of launchers and sweepers, by name."""


def begun(root: str, words: Sequence[str]) -> tuple[list[str], bool, str]:
    """Return the arguments of an interrupted sweep on request; other commands stay unchanged.

    Args:
        root: of its jobs, such as ``run``.
        words: overrides and flags.

    Returns:
        Words for Hydra, flags included; whether they are of a sweep that was begun before; and the
        file that they come from, empty for the command line.

    Raises:
        ConfigError: there is no such sweep, it is another one, or the folder holds one already.
        MissingExtra: the launcher is not installed.
    """
    for word in words:
        key, _, name = word.partition("=")
        if key in _PACKAGES:
            _refuse_absent(word, name, _PACKAGES[key])
        if word.startswith("hydra.sweep.subdir"):
            # a resumed sweep could not find them
            raise ConfigError(
                f"{word}: the jobs of a sweep have folders named by their numbers.\n"
                "Choose the folder of the sweep: hydra.sweep.dir=FOLDER"
            )
    named = value_of(words, "resume")
    if named and is_sweep(named):
        folder = Path(named)
        return _taken_up(root, folder, words), True, f"resume={folder}: {NOTE}"
    if RESUME not in words:
        return list(words), False, ""
    if not any(word in MULTIRUN for word in words):
        raise ConfigError(
            f"{RESUME} belongs to a sweep, and this command does not start one.\n"
            "Add --multirun, or resume one run: resume=FOLDER"
        )
    rest = [word for word in words if word != RESUME]
    stated = value_of(rest, _FOLDER)
    if stated is not None and "$" in stated:
        # only Hydra can look that up
        raise ConfigError(
            f"{_FOLDER}={stated}: with {RESUME} the folder must already exist.\n"
            f"Give its name: {_FOLDER}=FOLDER"
        )
    folder = _newest(root, own_words(rest)) if stated is None else Path(stated)
    verb, begun_words, _ = _note(folder)
    if verb != root or sorted(begun_words) != sorted(own_words(rest)):
        raise ConfigError(
            f"{folder} was started with other overrides: seals {verb} {' '.join(begun_words)}.\n"
            "Give the same ones, or resume it by its folder alone: resume=FOLDER"
        )
    hydras = [word for word in rest if word not in own_words(rest)]
    return _going_on([*begun_words, *hydras], folder), True, ""


def with_objective(words: Sequence[str]) -> list[str]:
    """Return the words with ``objective=METRIC`` as the setting that every job of a sweep finds.

    Raises:
        ConfigError: a sweeper searches, and no objective is given.

    Example:
        >>> with_objective(["env=reach", "objective=success"])
        ['env=reach', 'hydra.callbacks.sweep.objective=success']
    """
    found = [word.partition("=") for word in words]
    searching = [
        word
        for word, (key, _, name) in zip(words, found, strict=True)
        if key == _SWEEPER and name != "basic"
    ]
    if searching and not any(key == "objective" and name for key, _, name in found):
        raise ConfigError(
            f"{searching[-1]} searches for the best value of a metric, but no metric is given.\n"
            "Give objective=METRIC, for instance objective=success; seals runs lists them."
        )
    return [
        f"{_OBJECTIVE}={name}" if key == "objective" else word
        for word, (key, _, name) in zip(words, found, strict=True)
    ]


def is_sweep(folder: str | Path) -> bool:
    """Return whether a folder is that of a sweep."""
    return (Path(folder) / NOTE).is_file()


def own_words(words: Sequence[str]) -> list[str]:
    """Return the overrides that define the jobs, without Hydra's settings and flags."""
    return [w for w in words if not w.startswith("-") and not w.lstrip("+~").startswith("hydra")]


def _newest(root: str, words: Sequence[str]) -> Path:
    """Return the newest sweep below ``runs`` that the same words began."""
    found: list[tuple[str, Path]] = []
    places = list(Path("runs").rglob(NOTE))
    for place in places:
        try:
            verb, begun_words, started = _note(place.parent)
        except ConfigError as damaged:
            # it may be anybody's
            print(f"note: skipped. {' '.join(str(damaged).split())}", file=sys.stderr)
            continue
        if verb == root and sorted(begun_words) == sorted(words):
            found.append((started, place.parent))
    if found:
        return max(found)[1]
    raise ConfigError(
        f"{RESUME}: none of the {len(places)} sweeps in runs/ was started with these overrides.\n"
        "Name its folder: resume=FOLDER, or start the sweep without --resume."
    )


class _Note(NamedTuple):
    """What a sweep notes of itself."""

    verb: str
    words: list[str]
    started: str = ""


def _note(folder: Path) -> tuple[str, list[str], str]:
    """Return verb and words of a sweep, and when it began: as text that sorts in any time zone."""
    path = folder / NOTE
    if not os.path.lexists(path):
        raise ConfigError(
            f"{folder}: there is no sweep in this folder.\n"
            f"Give the folder of a sweep; it contains {NOTE} and jobs.csv."
        )
    note: _Note = read_file(_Note, path, remedy="Restore it, or start again.", extra=True)
    started = note.started
    try:
        if started:
            there = datetime.datetime.fromisoformat(started).astimezone(datetime.timezone.utc)
            started = there.isoformat(timespec="microseconds")
    except (OverflowError, ValueError) as cause:
        raise ConfigError(f"{path}: {cause}.\nRestore it, or start again.") from cause
    return note.verb, note.words, started


def _taken_up(root: str, folder: Path, words: Sequence[str]) -> list[str]:
    """Return the words of a sweep given by its folder; only the launcher may differ."""
    verb, begun_words, _ = _note(folder)
    if verb != root:
        raise ConfigError(
            f"resume={folder} is a sweep of seals {verb}.\nWrite: seals {verb} resume={folder}"
        )
    refuse_dangerous(
        begun_words,
        where=f"resume={folder}: {NOTE}",
        remedy="Resume it by the command that started it, with --resume.",
        writer=f"sweep of seals {root}",
    )
    flags = {*MULTIRUN, RESUME}
    rest = [word for word in words if word not in flags and not word.startswith("resume=")]
    for word in rest:
        # a folder of configuration is named by a person, never by a note
        if not word.startswith((_LAUNCHER, "hydra.launcher.", "--config-dir=")):
            raise ConfigError(
                f"resume={folder}: {word} would change the sweep.\n"
                "Allowed with resume: hydra/launcher=NAME, hydra.launcher.KEY=VALUE, "
                "--config-dir DIR"
            )
    return _going_on([*begun_words, *rest], folder)


def _going_on(words: Sequence[str], folder: Path) -> list[str]:
    """Add the override that runs the jobs in their old folders."""
    kept = [word for word in words if word not in MULTIRUN and key_of(word) != _FOLDER]
    # Hydra's parser takes no flag between two overrides
    kept.sort(key=lambda word: not word.startswith("-"))
    return ["--multirun", *kept, f"{_FOLDER}='{folder}'"]


def _refuse_absent(word: str, name: str, known: Mapping[str, tuple[str, str]]) -> None:
    """Refuse a launcher or sweeper whose package is not installed."""
    kind = word.partition("=")[0].partition("/")[2]
    refuse_unlisted(name, known, f"{word}: there is no {kind} '{name}'")
    module, extra = known[name]
    try:
        there = not module or importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:
        there = False
    if not there:
        raise MissingExtra(f"{word} needs a package that is absent.\npip install '{extra}'")
