"""Truth and answers of a log: reading, and what is right as a whole."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, LogError
from seals.untrusted_io import read_json, read_yaml

REFUSED = ("none_of_these", "cannot_tell", "ambiguous", "bad_data")
SIDE = {"linear_drag": {"angular_drag"}, "quadratic_drag": {"angular_drag"}}
"""What a hidden drag really does besides: naming it is neither asked for nor wrong."""


def named(answer: Mapping[str, Any]) -> set[str]:
    """Return the effects that an answer declares: those of a set that it leaves open, it does not.

    Args:
        answer: ``verdict`` and ``effects`` in the form of ``diagnosis.json``.
    """
    if answer["verdict"] != "named":
        return set()
    return {str(effect["name"]) for effect in answer["effects"]}


def right(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> bool:
    """Return whether an answer is right as a whole.

    A log whose effect is outside the library asks for ``none_of_these``, one without an effect for
    ``nothing_missing``, all others for the hidden names and no other.
    """
    want = {str(effect["name"]) for effect in truth["effects"]}
    if not truth["in_library"]:
        return bool(answer["verdict"] == "none_of_these")
    if not want:
        return bool(answer["verdict"] == "nothing_missing")
    return named(answer) - beside(want) == want


def beside(want: set[str]) -> set[str]:
    """Return the names that are neither asked for nor wrong."""
    return set().union(*(SIDE.get(name, set()) for name in want)) - want


def read_truth(folder: Path) -> dict[str, Any]:
    """Read what is hidden in one of the public logs."""
    return read_yaml(folder / "truth.yaml")


def read_answer(path: Path) -> dict[str, Any]:
    """Read an answer.

    Raises:
        ConfigError: it is no answer in the form of ``diagnosis.json``.
    """
    try:
        found: dict[str, Any] = read_json(path)
        _ = found["verdict"], [effect["name"] for effect in found["effects"]]
    except (LogError, KeyError, TypeError) as cause:
        raise ConfigError(
            f"{path} is no answer: {cause!r}.\n"
            'It holds {"verdict": "named", "effects": [{"name": "wind"}]}, or one of the verdicts '
            f"nothing_missing, {', '.join(REFUSED)} and no effect."
        ) from cause
    return found
