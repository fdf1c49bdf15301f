"""Detection of mistyped command lines before they reach Hydra."""

from __future__ import annotations

import difflib
import itertools
from collections.abc import Sequence
from pathlib import Path

from seals.config.overrides import value_of
from seals.config.strangers import TRUST
from seals.errors import ConfigError, suggestion

_ALIKE = 0.8
"""Likeness from which a flag is a mistyped one [1]."""
_FOLDERS = ("hydra.run.dir=", "hydra.sweep.dir=")
"""Output folders without a value, which Hydra takes for the present folder."""

RESUME = "--resume"
_FLAGS = (
    "--multirun",
    RESUME,
    "--cfg",
    "--resolve",
    "--package",
    "--config-dir",
    "--config-path",
    "--config-name",
    "--info",
    "--help",
    "--hydra-help",
    "--version",
    TRUST,
)
"""Flags of the verbs that Hydra composes."""
_RUNS = ("run", "train", "teleop", "autopilot")
"""Verbs of which all output goes to the run folder."""


def with_folder(root: str, words: Sequence[str], *, several: bool) -> list[str]:
    """Return the words with ``out=FOLDER`` as the folder of the run, as other verbs call it.

    Args:
        root: the verb.
        words: of the command line.
        several: whether it is a sweep.

    Example:
        >>> with_folder("run", ["out=drop"], several=False)
        ['hydra.run.dir=drop']
    """
    if root not in _RUNS:
        return list(words)
    key = _FOLDERS[several]
    return [
        key + w.removeprefix("out=") if w.startswith("out=") and w != "out=" else w for w in words
    ]


def question(words: Sequence[str]) -> list[str]:
    """Return the words of ``seals plan`` with the effects in question under their key.

    ``effects.NAME.FIELD=`` are those of the robot, as for other verbs.

    Raises:
        ConfigError: the key is mistyped.

    Example:
        >>> question(["effects=wind,tether", "effects.air_drag.coefficient_x=0"])
        ['between=[wind,tether]', 'effects.air_drag.coefficient_x=0']
    """
    for word in words:
        if word.startswith("effect="):
            better = word.replace("=", "s=", 1)
            raise ConfigError(f"{word}: there is no key 'effect'.\nDid you mean {better}?")
    own = "effects="
    return [
        f"between=[{w.removeprefix(own).strip('[]')}]" if w.startswith(own) else w for w in words
    ]


def folder_key(root: str, *, several: bool) -> str:
    """Return the key of the folder of a run, or of a sweep, as its user says it.

    Example:
        >>> folder_key("run", several=False), folder_key("evaluate", several=True)
        ('out', 'hydra.sweep.dir')
    """
    return "out" if root in _RUNS else _FOLDERS[several].removesuffix("=")


def refuse_slips(root: str, words: Sequence[str]) -> None:
    """Refuse an output folder without a name, and a run that would overwrite the one it repeats.

    Raises:
        ConfigError: with the words that were meant.

    Example:
        >>> refuse_slips("run", ["out="])
        Traceback (most recent call last):
        seals.errors.ConfigError: out= does not name a folder; the files here would be overwritten.
        Give one: out=FOLDER, or leave it out: runs/DAY/TIME_NAME is new.
    """
    for word in words:
        if word in (*_FOLDERS, "out="):
            raise ConfigError(
                f"{word} does not name a folder; the files here would be overwritten.\n"
                f"Give one: {word}FOLDER, or leave it out: runs/DAY/TIME_NAME is new."
            )
    own = value_of(words, "hydra.run.dir")
    for old in (value_of(words, "repeat"), value_of(words, "resume")):
        if root == "run" and own and old and Path(own).resolve() == Path(old).resolve():
            # Hydra would overwrite its settings
            raise ConfigError(
                f"out={own} is the folder of the run itself, which would be lost.\n"
                "Name another folder, or leave out= away: runs/DAY/TIME_NAME is new."
            )


def refuse_cut(words: Sequence[str]) -> None:
    """Refuse a value that the shell cut at its blanks.

    Raises:
        ConfigError: with the word in quotes.

    Example:
        >>> refuse_cut(["initial.position=[0,", "0,", "1]", "robot=ball"])
        Traceback (most recent call last):
        seals.errors.ConfigError: initial.position=[0, ends inside its brackets.
        Quote a value with spaces: 'initial.position=[0, 0, 1]'
    """
    for k, word in enumerate(words):
        wholes = (" ".join(words[k:end]) for end in range(k + 1, len(words) + 1))
        whole = next(
            (w for w in wholes if all(w.count(a) <= w.count(b) for a, b in ("[]", "{}"))), word
        )
        if whole != word and "=" in word:
            raise ConfigError(
                f"{word} ends inside its brackets.\nQuote a value with spaces: '{whole}'"
            )


def refuse_unknown_flags(words: Sequence[str]) -> None:
    """Refuse flags that there are not: Hydra would take abbreviations of its own.

    Args:
        words: as they were written.

    Raises:
        ConfigError: with the value that was meant, or the nearest flag.

    Example:
        >>> refuse_unknown_flags(["--robot", "auv"])
        Traceback (most recent call last):
        seals.errors.ConfigError: --robot: there is no flag --robot.
        Values have no dashes: write robot=auv
    """
    for word, after in itertools.zip_longest(words, words[1:], fillvalue=""):
        flag, _, value = word.partition("=")
        if not flag.startswith("-") or len(flag) < 3 or flag in _FLAGS:
            continue
        if not value and "=" not in after and not after.startswith("-"):
            value = after
        hint = f"Values have no dashes: write {flag.lstrip('-')}={value or 'VALUE'}"
        if difflib.get_close_matches(flag, _FLAGS, cutoff=_ALIKE):
            hint = suggestion(flag, _FLAGS)
        raise ConfigError(f"{word}: there is no flag {flag}.\n{hint}")


def repeated_keys(words: Sequence[str]) -> list[str]:
    """Return a remark for each key that the words give several values; the last value holds.

    Example:
        >>> repeated_keys(["robot=ball", "seed=1", "robot=box", "seed=1"])
        ['robot is given 2 values; the last one is used: robot=box']
        >>> repeated_keys(["arg=mass=1", "arg=size=2"])
        []
    """
    if "--compare" in words:
        # names of arms
        return []
    values: dict[str, list[str]] = {}
    for word in words:
        key, sign, value = word.lstrip("+").partition("=")
        if key in ("arg", "package"):  # arg=NAME=VALUE: each name is a key of its own
            name, _, value = value.partition("=")
            key = f"{key}={name}"
        if sign and not word.startswith("-"):
            values.setdefault(key, []).append(value)
    return [
        f"{key} is given {len(set(given))} values; the last one is used: {key}={given[-1]}"
        for key, given in values.items()
        if len(set(given)) > 1
    ]
