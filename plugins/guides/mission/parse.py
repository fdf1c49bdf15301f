"""Parser of the stages of a mission from YAML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from seals.errors import ConfigError, refuse_unlisted, suggestion
from seals.plugins.guides.mission.stages import (
    Close,
    Go,
    Land,
    Open,
    Pose,
    ReachStage,
    Rise,
    Stage,
    Wait,
)
from seals.schema import read

KINDS: Mapping[str, type[Stage]] = {
    "rise": Rise,
    "go": Go,
    "reach": ReachStage,
    "pose": Pose,
    "close": Close,
    "open": Open,
    "wait": Wait,
    "land": Land,
}
"""Stages by the word after ``do:``."""


def stages_of(rows: Sequence[Any], *, where: str = "stages") -> tuple[Stage, ...]:
    """Return the stages that a list describes.

    Args:
        rows: mappings with ``do`` and the values of that stage.
        where: key of the list, named in the messages.

    Raises:
        ConfigError: a stage is unknown, or a value of it.

    Example:
        >>> stages_of([{"do": "rise", "height": 2.0}])[0].height
        2.0
    """
    return tuple(_stage(row, f"{where}[{k}]") for k, row in enumerate(rows))


def _stage(row: Any, where: str) -> Stage:
    values = read(dict[str, Any], row, where=where)
    word = str(values.pop("do", ""))
    if not word:
        raise ConfigError(
            f"{where}={row} does not say what to do.\n"
            f"Write for instance {{do: rise, height: 1.0}}.  {suggestion('', KINDS)}"
        )
    refuse_unlisted(word, KINDS, f"{where}.do={word} is not a stage")
    return read(KINDS[word], {"name": word, **values}, where=where)
