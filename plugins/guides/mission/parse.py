"""Parser of the stages of a mission from YAML."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from seals.errors import ConfigError, suggestion
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
from seals.schema import check_fields

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
    if not isinstance(row, Mapping) or "do" not in row:
        raise ConfigError(
            f"{where}={row} does not say what to do.\n"
            f"Write for instance {{do: rise, height: 1.0}}.  {suggestion('', KINDS)}"
        )
    word = str(row["do"])
    if word not in KINDS:
        raise ConfigError(f"{where}.do={word} is not a stage.\n{suggestion(word, KINDS)}")
    cls, values = KINDS[word], {str(k): v for k, v in row.items() if k != "do"}
    fields = {f.name: f for f in dataclasses.fields(cls)}
    for key, value in values.items():
        if key not in fields:
            raise ConfigError(
                f"{where}.{key}: '{key}' is not a key of the stage '{word}'.\n"
                f"{suggestion(key, fields)}"
            )
        if fields[key].type == "float" and isinstance(value, int):
            values[key] = float(value)
        if str(fields[key].type).startswith("list"):
            _refuse_no_list(value, f"{where}.{key}", 3 if key == "to" else None)
    check_fields(cls, values, where=where)
    return cls(**{"name": word, **values})


def _refuse_no_list(value: Any, where: str, length: int | None) -> None:
    numbers = isinstance(value, Sequence) and all(
        isinstance(x, int | float) and not isinstance(x, bool) for x in value
    )
    if not numbers or (length is not None and len(value) != length):
        need = "a list of numbers" if length is None else f"{length} numbers"
        raise ConfigError(f"{where}={value} is not allowed.\nAllowed: {need}.")
