"""Reader of CSV tables with a column map."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from seals.errors import LogError
from seals.field_roles import roles
from seals.logs.csv import read_csv
from seals.logs.log import Log
from seals.plugins.readers.mapped import ReaderMapped
from seals.schema import check_fields, count


@roles(data="delimiter")
@dataclass(kw_only=True)
class ReaderCsv(ReaderMapped):
    """CSV tables with a map of columns to channels, scales, units and signs.

    Channels:
        Those of the column map.
    Units:
        As declared (deg, cdeg, deg/s, g, mg, ms, us, rpm, bar, cm, ft ...), after a factor and an
        offset; an unknown unit, or one that measures another quantity than the channel, is refused.
        Pulse widths of ``motor_pwm`` stay in us.
    Limitations:
        A sign can be turned, axes can be swapped by the map; a rotation by other angles cannot.

    Args:
        delimiter: one character.
        skip_lines: lines before the header.
    """

    kind: ClassVar[str] = "CSV"

    delimiter: str = ","
    skip_lines: int = count(0, bounds=(0, 1_000_000))

    def __post_init__(self) -> None:
        check_fields(type(self), {"skip_lines": self.skip_lines}, where="reader")
        if len(self.delimiter) != 1 or self.delimiter in '\r\n"':
            raise LogError(
                f"delimiter={self.delimiter!r} is not allowed.\nAllowed: one character, such as , ;"
            )

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the one log of the file.

        Raises:
            LogError: nothing was given, or the file cannot be used.
        """
        log = read_csv(
            self.given(source),
            self.chosen(),
            delimiter=self.delimiter,
            skip_lines=self.skip_lines,
            meta=self.meta,
            name=self.name,
            licence=self.licence,
        )
        return [log]
