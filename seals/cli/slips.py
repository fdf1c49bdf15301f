"""Detection of mistyped command lines before they reach Hydra."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from seals.errors import ConfigError

_LOGS = ("calibrate", "compare", "diagnose", "verify", "plan")
"""Verbs that take a log."""


def refuse_slips(root: str, words: Sequence[str]) -> None:
    """Refuse a name without its key, and a run that would overwrite the one it repeats.

    Raises:
        ConfigError: with the words that were meant.

    Example:
        >>> refuse_slips("run", ["drop_test"])
        Traceback (most recent call last):
        seals.errors.ConfigError: drop_test: the key is missing.
        Did you mean experiment=drop_test?
    """
    before = ""
    for word in words:
        # a word after a flag may be the flag's own
        key = "" if "=" in word or before.startswith("-") else _key_of(root, word)
        if key:
            raise ConfigError(f"{word}: the key is missing.\nDid you mean {key}={word}?")
        before = "" if "=" in word else word
    if root == "run":
        _refuse_own_folder(words)


def _key_of(root: str, word: str) -> str:
    """Return the key of which a bare word is a value; empty without one."""
    from seals import registry
    from seals.config.recipes import experiments
    from seals.logs.shipped import shipped_logs

    folder = Path(word)
    if word in experiments():
        return "experiment"
    if word in registry.names("robot") or word in registry.names("animal"):
        return "robot"
    if root in _LOGS and (word in shipped_logs() or (folder / "meta.yaml").is_file()):
        return "log"
    if (folder / "robot.yaml").is_file():
        return "robot"
    return "repeat" if root == "run" and (folder / "run.json").is_file() else ""


def _refuse_own_folder(words: Sequence[str]) -> None:
    """Refuse a run folder that is the run to repeat: Hydra would overwrite its settings."""
    values = {key: value for key, _, value in (word.partition("=") for word in words)}
    own = values.get("hydra.run.dir")
    for key in ("repeat", "resume"):
        old = values.get(key)
        if own and old and Path(own).resolve() == Path(old).resolve():
            raise ConfigError(
                f"hydra.run.dir={own} is the folder of the run itself, which would be lost.\n"
                "Name another folder, or leave hydra.run.dir out: runs/DAY/TIME_NAME is new."
            )
