"""Rows of a CSV file that are there as soon as they are told, and once only after a resume."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from seals.errors import ConfigError
from seals.logs.atomic import write_text


class Rows:
    """Appends rows to a CSV file; each is on disk when `tell` returns.

    Args:
        path: the file.
        columns: its columns; the first is ``step``.
        upto: step of a checkpoint that is resumed: later rows of an earlier life are dropped.
            None begins a new file.
    """

    def __init__(self, path: Path, columns: Sequence[str], *, upto: int | None = None) -> None:
        """Write the head, or drop what a resumed training will tell again."""
        self.path, self.columns = path, list(columns)
        kept = [] if upto is None else _kept(path, upto)
        lines = [",".join(self.columns), *(",".join(row[c] for c in self.columns) for row in kept)]
        write_text(path, "\n".join(lines) + "\n")

    def tell(self, figures: Mapping[str, Any]) -> None:
        """Append one row; a column without a figure stays empty."""
        with self.path.open("a", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerow(
                [_cell(figures.get(column)) for column in self.columns]
            )
            file.flush()
            os.fsync(file.fileno())


def _kept(path: Path, upto: int) -> list[dict[str, str]]:
    if not path.is_file():
        return []
    try:
        text = path.read_text(encoding="utf-8")
        # a row that was cut off half-way has no end of line; its last figure may look like one
        ended = io.StringIO(text[: text.rfind("\n") + 1])
        whole = [row for row in csv.DictReader(ended) if None not in row.values()]
        return [row for row in whole if int(row["step"]) <= upto]
    except (csv.Error, ValueError, KeyError) as cause:
        raise ConfigError(
            f"{path} is damaged: {cause}.\nRestore it, or begin the training anew."
        ) from cause


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return repr(round(float(value), 9)) if isinstance(value, float) else str(value)
