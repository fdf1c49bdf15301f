"""Atomic writing of files and folders: write to a temporary name, fsync, rename."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import json
import math
import os
import secrets
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from seals import schema
from seals.drawn_text import in_table
from seals.errors import SealsError
from seals.logs.room import room

_HERE, _EXCHANGE = -100, 2
"""Linux: AT_FDCWD and RENAME_EXCHANGE of renameat2."""
plain = schema.plain


@contextlib.contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path``, renamed to it when the block ends without an error.

    A file already there is replaced in one step; after an error it is untouched and nothing new is
    left behind. The suffix of the temporary path is that of ``path``.

    Raises:
        SealsError: a folder of that name is there.
        DiskFull: there is no room for it.

    Example:
        >>> import tempfile
        >>> folder = Path(tempfile.mkdtemp())
        >>> with atomic_path(folder / "a.txt") as beside:
        ...     _ = beside.write_text("whole")
        >>> [file.name for file in folder.iterdir()]
        ['a.txt']
    """
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    if target.is_dir() and not target.is_symlink():
        raise SealsError(
            f"'{target}' is a folder, but a file of that name must be written.\n"
            "Move it away, or choose another place."
        )
    beside = _beside(target)
    try:
        with room(target):
            yield beside
            _sync(beside)
        os.replace(beside, target)
        _sync(target.parent)
    finally:
        beside.unlink(missing_ok=True)


@contextlib.contextmanager
def atomic_folder(path: str | Path, *, replace: bool = False) -> Iterator[Path]:
    """Yield a fresh folder beside ``path``, renamed to it when the block ends without an error.

    Args:
        path: the folder to make.
        replace: whether a folder already there may be replaced. The old one steps aside for the
            moment between two renames, and comes back when the second one fails; on Linux the two
            change places in one step.

    Raises:
        SealsError: ``path`` exists and ``replace`` is False.
        DiskFull: there is no room for it.
    """
    target = Path(path)
    if not replace and (target.exists() or target.is_symlink()):
        raise _taken(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    beside = _beside(target)
    beside.mkdir()
    try:
        with room(target):
            yield beside
            for child in beside.rglob("*"):
                _sync(child)
            _sync(beside)
        if replace:
            _take_place(beside, target)
        else:
            rename_new(beside, target)
        _sync(target.parent)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def rename_new(beside: Path, target: Path) -> None:
    """Rename a finished folder to a name that is free.

    Raises:
        SealsError: somebody else has made a file or folder of that name in the meantime.
    """
    try:
        os.rename(beside, target)
    except OSError as cause:
        if cause.errno not in (errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR):
            raise
        raise _taken(target) from cause


def _taken(target: Path) -> SealsError:
    return SealsError(f"'{target}' exists already.\nChoose another name or remove it first.")


def _take_place(beside: Path, target: Path) -> None:
    if not target.exists():
        os.rename(beside, target)
        return
    # a folder that holds files cannot be renamed over
    if target.is_dir() and not target.is_symlink() and _exchanged(beside, target):
        # the old one stands where the new one was made, and goes with it
        return
    aside = _beside(target)
    os.rename(target, aside)
    try:
        os.rename(beside, target)
    except OSError:
        os.rename(aside, target)
        raise
    if aside.is_dir() and not aside.is_symlink():
        shutil.rmtree(aside)
    else:
        aside.unlink()


def _exchanged(one: Path, other: Path) -> bool:
    """Exchange two names atomically; return whether this system can."""
    try:
        call = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError, TypeError):
        return False
    first, second = (os.fsencode(os.path.abspath(path)) for path in (one, other))
    return bool(call(_HERE, first, _HERE, second, _EXCHANGE) == 0)


