"""Typed settings of taking over a foreign log."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(kw_only=True)
class ConvertSettings:
    """A foreign log, how to read it, and where the log folder goes.

    Args:
        name: of the conversion, part of the name of Hydra's own folder.
        log: file or folder.
        out: log folder to write.
        reader: plug-in that reads the log.
        map: YAML file with fields of the reader, such as ``columns`` and ``units``.
        meta: YAML file with what is known of vehicle and sensors.
        urdf: description of the vehicle, which goes into the log folder.
        table: ``log.parquet`` or ``log.csv``.
        replace: whether a log folder already there may be replaced.
    """

    name: str = "convert"
    log: Any = None
    out: str | None = None
    reader: Any = None
    map: str | None = None
    meta: str | None = None
    urdf: str | None = None
    table: str = "log.parquet"
    replace: bool = False
