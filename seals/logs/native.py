"""The native log folder: ``log.parquet`` or ``log.csv``, ``meta.yaml``, ``robot/``."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, SealsError, refuse_unlisted
from seals.logs.atomic import atomic_folder, write_table, write_text, write_yaml
from seals.logs.clock import CLOCK, in_seconds, tell
from seals.logs.log import Integers, Log
from seals.logs.run_folder import ROBOT, foreign_log
from seals.logs.table import read_csv_columns, read_parquet
from seals.schema import read
from seals.untrusted_io import read_yaml

FORMAT = "hidden-effect-log"
"""Name of the format, as written in ``meta.yaml``."""
FORMAT_VERSION = 1
TABLES = ("log.parquet", "log.csv")
"""File names of the table, the preferred one first."""
_FOLDER = "folder"
_URDF = "vehicle.urdf"
_SIDE = ("source", "licence")


def read_native(folder: str | Path) -> Log:
    """Read a log folder.

    Args:
        folder: the folder, or the table inside it.

    Raises:
        LogError: something is missing, damaged, of an unknown version, or of two runs.
    """
    place = Path(folder)
    if place.name in TABLES and place.is_file():
        place = place.parent
    if not place.exists():
        raise LogError(f"'{place}': there is no such file or folder.\nGive a log folder.")
    if not place.is_dir():
        raise LogError(
            f"'{place}' is not a log folder.\n"
            f"A log folder holds {TABLES[0]} or {TABLES[1]}, and meta.yaml."
        )
    table = next((place / name for name in TABLES if (place / name).exists()), None)
    if table is None:
        raise LogError(
            f"'{place}' holds neither {TABLES[0]} nor {TABLES[1]}.\n"
            "Convert a recording into a log folder: seals convert log=FILE out=FOLDER"
        )
    foreign = foreign_log(place)
    if foreign:
        raise LogError(
            f"{foreign}.\nFiles of different logs are mixed: use the original log folder."
        )
    if not (place / "meta.yaml").exists():
        raise LogError(
            f"'{place}' holds no meta.yaml beside {table.name}.\n"
            "Create it with a map of the columns: "
            f"seals convert log={table} map=FILE.yaml out=FOLDER"
        )
    meta = read_meta(place / "meta.yaml")
    columns = read_parquet(table) if table.suffix == ".parquet" else read_csv_columns(table)
    values = columns.pop("segment", None)
    if values is None:
        segment = np.zeros(0, dtype=np.int64)
    else:
        if not np.all(
            np.isfinite(values) & (values == np.round(values)) & (np.abs(values) < 2**53)
        ):
            raise LogError(f"'{table}': column 'segment' must contain an integer in every row.")
        segment = values.astype(np.int64)
    source, licence = (str(meta.pop(key, "")) for key in _SIDE)
    name = place.resolve().name
    if "t" in columns:
        columns["t"], clock = in_seconds(columns["t"], segment, channels=columns)
        meta |= {CLOCK: clock} if clock else {}
        tell(name, clock)
    return Log(
        name=name,
        columns=columns,
        segment=segment,
        meta=meta,
        source=source or str(place),
        licence=licence,
    )


def read_meta(path: str | Path) -> dict[str, Any]:
    """Read and check ``meta.yaml``, and the robot in the folder ``robot/`` beside it.

    Raises:
        LogError: it is not a plain mapping, or of another format or version.
    """
    meta = read_yaml(path)
    if meta.get("format") != FORMAT:
        raise LogError(
            f"'{path}': format is '{meta.get('format')}'.\nAllowed: format: {FORMAT}, "
            f"format_version: {FORMAT_VERSION}; seals convert writes both (docs/formats.md)"
        )
    version = meta.get("format_version")
    if version != FORMAT_VERSION or isinstance(version, bool):
        raise LogError(
            f"'{path}': format_version is '{version}', this program reads version "
            f"{FORMAT_VERSION}.\nA newer log needs a newer seals; an older one must be converted."
        )
    # only the log's own folder is read, whatever its metadata name
    meta.pop(ROBOT, None)
    folder = Path(path).resolve().parent / ROBOT
    if (folder / "robot.yaml").is_file():
        meta[ROBOT] = {**read_yaml(folder / "robot.yaml"), _FOLDER: str(folder)}
    return meta


class _Shape(NamedTuple):
    """Part of a hull, as far as it names a file."""

    file: str | None = None


class _Hull(NamedTuple):
    """Hull of a link, as far as it names files."""

    shapes: tuple[_Shape, ...] = ()


class _Robot(NamedTuple):
    """Files that a ``robot.yaml`` names, and the folder in which they lie."""

    folder: str
    urdf: str
    hulls: Mapping[str, _Hull] = {}


def _write_robot(stated: Mapping[str, Any], folder: Path) -> None:
    """Write ``robot.yaml`` with the URDF and the meshes of hulls that it names."""
    found = read(_Robot, stated, where=ROBOT, error=LogError, extra=True)
    home = Path(found.folder).resolve()
    meshes = [shape.file for hull in found.hulls.values() for shape in hull.shapes if shape.file]
    for name in (found.urdf, *meshes):
        source = (home / name).resolve()
        if not source.is_relative_to(home):
            raise LogError(f"'{name}' lies outside {home}.\nKeep the robot's files in its folder.")
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, folder / name)
    write_yaml(folder / "robot.yaml", {k: v for k, v in stated.items() if k != _FOLDER})


def write_native(
    log: Log,
    folder: str | Path,
    *,
    urdf: str | None = None,
    table: str = TABLES[0],
    replace: bool = False,
) -> Path:
    """Write a log folder, atomically.

    Args:
        log: the log.
        folder: where to; it must not exist unless ``replace``.
        urdf: text of ``vehicle.urdf``.
        table: ``log.parquet`` or ``log.csv``.
        replace: whether a folder already there is replaced.

    Raises:
        LogError: the table has another name, or the folder cannot be written.

    Example:
        >>> from tempfile import TemporaryDirectory
        >>> from seals import write_log
        >>> log = Log(name="drop", columns={"t": [0.0, 0.1], "position_z": [1.0, 0.95]}, meta={})
        >>> with TemporaryDirectory() as folder:
        ...     write_log(log, f"{folder}/drop").name
        'drop'
    """
    refuse_unlisted(table, TABLES, f"'{table}' is not a table of a log folder", error=LogError)
    side = {key: getattr(log, key) for key in _SIDE if getattr(log, key)}
    rest = {k: value for k, value in log.meta.items() if k not in ("format", ROBOT, *_SIDE)}
    meta = {"format": FORMAT, "format_version": FORMAT_VERSION, **rest, **side}
    columns: dict[str, Floats | Integers] = {"t": log.time}
    if np.any(log.segment != 0):
        columns["segment"] = log.segment
    columns |= {key: value for key, value in log.columns.items() if key != "t"}
    try:
        with atomic_folder(folder, replace=replace) as beside:
            write_table(beside / table, columns)
            write_yaml(beside / "meta.yaml", meta)
            if ROBOT in log.meta:
                _write_robot(log.meta[ROBOT], beside / ROBOT)
            if urdf is not None:
                write_text(beside / _URDF, urdf)
    except (OSError, SealsError) as error:
        raise LogError(f"'{folder}' cannot be written: {error}") from error
    return Path(folder)
