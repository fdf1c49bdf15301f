"""Columns of recordings by topic and field, and their merge into one log."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, suggestion
from seals.logs.channels import unit_of
from seals.logs.log import Log
from seals.logs.merge import Stream, merge
from seals.logs.units import to_si


def by_topic(
    columns: Mapping[str, str], units: Mapping[str, str], negate: Collection[str]
) -> dict[str, dict[str, str]]:
    """Return the wanted fields of each topic: topic -> field -> column of the log.

    Raises:
        LogError: a key has no topic, a column is chosen twice, or a unit belongs to nothing.

    Example:
        >>> by_topic({"/imu/orientation.x": "orientation_x"}, {}, [])
        {'/imu': {'orientation.x': 'orientation_x'}}
    """
    found: dict[str, dict[str, str]] = {}
    for key, column in columns.items():
        topic, _, field = key.rpartition("/")
        if not topic or not field:
            raise LogError(f"columns: '{key}' names no field.\nWrite TOPIC/FIELD: column.")
        if column in ("t", "segment"):
            raise LogError(f"columns: '{key}' cannot be '{column}': it comes from the stamps.")
        found.setdefault(topic, {})[field] = column
    targets = list(columns.values())
    twice = sorted({column for column in targets if targets.count(column) > 1})
    if twice:
        raise LogError(f"columns: two fields are mapped to {', '.join(twice)}.\nKeep one of them.")
    for key in (*units, *negate):
        if key not in columns:
            raise LogError(
                f"units or negate name '{key}', which is not mapped.\n"
                + suggestion(key, columns, label="Mapped")
            )
    return found


def converted(
    values: Floats, key: str, column: str, *, units: Mapping[str, str], negate: Collection[str]
) -> Floats:
    """Return the values of a chosen field in the unit and with the sign of its column."""
    if key in units:
        values = to_si(values, units[key], expected=unit_of(column), where=f"'{key}'")
    return -values if key in negate else values


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
