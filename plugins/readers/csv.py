"""Reader of CSV tables with a column map."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from seals.errors import LogError
from seals.field_roles import roles
from seals.logs.csv import read_csv
from seals.logs.log import Log


@roles(data="columns units negate delimiter meta name licence", read="path")
@dataclass(kw_only=True)
class ReaderCsv:
    """CSV tables with a map of columns to channels, units and signs.

    Channels:
        Those of the column map.
    Units:
        As declared (deg, deg/s, g, ms, us, rpm, bar, cm, ft ...); an unknown unit, or one that
        measures another quantity than the channel, is refused.
    Limitations:
        A sign can be turned, axes can be swapped by the map; a rotation by other angles cannot.

    Args:
        path: the file, plain or ``.gz``.
        columns: column of the file -> column of the log.
        units: column of the file -> its unit.
        negate: columns of the file whose sign is turned.
        delimiter: one character.
        skip_lines: lines before the header.
        meta: what is known of vehicle and sensors, as in ``meta.yaml``.
        name: name of the log.
        licence: licence of the data.
    """

    path: str = ""
    columns: dict[str, str] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    negate: list[str] = field(default_factory=list)
    delimiter: str = ","
    skip_lines: int = 0
    meta: dict[str, Any] = field(default_factory=dict)
    name: str = ""
    licence: str = ""

    def __post_init__(self) -> None:
        if len(self.delimiter) != 1 or self.delimiter in '\r\n"':
            raise LogError(
                f"delimiter={self.delimiter!r} is not allowed.\nAllowed: one character, such as , ;"
            )
        if self.skip_lines < 0:
            raise LogError(f"skip_lines={self.skip_lines} is not allowed.\nAllowed: 0 or more.")

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the one log of the file.

        Raises:
            LogError: nothing was given, or the file cannot be used.
        """
        given = source or self.path
        if not given:
            raise LogError("the CSV reader needs a file.\nGive it: log=FILE, in Python path=FILE.")
        log = read_csv(
            given,
            columns=self.columns,
            units=self.units,
            negate=self.negate,
            delimiter=self.delimiter,
            skip_lines=self.skip_lines,
            meta=self.meta,
            name=self.name,
            licence=self.licence,
        )
        return [log]
