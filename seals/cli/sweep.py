"""Resumption of a sweep: ``--resume`` with the same command, or ``resume=FOLDER``."""

from __future__ import annotations

import datetime
import importlib.util
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from seals.config.overrides import refuse_dangerous
from seals.errors import ConfigError, LogError, MissingExtra, suggestion
from seals.sweep.book import NOTE
from seals.untrusted_io import read_json

RESUME = "--resume"
MULTIRUN = ("--multirun", "-m")
_FOLDER = "hydra.sweep.dir"
_LAUNCHER, _SWEEPER = "hydra/launcher", "hydra/sweeper"
_OBJECTIVE = "hydra.callbacks.sweep.objective"
_LAUNCHERS = {
    "basic": ("", ""),
    "joblib": ("hydra_plugins.hydra_joblib_launcher", "aam-seals[sweep]"),
    "submitit_local": ("hydra_plugins.hydra_submitit_launcher", "aam-seals[sweep]"),
    "submitit_slurm": ("hydra_plugins.hydra_submitit_launcher", "aam-seals[sweep]"),
    "ray": ("hydra_plugins.hydra_ray_launcher", "aam-seals[ray]"),
    "ray_aws": ("hydra_plugins.hydra_ray_launcher", "aam-seals[ray]"),
}
_SWEEPERS = {
    "basic": ("", ""),
    "optuna": ("hydra_plugins.hydra_optuna_sweeper", "aam-seals[sweep]"),
}


class Begun(NamedTuple):
    """Arguments of a command line, replaced by those of an interrupted sweep.

    Args:
        words: for Hydra, flags included.
        resumed: whether they are of a sweep that was begun before.
        source: the file that they come from; empty for the command line.
    """

    words: list[str]
    resumed: bool
    source: str = ""


def begun(root: str, words: Sequence[str]) -> Begun:
    """Return the arguments of an interrupted sweep on request; other commands stay unchanged.

    Args:
        root: of its jobs, such as ``run``.
        words: overrides and flags.

    Raises:
        ConfigError: there is no such sweep, it is another one, or the folder holds one already.
        MissingExtra: the launcher is not installed.
    """
    _refuse_absent(words, _LAUNCHER, _LAUNCHERS)
    _refuse_absent(words, _SWEEPER, _SWEEPERS)
    _refuse_other_places(words)
    folder = _named(words)
    if folder is not None:
        return Begun(_taken_up(root, folder, words), True, f"resume={folder}: {NOTE}")
    sweep = any(word in MULTIRUN for word in words)
    if RESUME not in words:
        return Begun(list(words), resumed=False)
    if not sweep:
        raise ConfigError(
            f"{RESUME} belongs to a sweep, and this command does not start one.\n"
            "Add --multirun, or take up one run: resume=FOLDER"
        )
    rest = [word for word in words if word != RESUME]
    folder = _stated(rest) or _newest(root, own_words(rest))
    note = _note(folder)
    if note["verb"] != root or sorted(note["words"]) != sorted(own_words(rest)):
        raise ConfigError(
            f"{folder} was started with other overrides: seals {note['verb']} "
            f"{' '.join(note['words'])}.\n"
            "Give the very same ones, or take it up by its folder alone: resume=FOLDER"
        )
    hydras = [word for word in rest if word not in own_words(rest)]
    return Begun(_going_on([*note["words"], *hydras], folder), resumed=True)


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
            f"{searching[-1]} searches for the best value of a metric, and none is given.\n"
            "Say objective=METRIC, for instance objective=success; seals runs lists them."
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


def _named(words: Sequence[str]) -> Path | None:
    """Return the sweep that ``resume=FOLDER`` names; None where it names a run, or nothing."""
    given = [word.partition("=")[2].strip("'\"") for word in words if word.startswith("resume=")]
    return Path(given[-1]) if given and is_sweep(given[-1]) else None


def _stated(words: Sequence[str]) -> Path | None:
    """Return the folder of the sweep to resume, if one is given.

    Raises:
        ConfigError: it is given by something that only Hydra can look up.
    """
    given = [word for word in words if _names_folder(word)]
    if not given:
        return None
    name = given[-1].partition("=")[2].strip("'\"")
    if "$" in name:
        raise ConfigError(
            f"{given[-1]}: with {RESUME} the folder is one that is there already.\n"
            f"Give it by its name: {_FOLDER}=FOLDER"
        )
    return Path(name)


def _names_folder(word: str) -> bool:
    return word.partition("=")[0].lstrip("+") == _FOLDER


