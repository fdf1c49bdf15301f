"""Append-only CSV writer: flushed per row, de-duplicated on resume."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, LogError
from seals.logs.atomic import write_text
from seals.untrusted_io import MOST_BYTES, read_text


class Rows:
    """Append-only CSV table; a row is on disk when `append` returns.

    Args:
        path: the file.
        columns: its columns; the first is ``step``.
        keep: rows that stood there at the checkpoint that is resumed: later ones of an earlier life
            are dropped. A file that is not there begins anew.

    Attributes:
        count: rows so far.

    Raises:
        ConfigError: the file is there and does not hold the rows to keep.
    """

    def __init__(self, path: Path, columns: Sequence[str], *, keep: int = 0) -> None:
        """Write the header, or drop rows that a resumed training will repeat."""
        self.path, self.columns = path, list(columns)
        # the step does not tell: a checkpoint may stand before or behind the row of its own step
        kept = _kept(path, keep) if keep and path.is_file() else []
        self.count = len(kept)
        lines = [",".join(self.columns), *(",".join(row[c] for c in self.columns) for row in kept)]
        write_text(path, "\n".join(lines) + "\n")

    def append(self, figures: Mapping[str, Any]) -> None:
        """Append one row; missing values stay empty."""
        with self.path.open("a", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerow(
                [_cell(figures.get(column)) for column in self.columns]
            )
            file.flush()
            os.fsync(file.fileno())
        self.count += 1


def _kept(path: Path, keep: int) -> list[dict[str, str]]:
    try:
        text = read_text(path, most=MOST_BYTES)
        # a row that was cut off half-way has no end of line; its last figure may look like one
        ended = io.StringIO(text[: text.rfind("\n") + 1])
        whole = [row for row in csv.DictReader(ended) if None not in row.values()][:keep]
        for row in whole:
            int(row["step"])
    except (OSError, csv.Error, ValueError, KeyError, LogError) as cause:
        raise _damaged(path, str(cause)) from cause
    if len(whole) < keep:
        raise _damaged(path, f"{len(whole)} of {keep} rows are whole")
    return whole


def _damaged(path: Path, why: str) -> ConfigError:
    return ConfigError(f"{path} is damaged: {why}.\nRestore it, or begin the training anew.")


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return repr(round(float(value), 9)) if isinstance(value, float) else str(value)
