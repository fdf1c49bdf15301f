"""Untrusted NumPy files: the declared shape is checked against the size of the file."""

from __future__ import annotations

import io
import math
import struct
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from tokenize import TokenError

import numpy as np
from numpy.lib import format as npy

from seals.arrays import Floats
from seals.errors import LogError, suggestion
from seals.untrusted_io import MOST_BYTES, read_bytes, regular_file

MOST_VALUES = 1 << 26
"""Most numbers in one array."""
_HEADER = (
    *(ValueError, EOFError, SyntaxError, TokenError, TypeError, OverflowError, RecursionError),
    # Python's parser on what is nested too deeply: nothing is wanting in the machine
    *(MemoryError, SystemError),
)
"""What a header of NumPy that is no header ends in."""
_ARCHIVE = (
    *(zipfile.BadZipFile, zlib.error, OSError, NotImplementedError, RuntimeError),
    *(ValueError, EOFError, KeyError, struct.error),
)
"""What a damaged archive raises; names in it may not be text."""


def read_npy(path: str | Path) -> Floats:
    """Return the array of numbers in an ``.npy`` file.

    Raises:
        LogError: it is damaged, declares more than it holds, or holds Python objects.
    """
    return _parse(str(path), read_bytes(path))


def read_npz(path: str | Path, names: Sequence[str]) -> dict[str, Floats]:
    """Return the named arrays of an ``.npz`` file.

    Raises:
        LogError: it is damaged, unpacks to too much, or lacks a name.
    """
    file = regular_file(path)
    try:
        with zipfile.ZipFile(file) as archive:
            refuse_hollow(archive, file)
            sizes = {item.filename: item.file_size for item in archive.infolist()}
            present = [name.removesuffix(".npy") for name in sizes]
            missing = [name for name in names if name not in present]
            if missing:
                raise LogError(
                    f"'{file}' holds no array '{missing[0]}'.\n"
                    + suggestion(missing[0], present, label="Arrays there")
                )
            if sum(sizes[f"{name}.npy"] for name in names) > MOST_BYTES:
                raise LogError(f"'{file}' decompresses to more than {MOST_BYTES:,} bytes.")
            return {name: _parse(f"{file}:{name}", archive.read(f"{name}.npy")) for name in names}
    except _ARCHIVE as error:
        raise LogError(f"'{file}' is not a valid .npz file ({error}).\nFetch it again.") from error


def refuse_hollow(archive: zipfile.ZipFile, file: Path) -> None:
    """Refuse an archive that declares more packed bytes than its file has.

    Room for what is declared would be made before it is read.

    Raises:
        LogError: it does.
    """
    size = file.stat().st_size
    for item in archive.infolist():
        if item.compress_size > size:
            raise LogError(
                f"'{file}' declares {item.compress_size:,} packed bytes and has {size:,}.\n"
                "Fetch it again."
            )


def _parse(where: str, raw: bytes) -> Floats:
    stream = io.BytesIO(raw)
    try:
        version = npy.read_magic(stream)
        read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, _, dtype = read(stream)
    except _HEADER as error:
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise LogError(f"'{where}' is not a valid NumPy array ({reason}).") from error
    if dtype.kind not in "fiu":
        raise LogError(f"'{where}' contains {dtype}, but numbers are needed.")
    declared, held = math.prod(shape) * dtype.itemsize, len(raw) - stream.tell()
    if any(isinstance(size, bool) for size in shape):
        raise LogError(f"'{where}' declares the shape {shape}; whole numbers are needed.")
    if declared == held and math.prod(shape) > MOST_VALUES:
        # small ones take eight times the room as the numbers of a log
        raise LogError(
            f"'{where}' holds {math.prod(shape):,} numbers; the limit is {MOST_VALUES:,}."
        )
    if declared != held or min(shape, default=1) < 0:
        raise LogError(
            f"'{where}' declares an array of shape {shape} ({declared:,} bytes) and holds "
            f"{held:,} bytes.\nFetch it again."
        )
    stream.seek(0)
    return np.asarray(npy.read_array(stream, allow_pickle=False), dtype=np.float64)