def _beside(target: Path) -> Path:
    # hidden, so that a half-written file is never taken for a log; the suffix stays for the writers
    return target.with_name(f".{target.stem}.{os.getpid()}-{secrets.token_hex(4)}{target.suffix}")


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write bytes to a file atomically."""
    with atomic_path(path) as beside:
        beside.write_bytes(content)


def write_text(path: str | Path, text: str) -> None:
    """Write UTF-8 text to a file atomically."""
    write_bytes(path, text.encode("utf-8"))


def write_json(path: str | Path, value: Any) -> None:
    """Write plain data, NumPy values included, as JSON.

    Raises:
        SealsError: a number is not finite (JSON has no NaN), or a value is not plain data.
    """
    try:
        text = json.dumps(plain(value), indent=1, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise SealsError(f"'{path}' cannot be written as JSON: {error}") from error
    write_text(path, text + "\n")


def write_yaml(path: str | Path, value: Any) -> None:
    """Write plain data, NumPy values included, as YAML in the order given.

    Raises:
        SealsError: a value is not plain data.
    """
    import yaml

    try:
        text = yaml.safe_dump(plain(value), sort_keys=False, allow_unicode=True, width=100)
    except yaml.YAMLError as error:
        raise SealsError(f"'{path}' cannot be written as YAML: {error}") from error
    write_text(path, text)


def write_table(path: str | Path, columns: Mapping[str, ArrayLike | Sequence[str]]) -> None:
    """Write columns of equal length as ``.parquet`` or ``.csv``, by the suffix of the path.

    Args:
        path: the file.
        columns: numbers or text by column name, each of shape (rows,).

    Raises:
        SealsError: the suffix is another one, or the columns differ in length.
    """
    import pyarrow as pa

    suffix = Path(path).suffix
    if suffix not in (".parquet", ".csv"):
        raise SealsError(f"'{path}': tables are written as .parquet or .csv, not as '{suffix}'.")
    try:
        found = {key: np.asarray(value) for key, value in columns.items()}
        if suffix == ".csv":
            found = {in_table(key): _cells(value) for key, value in found.items()}
        table = pa.table({key: _arrow(value) for key, value in found.items()})
    except pa.ArrowException as error:
        raise SealsError(f"'{path}' cannot be written: {error}") from error
    with atomic_path(path) as beside:
        _write_arrow(beside, table)


def _cells(values: NDArray[Any]) -> NDArray[Any]:
    """Return a column for a CSV file; text in it is no formula."""
    if values.dtype.kind not in "UO":
        return values
    return np.asarray([in_table(v) if isinstance(v, str) else v for v in values], values.dtype.kind)


def _arrow(values: NDArray[Any]) -> Any:
    """Return a column; NaN stays NaN, and numbers need no import of pandas, as `pa.array` does."""
    import pyarrow as pa

    if values.ndim != 1 or values.dtype.kind not in "iuf":
        return pa.array(values)
    buffer = pa.py_buffer(np.ascontiguousarray(values))
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [None, buffer])


def _write_arrow(path: Path, table: Any) -> None:
    # a file of our own: one that pyarrow opens speaks of a full disk once more when it is freed
    with path.open("wb") as file:
        if path.suffix == ".csv":
            from pyarrow import csv

            csv.write_csv(table, file)
        else:
            from pyarrow import parquet, types

            # numbers rarely repeat: bytes split by place pack a quarter smaller than a dictionary
            numbers = [field.name for field in table.schema if types.is_floating(field.type)]
            others = [name for name in table.column_names if name not in numbers]
            parquet.write_table(
                table,
                file,
                compression="zstd",
                use_dictionary=others,
                use_byte_stream_split=numbers,
            )


def finite(value: Any) -> Any:
    """Return plain data with every number that is not finite replaced by None (null in JSON).

    For results in which such a number means "not determined"; what must be finite is written
    without it, and refused by `write_json`.

    Example:
        >>> finite({"value": 2.0, "sd": float("nan"), "ends": (0.0, np.float64("inf"))})
        {'value': 2.0, 'sd': None, 'ends': [0.0, None]}
    """

    def clean(one: Any) -> Any:
        if isinstance(one, dict):
            return {key: clean(child) for key, child in one.items()}
        if isinstance(one, list):
            return [clean(child) for child in one]
        return None if isinstance(one, float) and not math.isfinite(one) else one

    return clean(plain(value))
