"""Reader of the native log folders."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from seals.errors import LogError
from seals.field_roles import roles
from seals.logs.log import Log
from seals.logs.native import TABLES, read_native
from seals.logs.run_folder import refuse_cut_run


@roles(read="path")
@dataclass(kw_only=True)
class ReaderNative:
    """Native log folders: a table, ``meta.yaml`` and, for a vehicle with an arm, a URDF.

    Channels:
        Whatever the table holds; known names are checked to be numbers.
    Units:
        SI already; nothing is converted.
    Limitations:
        Unknown columns that do not hold numbers are left out.

    Args:
        path: a log folder, or a folder of log folders.
    """

    path: str = ""

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the log, or one log for each log folder inside the given folder.

        Raises:
            LogError: nothing was given, a log cannot be used, or a run has not written its log.
        """
        given = source or self.path
        if not given:
            raise LogError(
                "log is not given.\n"
                "The native reader needs a log folder: log=FOLDER, in Python path=FOLDER."
            )
        place = Path(given)
        holds_table = any((place / name).exists() for name in (*TABLES, "meta.yaml"))
        if place.is_dir() and not holds_table:
            refuse_cut_run(place)
            folders = sorted({table.parent for name in TABLES for table in place.glob(f"*/{name}")})
            if folders:
                return [read_native(folder) for folder in folders]
        return [read_native(place)]
