"""Words without a key: which folder, file or name a word is, and the key that it is a value of.

A robot, a log, a run, a diagnosis, a policy or a model is given by position or by name alike:
``seals render FOLDER`` and ``seals render run=FOLDER``.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from seals.cli.slips import refuse_cut, refuse_unknown_flags
from seals.config.overrides import joined, override, value_of
from seals.errors import ConfigError, close_names
from seals.file_names import DIAGNOSIS, RECORDINGS

_FILES: Mapping[str, tuple[str, ...]] = {
    "robot": ("robot.yaml",),
    "log": ("meta.yaml",),
    "run": ("run.json",),
    "repeat": ("run.json",),
    "diagnosis": (DIAGNOSIS,),
    "policy": ("card.json",),
    "resume": (".hydra/overrides.yaml",),
    "folder": (".",),
}
"""Files of which a folder has one, by the key that it is a value of."""
_ENDINGS: Mapping[str, tuple[str, ...]] = {
    "log": (*RECORDINGS, ".csv", ".txt", ".gz", ".parquet"),
    "script": (".yaml", ".yml", ".csv"),
    "experiment": (".yaml", ".yml"),
    "model": (".yaml", ".yml"),
    "diagnosis": (".json",),
    "urdf": (".urdf", ".xacro", ".sdf", ".xml", ".mjcf"),
}
"""Endings of files, by key."""
_NOUNS = {"repeat": "run", "resume": "training"}
"""What a value is, where the key does not say it."""
_NUMBER = re.compile(r"[-+]?[\d.]+(e[-+]?\d+)?|\[.*\]|true|false")
"""What follows a key that stands apart from its value."""
_MANY = ("log",)
"""Keys that take a list."""


def with_keys(verb: str, takes: Sequence[str], words: Sequence[str]) -> list[str]:
    """Return the words of a verb, each with its key.

    Args:
        verb: that the words follow.
        takes: keys of which the verb takes values without them, the likeliest first.
        words: of the command line.

    Raises:
        ConfigError: a word is no value of these keys, or a key is given twice.

    Example:
        >>> with_keys("run", ("robot", "experiment"), ["ball", "seed=1"])
        ['robot=ball', 'seed=1']
    """
    if not takes:
        return list(words)
    if any(word.startswith("=") for word in words):
        raise ConfigError(
            f"{' '.join(words)}: '=' is separated from its key.\nWrite it without spaces: KEY=VALUE"
        )
    refuse_cut(words)
    _refuse_drawing(verb, words)
    refuse_unknown_flags(joined(words))
    found: list[str] = []
    lists: dict[str, list[str]] = {}
    whole = joined(words)
    for word, after in itertools.zip_longest(whole, whole[1:], fillvalue=""):
        if "=" in word or not word or word.startswith(("-", "~")):
            found.append(word)
            continue
        key = key_among(takes, word) or _unseen(verb, takes, word, after)
        given = value_of(words, key)
        if given is not None or (key in lists and key not in _MANY):
            other = lists[key][0] if given is None else given
            raise ConfigError(f"{key} is given twice: {other} and {word}.\nLeave one of them out.")
        lists.setdefault(key, []).append(word)
    values = {key: many[0] if len(many) == 1 else many for key, many in lists.items()}
    return [*(override(key, value) for key, value in values.items()), *found]


def _refuse_drawing(verb: str, words: Sequence[str]) -> None:
    """Refuse a URDF where a robot is wanted.

    Raises:
        ConfigError: with the command that makes a robot of it.
    """
    for word, after in itertools.zip_longest(words, words[1:], fillvalue=""):
        key, _, value = word.partition("=")
        if key.lstrip("-") == "urdf":
            raise ConfigError(
                f"{word}: seals {verb} needs a robot folder, not a URDF.\n"
                f"Create one from the file: seals new robot NAME urdf={value or after or 'FILE'}"
            )


def key_among(takes: Iterable[str], word: str) -> str:
    """Return the first key of which a name, a file or a folder that is there is a value, or ''.

    Example:
        >>> key_among(("robot", "experiment"), "drop_test"), key_among(("robot",), "no_such")
        ('experiment', '')
    """
    place = Path(word)
    for key in takes:
        held = any((place / name).exists() for name in _FILES.get(key, ())) and place.is_dir()
        if held or place.suffix in _ENDINGS.get(key, ()) or word in names_of(key):
            return key
    return ""


def names_of(key: str) -> list[str]:
    """Return the names that may be given for a key, but for files and folders.

    Example:
        >>> "ball" in names_of("robot"), names_of("out")
        (True, [])
    """
    from seals import registry
    from seals.config.overlay import overlay_names
    from seals.config.roots import recipe_groups
    from seals.config.source import robot_names
    from seals.learn.shipped import shipped
    from seals.logs.shipped import shipped_logs

    special: Mapping[str, Callable[[], list[str]]] = {
        "robot": robot_names,
        "model": overlay_names,
        "log": lambda: [*shipped_logs()],
        "policy": lambda: ["scripted", "random", "still", *shipped()],
    }
    if key in special:
        return special[key]()
    kinds = registry.names(key) if key in registry.GROUPS else []
    return [*kinds, *(path.stem for path in recipe_groups().get(key, []))]


def _unseen(verb: str, takes: Sequence[str], word: str, after: str = "") -> str:
    """Return the key of a word that nothing here has the name of, where there is but one.

    Raises:
        ConfigError: it may be meant for several keys, or for none.
    """
    if len(takes) == 1 or Path(word).exists():
        return takes[0]
    stem = word.partition(":")[0]
    if stem != word and stem.replace(".", "").isidentifier():
        raise ConfigError(
            f"{word}: a key and its value are joined by '='.\n"
            f"Did you mean {word.replace(':', '=', 1)}?"
        )
    near = [f"{key}={name}" for key in takes for name in close_names(word, names_of(key))]
    *nouns, last = (_NOUNS.get(key, key) for key in takes)
    hints = [f"Did you mean {' or '.join(near[:4])}?"] if near else []
    if re.fullmatch(r"[A-Za-z_][\w.]*", word):
        value = after if _NUMBER.fullmatch(after) else "VALUE"
        hints.append(f"If it is a key, give its value: {word}={value}.")
    elif not near:
        hints.append("Give an existing folder or file, or a name.")
    raise ConfigError(
        f"{word}: no {', '.join(nouns)} or {last} has this name, and there is no such file here.\n"
        f"{'  '.join(hints)}  See: seals help {verb}"
    )
