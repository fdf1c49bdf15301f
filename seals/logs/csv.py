"""Conversion of a table to a log: channel, scale, unit and sign of each column."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError
from seals.logs.clock import CLOCK, in_seconds, tell
from seals.logs.column_map import ColumnMap
from seals.logs.log import Log
from seals.logs.table import read_csv_columns

_TIMES = re.compile(
    r"(time|stamp|sec|clock|date)\w*|\w*(time|stamp)s?|t_?(s|ms|us)?", re.IGNORECASE
)
"""Names that columns of time have."""


def read_csv(
    path: str | Path,
    chosen: ColumnMap,
    *,
    delimiter: str = ",",
    skip_lines: int = 0,
    meta: Mapping[str, Any] | None = None,
    name: str = "",
    licence: str = "",
) -> Log:
    """Read a CSV file with a column map.

    Args:
        path: the file, plain or ``.gz``.
        chosen: what becomes of its columns (``t``, ``specific_force_z``, ``segment`` ...); an empty
            map takes every column of numbers under its own name. Stamps that can only be in ns, us
            or ms, and dates, are converted, and that is said.
        delimiter: one character between values.
        skip_lines: lines before the header.
        meta: what is known of vehicle and sensors.
        name: name of the log; left out, that of the file.
        licence: licence of the data.

    Raises:
        LogError: a column is missing, a unit unknown, or the file damaged.
    """
    wanted = chosen.columns or None
    clock = next((theirs for theirs, ours in chosen.columns.items() if ours == "t"), "t")
    raw = read_csv_columns(
        path, delimiter=delimiter, skip_lines=skip_lines, wanted=wanted, clock=clock
    )
    return log_of_columns(path, raw, chosen, meta=meta, name=name, licence=licence)


def log_of_columns(
    path: str | Path,
    raw: Mapping[str, Floats],
    chosen: ColumnMap,
    *,
    meta: Mapping[str, Any] | None = None,
    name: str = "",
    licence: str = "",
) -> Log:
    """Return a log of columns of one clock.

    Args:
        path: the file, for messages.
        raw: column of the file -> its numbers, each of shape (rows,).
        chosen: map of the columns; an empty one takes every column under its own name.
        meta: what is known of vehicle and sensors.
        name: name of the log; left out, that of the file.
        licence: licence of the data.

    Raises:
        LogError: no column is the time, a unit is unknown, or a segment is not numbered.
    """
    chosen = replace(chosen, columns=chosen.columns or {theirs: theirs for theirs in raw})
    mapping = chosen.columns
    if "t" not in mapping.values():
        raise LogError(
            f"'{path}': no column is mapped to the time 't' [s].\n{_map_draft([*mapping])}"
        )
    chosen.refuse_stray()
    clock = next(theirs for theirs, ours in mapping.items() if ours == "t")
    ready = {ours: chosen.converted(raw[theirs], theirs, ours) for theirs, ours in mapping.items()}
    segment = ready.pop("segment", np.zeros(0))
    if len(ready) < 2:
        raise LogError(f"'{path}' has no column of numbers except the time.")
    # beyond 2^53 a float tells no whole numbers apart
    if not np.all((np.abs(segment) < 2.0**53) & (segment == np.round(segment))):
        raise LogError(f"'{path}': the segment column must contain an integer in every row.")
    title, known = name or Path(path).name.split(".")[0], dict(meta or {})
    if not any(clock in entry for entry in (chosen.units, chosen.scale, chosen.offset)):
        ready["t"], found = in_seconds(ready["t"], segment, named=clock, channels=ready)
        known |= {CLOCK: found} if found else {}
        tell(title, found)
    return Log(
        name=title,
        columns=ready,
        segment=segment.astype(np.int64),
        meta=known,
        source=str(path),
        licence=licence,
    )


def _map_draft(names: Sequence[str]) -> str:
    """Return the begin of a map of columns, with the one that looks like the time.

    Example:
        >>> _map_draft(["Time", "gx"]).partition(", NAME")[0]
        'Name the columns in a file, map=FILE.yaml:  reader: csv, columns: {Time: t'
    """
    clock = next((name for name in names if _TIMES.fullmatch(name)), "NAME_OF_TIME")
    shown = ", ".join(names[:24])
    return (
        f"Name the columns in a file, map=FILE.yaml:  reader: csv, columns: {{{clock}: t, NAME: "
        "position_x, NAME: angular_velocity_x, ...}  (docs/logs.md, A map).  "
        f"Columns there: {shown}"
    )
