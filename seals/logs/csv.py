"""Conversion of a CSV table to a log: channel, unit and sign of each column."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, suggestion
from seals.logs.channels import unit_of
from seals.logs.clock import CLOCK, in_seconds, tell
from seals.logs.log import Log
from seals.logs.table import read_csv_columns
from seals.logs.units import to_si


def read_csv(
    path: str | Path,
    *,
    columns: Mapping[str, str],
    units: Mapping[str, str] | None = None,
    negate: Collection[str] = (),
    delimiter: str = ",",
    skip_lines: int = 0,
    meta: Mapping[str, Any] | None = None,
    name: str = "",
    licence: str = "",
) -> Log:
    """Read a CSV file with a column map.

    Args:
        path: the file, plain or ``.gz``.
        columns: column of the file -> column of the log (``t``, ``specific_force_z``, ``segment``);
            empty takes every column of numbers under its own name.
        units: column of the file -> unit it is written in; left out, SI. Stamps that can only be
            in ns, us or ms, and dates, are converted, and that is said.
        negate: columns of the file whose sign is turned, as y and z of a body frame with z down.
        delimiter: one character between values.
        skip_lines: lines before the header.
        meta: what is known of vehicle and sensors.
        name: name of the log; left out, that of the file.
        licence: licence of the data.

    Raises:
        LogError: a column is missing, a unit unknown, or the file damaged.
    """
    wanted = columns or None
    clock = next((theirs for theirs, ours in columns.items() if ours == "t"), "t")
    raw = read_csv_columns(
        path, delimiter=delimiter, skip_lines=skip_lines, wanted=wanted, clock=clock
    )
    mapping = columns or {theirs: theirs for theirs in raw}
    _check_map(path, mapping, {**(units or {}), **dict.fromkeys(negate, "")})
    ready = _convert(raw, mapping, units or {}, negate)
    segment = ready.pop("segment", np.zeros(0))
    if len(ready) < 2:
        raise LogError(f"'{path}' holds no column of numbers besides the time.")
    if not np.all(np.isfinite(segment)):
        raise LogError(f"'{path}': the segment column must hold a whole number in every row.")
    title, known = name or Path(path).name.split(".")[0], dict(meta or {})
    if clock not in (units or {}):
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


def _convert(
    raw: Mapping[str, Floats],
    mapping: Mapping[str, str],
    units: Mapping[str, str],
    negate: Collection[str],
) -> dict[str, Floats]:
    ready: dict[str, Floats] = {}
    for theirs, ours in mapping.items():
        values = raw[theirs]
        if theirs in units:
            expected = unit_of(ours)
            values = to_si(values, units[theirs], expected=expected, where=f"column '{theirs}'")
        ready[ours] = -values if theirs in negate else values
    return ready


def _check_map(path: str | Path, mapping: Mapping[str, str], mentioned: Mapping[str, str]) -> None:
    if "t" not in mapping.values():
        raise LogError(
            f"'{path}': no column is mapped to the time 't' [s].\nSay which: columns={{name: t}}. "
            + suggestion("t", mapping, label="Mapped now")
        )
    targets = list(mapping.values())
    twice = {ours for ours in targets if targets.count(ours) > 1}
    if twice:
        raise LogError(f"'{path}': two columns are mapped to {', '.join(sorted(twice))}.")
    for theirs in mentioned:
        if theirs not in mapping:
            raise LogError(
                f"'{path}': units or negate name the column '{theirs}', which is not mapped.\n"
                + suggestion(theirs, mapping, label="Mapped")
            )
