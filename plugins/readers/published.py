"""Base of readers of published data sets, and tables of them as maps of columns."""

from __future__ import annotations

import copy
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from seals.arrays import Floats
from seals.errors import LogError, refuse_unlisted
from seals.field_roles import roles
from seals.logs.datasets import Dataset, paths_of
from seals.logs.log import Log


@roles(read="path")
@dataclass(kw_only=True)
class ReaderPublished:
    """Base of readers of a published data set, one log for each of its files.

    Args:
        path: a file, a folder that holds published ones, or the stem of one of them.
    """

    dataset: ClassVar[Dataset]

    path: str = ""

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return one log for each file.

        Raises:
            LogError: a file is absent, damaged, or lacks what the set has.
        """
        return [self.log_of(path) for path in paths_of(self.dataset, source or self.path or None)]

    def log_of(self, path: Path) -> Log:
        """Return the log of one file."""
        raise NotImplementedError

    def described(
        self, name: str, columns: Mapping[str, Floats], *, of: Path | None = None, **more: Any
    ) -> Log:
        """Return a log with source, licence and description of the data set.

        Args:
            name: of the log.
            columns: of the log.
            of: its file, which may be one's own where no published one has the log's name: then
                its path is the source, and there is no licence.
            more: other arguments of a log; ``meta`` is added to that of the set.
        """
        own = of is not None and name not in {file.stem for file in self.dataset.files}
        return Log(
            name=name,
            columns=columns,
            meta=copy.deepcopy(dict(self.dataset.meta)) | more.pop("meta", {}),
            source=str(of) if own else self.dataset.source,
            licence="" if own else self.dataset.licence,
            **more,
        )


def refuse_lacking(
    path: Path, needed: Collection[str], table: Collection[str], what: str = "", **words: Any
) -> None:
    """Refuse a table that lacks a column.

    Args:
        path: of the table.
        needed: columns.
        table: columns that are there.
        what: the table is then not, for the message.
        words: see `suggestion`.

    Raises:
        LogError: one is absent; the nearest name is told.
    """
    for name in needed:
        tail = f": it is no {what}" if what else ""
        lacking = f"'{path}' has no column '{name}'{tail}"
        refuse_unlisted(name, table, lacking, error=LogError, **words)
