"""Numeric arrays of MATLAB files, by their path: run in a process of its own.

`seals.isolated_reading` calls `arrays_of`: the libraries of these formats crash on damaged files.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from seals.errors import LogError, optional_import

HDF5 = b"\x89HDF\r\n\x1a\n"
_DEEPEST = 8
_MOST_NAMES = 4096
_MOST_WIDTH = 64
_MOST_VALUES = 100_000_000


def arrays_of(path: Path) -> dict[str, Any]:
    """Return the columns of numbers in a MATLAB file, each of shape (rows,), by path.

    ``imu.gyro`` is a field of a structure; of a matrix each column is ``imu.gyro[0]`` and so on,
    rows are the longer side. Text, cells, functions and objects are left out and named under the
    key ``""``.

    Raises:
        LogError: it holds too much.
        MissingExtra: the package for MATLAB 7.3 is absent.
    """
    from seals.untrusted_io import read_bytes

    modern = HDF5 in (read_bytes(path)[k : k + 8] for k in (0, 512))
    found: dict[str, Any] = {}
    left_out: list[str] = []
    total = 0
    for name, values in _modern(path) if modern else _classic(path):
        numbers = _numbers(values)
        if numbers is None:
            left_out.append(name[:80])
            continue
        total += numbers.size
        wide = numbers.ndim == 2 and numbers.shape[1] > 1
        parts = {f"{name}[{k}]": numbers[:, k] for k in range(numbers.shape[1])} if wide else {
            name: numbers.reshape(-1)
        }  # fmt: skip
        found |= {key: np.array(part, dtype=np.float64) for key, part in parts.items()}
        if len(found) > _MOST_NAMES or total > _MOST_VALUES:
            raise LogError(
                f"'{path}' holds more than {_MOST_NAMES:,} columns or {_MOST_VALUES:,} values.\n"
                "Save only the required arrays: save('log.mat', 't', 'gyro')"
            )
    return {**found, "": left_out[:20]}


def _numbers(values: Any) -> Any:
    """Return numbers with rows first; None for what is no column of numbers."""
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "biuf" or values.size == 0:
        return None
    values = values.squeeze()
    if values.ndim > 2:
        return None
    if values.ndim == 2 and values.shape[0] < values.shape[1]:
        values = values.T
    return None if values.ndim == 2 and values.shape[1] > _MOST_WIDTH else np.atleast_1d(values)


def _classic(path: Path) -> Iterator[tuple[str, Any]]:
    """Yield arrays of MATLAB 4 to 7.2."""
    from scipy.io import loadmat
    from scipy.io.matlab import MatlabFunction, MatlabOpaque

    content = loadmat(str(path), struct_as_record=True, squeeze_me=False, mat_dtype=True)
    for name, value in content.items():
        if isinstance(value, MatlabFunction | MatlabOpaque):
            # an object has no name of its own there
            yield "an object or function", None
        elif not name.startswith("__"):
            yield from _fields(name, value, 0)


def _fields(name: str, value: Any, depth: int) -> Iterator[tuple[str, Any]]:
    names = value.dtype.names if isinstance(value, np.ndarray) else None
    if not names or value.size != 1 or depth >= _DEEPEST:
        yield name, value
        return
    for part in names[:_MOST_NAMES]:
        yield from _fields(f"{name}.{part}", value.reshape(-1)[0][part], depth + 1)


def _modern(path: Path) -> Iterator[tuple[str, Any]]:
    """Yield arrays of MATLAB 7.3, which is HDF5; links to other files are left alone."""
    with optional_import("MATLAB 7.3 needs h5py", "Install it: pip install 'aam-seals[logs]'"):
        import h5py

    with h5py.File(path, "r") as file:
        yield from _groups("", file, 0, h5py)


def _groups(prefix: str, group: Any, depth: int, h5py: Any) -> Iterator[Any]:
    for name in sorted(group)[:_MOST_NAMES]:
        if name.startswith("#") or not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        entry = group[name]
        if isinstance(entry, h5py.Group):
            if depth < _DEEPEST:
                yield from _groups(f"{prefix}{name}.", entry, depth + 1, h5py)
        elif (
            not isinstance(entry, h5py.Dataset)
            or entry.shape is None
            or entry.external
            or entry.is_virtual
            or entry.dtype.kind not in "biuf"
            or entry.ndim > _DEEPEST
        ):
            yield prefix + name, None
        elif entry.size > _MOST_VALUES:
            raise LogError(f"'{prefix + name}' declares {entry.size:,} values.")
        # text is kept as numbers of its signs, and an empty array as its shape
        elif entry.attrs.get("MATLAB_class") == b"char" or "MATLAB_empty" in entry.attrs:
            yield prefix + name, None
        else:
            # MATLAB counts its columns first
            yield prefix + name, entry[()].T if entry.ndim == 2 else entry[()]
