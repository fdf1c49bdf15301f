"""Columns of recordings by topic and field, and their merge into one log."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, suggestion
from seals.logs.column_map import ColumnMap
from seals.logs.log import Log
from seals.logs.merge import Stream, merge


def by_topic(chosen: ColumnMap) -> dict[str, dict[str, str]]:
    """Return the wanted fields of each topic: topic -> field -> column of the log.

    Raises:
        LogError: a key has no topic, names the time, or a unit belongs to nothing.

    Example:
        >>> by_topic(ColumnMap(columns={"/imu/orientation.x": "orientation_x"}))
        {'/imu': {'orientation.x': 'orientation_x'}}
    """
    found: dict[str, dict[str, str]] = {}
    for key, column in chosen.columns.items():
        topic, _, field = key.rpartition("/")
        if not topic or not field:
            raise LogError(f"columns: '{key}' names no field.\nWrite TOPIC/FIELD: column.")
        if column in ("t", "segment"):
            raise LogError(f"columns: '{key}' cannot be '{column}': it comes from the stamps.")
        found.setdefault(topic, {})[field] = column
    chosen.refuse_stray()
    return found


def refuse_unknown(wanted: Iterable[str], present: Collection[str], *, where: str) -> None:
    """Refuse topics that the file does not hold.

    Raises:
        LogError: one is absent.
    """
    for name in wanted:
        if name not in present:
            raise LogError(
                f"'{where}' has no topic '{name}'.\n" + suggestion(name, present, label="Topics")
            )


def vector(stem: str, values: Floats) -> dict[str, Floats]:
    """Return the columns of a vector channel, from shape (samples, 3)."""
    return {f"{stem}_{axis}": values[:, k] for k, axis in enumerate("xyz")}


def finished(
    streams: Sequence[Stream], path: Path, *, meta: Mapping[str, Any], name: str, licence: str
) -> Log:
    """Return the one log of a recording; columns without a single sample are left out.

    Raises:
        LogError: nothing usable is in it.
    """
    held = [
        Stream(
            name=stream.name,
            stamps=stream.stamps,
            columns={
                key: values
                for key, values in stream.columns.items()
                if bool(np.isfinite(values).any())
            },
        )
        for stream in streams
    ]
    columns, start = merge(held, where=str(path))
    return Log(
        name=name or path.name.split(".")[0],
        columns=columns,
        meta={"recording": {"file": path.name, "start": start * 1e-6}, **meta},
        source=str(path),
        licence=licence,
    )
