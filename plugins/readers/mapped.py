"""Base of readers whose columns a map chooses."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from seals.errors import LogError
from seals.field_roles import roles
from seals.logs.column_map import ColumnMap


@roles(data="columns units scale offset negate meta name licence", read="path")
@dataclass(kw_only=True)
class ReaderMapped:
    """Base of readers with a map: where, which columns, in which units.

    Args:
        path: the file, plain or ``.gz``.
        columns: column of the file -> column of the log.
        units: column of the file -> its unit; left out, SI.
        scale: column of the file -> factor of its numbers, before the unit.
        offset: column of the file -> what is added after the factor, in the unit.
        negate: columns of the file whose sign is turned.
        meta: what is known of vehicle and sensors, as in ``meta.yaml``.
        name: name of the log.
        licence: licence of the data.
    """

    kind: ClassVar[str]

    path: str = ""
    columns: dict[str, str] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    scale: dict[str, float] = field(default_factory=dict)
    offset: dict[str, float] = field(default_factory=dict)
    negate: list[str] = field(default_factory=list)
    meta: dict[str, Any] = field(default_factory=dict)
    name: str = ""
    licence: str = ""

    def given(self, source: str | Path | None) -> Path:
        """Return what is to be read.

        Raises:
            LogError: nothing was given.
        """
        found = source or self.path
        if not found:
            raise LogError(
                f"the {self.kind} reader needs a file.\nGive it: log=FILE, in Python path=FILE."
            )
        return Path(found)

    def chosen(self) -> ColumnMap:
        """Return the map.

        Raises:
            LogError: it contradicts itself.
        """
        return ColumnMap(
            columns=self.columns,
            units=self.units,
            scale=self.scale,
            offset=self.offset,
            negate=self.negate,
        )