def _newest(root: str, words: Sequence[str]) -> Path:
    """Return the newest sweep below ``runs`` that the same words began."""
    found: list[tuple[str, Path]] = []
    places = list(Path("runs").rglob(NOTE))
    for place in places:
        try:
            note = _note(place.parent)
        except ConfigError as damaged:
            # it may be anybody's
            print(f"note: passed over. {' '.join(str(damaged).split())}", file=sys.stderr)
            continue
        if note["verb"] == root and sorted(note["words"]) == sorted(words):
            found.append((note["started"], place.parent))
    if found:
        return max(found)[1]
    raise ConfigError(
        f"{RESUME}: none of the {len(places)} sweeps in runs/ was started with these overrides.\n"
        "Name its folder: resume=FOLDER, or begin the sweep without --resume."
    )


def _note(folder: Path) -> dict[str, Any]:
    """Return the record that a sweep wrote when it began."""
    try:
        if not os.path.lexists(folder / NOTE):
            raise FileNotFoundError(folder / NOTE)
        note = read_json(folder / NOTE)
        verb, words = str(note["verb"]), [str(word) for word in note["words"]]
        started = _in_utc(str(note.get("started", "")))
    except FileNotFoundError as cause:
        raise ConfigError(
            f"{folder}: there is no sweep in this folder.\n"
            f"Give the folder of one; it holds {NOTE} and jobs.csv."
        ) from cause
    except (LogError, OSError, ValueError, KeyError, TypeError) as cause:
        raise ConfigError(
            f"{folder / NOTE} is damaged: {cause}.\nRestore it, or begin anew."
        ) from (cause)
    return {"verb": verb, "words": words, "started": started}


def _in_utc(moment: str) -> str:
    """Return a time as text that sorts by time in any time zone; empty for none."""
    if not moment:
        return ""
    there = datetime.datetime.fromisoformat(moment)
    return there.astimezone(datetime.timezone.utc).isoformat(timespec="microseconds")


def _taken_up(root: str, folder: Path, words: Sequence[str]) -> list[str]:
    """Return the words of a sweep given by its folder; only the launcher may differ."""
    note = _note(folder)
    if note["verb"] != root:
        raise ConfigError(
            f"resume={folder} is a sweep of seals {note['verb']}.\n"
            f"Write: seals {note['verb']} resume={folder}"
        )
    refuse_dangerous(
        note["words"],
        where=f"resume={folder}: {NOTE}",
        remedy="Take it up by the command that began it, with --resume.",
        writer=f"sweep of seals {root}",
    )
    flags = {*MULTIRUN, RESUME}
    rest = [word for word in words if word not in flags and not word.startswith("resume=")]
    for word in rest:
        # a folder of configuration is named by a person, never by a note
        if not word.startswith((_LAUNCHER, "hydra.launcher.", "--config-dir=")):
            raise ConfigError(
                f"resume={folder}: {word} would make another sweep of it.\n"
                "Allowed beside resume: hydra/launcher=NAME, hydra.launcher.KEY=VALUE, "
                "--config-dir DIR"
            )
    return _going_on([*note["words"], *rest], folder)


def _going_on(words: Sequence[str], folder: Path) -> list[str]:
    """Add the override that runs the jobs in their old folders."""
    kept = [word for word in words if word not in MULTIRUN and not _names_folder(word)]
    # Hydra's parser takes no flag between two overrides
    kept.sort(key=lambda word: not word.startswith("-"))
    return ["--multirun", *kept, f"{_FOLDER}='{folder}'"]


def _refuse_other_places(words: Sequence[str]) -> None:
    """Refuse job folders that are not named by number: a resumed sweep could not find them."""
    for word in words:
        if word.startswith("hydra.sweep.subdir"):
            raise ConfigError(
                f"{word}: the jobs of a sweep lie in folders named by their numbers.\n"
                "Choose the folder of them all: hydra.sweep.dir=FOLDER"
            )


def _refuse_absent(words: Sequence[str], group: str, known: Mapping[str, tuple[str, str]]) -> None:
    """Refuse a launcher or sweeper whose package is not installed."""
    for word in words:
        key, _, name = word.partition("=")
        if key != group:
            continue
        if name not in known:
            kind = group.partition("/")[2]
            raise ConfigError(f"{word}: there is no {kind} '{name}'.\n{suggestion(name, known)}")
        module, extra = known[name]
        if module and not _installed(module):
            raise MissingExtra(f"{word} needs a package that is absent.\npip install '{extra}'")


def _installed(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:
        return False
