"""State file: header with version and digest, JSON data, raw arrays.

The format, all numbers little-endian::

    8 bytes   SEALSTAT
    4         version
    8, 8      bytes of the JSON text, and of the arrays
    32        BLAKE2b of all before and after this field
    ...       JSON text: kind, the version of SEALS, dtype, order and shape of each array, the state
    ...       the arrays one after the other, each begun at a multiple of 64 bytes

Nothing in it is executed or compressed, and it names no other file. Declared shapes are added up
and compared with the file before an array is made. Version 1 was a pickle, which could run
commands; it is refused.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import stat
import struct
from collections.abc import Iterable, Mapping
from io import BufferedReader
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import seals
from seals.state_tree import packed, unpacked

MAGIC = b"SEALSTAT"
VERSION = 2
"""Version that is written; readers of earlier ones stand in `_READERS`."""
MOST_TEXT = 1 << 23
"""Longest JSON text [byte]."""
MOST_BYTES = 1 << 32
"""Largest file, unless the reader allows less [byte]."""
_HEAD = struct.Struct("<8sIQQ")
_DIGEST = 32
_LINE = 64
_PIECE = 1 << 20
_DIGITS = 40
_DTYPES = frozenset(
    np.dtype(name).newbyteorder("<").str
    for name in ("?", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f2", "f4", "f8", "c8", "c16")
)


class StateError(ValueError):
    """A file is not a readable state file."""


def write_state(path: Path, kind: str, state: Any) -> None:
    """Write a state to a file and flush it to disk.

    Args:
        path: of the file; whoever calls puts it in its place by a rename.
        kind: word that the reader asks for again.
        state: as for `seals.state_tree.packed`.

    Raises:
        TypeError: a part of it is no data.
        OSError: it cannot be written.
    """
    data, arrays = packed(state)
    table = [[str(x.dtype.newbyteorder("<").str), _order(x), list(x.shape)] for x in arrays]
    about = {"kind": kind, "written_by": seals.__version__, "arrays": table, "state": data}
    text = json.dumps(about, allow_nan=False, separators=(",", ":")).encode("ascii")
    if len(text) > MOST_TEXT:
        raise TypeError(
            f"besides its arrays it has {len(text):,} bytes; the limit is {MOST_TEXT:,}"
        )
    size = sum(_padded(x.nbytes) for x in arrays)
    head = _HEAD.pack(MAGIC, VERSION, len(text), size)
    digest = hashlib.blake2b(head, digest_size=_DIGEST)
    with path.open("wb") as file:
        file.write(head + bytes(_DIGEST))
        for part in _parts(text, arrays):
            digest.update(part)
            file.write(part)
        file.seek(len(head))
        file.write(digest.digest())
        file.flush()
        os.fsync(file.fileno())


def _parts(text: bytes, arrays: Iterable[np.ndarray]) -> Iterable[bytes | memoryview]:
    yield text
    for array in arrays:
        flat = np.ascontiguousarray(array.T if _order(array) == "F" else array)
        flat = flat.astype(flat.dtype.newbyteorder("<"), copy=False)
        yield flat.reshape(-1).view(np.uint8).data
        yield bytes(_padded(array.nbytes) - array.nbytes)


def read_state(path: Path, kind: str, *, most: int = MOST_BYTES) -> Any:
    """Read what `write_state` wrote.

    Args:
        path: of the file.
        kind: that it must be of.
        most: largest file that is read [byte].

    Raises:
        StateError: it is none, of another kind or version, damaged, or too large.
    """
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > most:
            raise StateError(f"it has {size:,} bytes; this one has at most {most:,}")
        head = _read_head(file.read(_HEAD.size), size)
        # the digest is of the head and of the rest of the file
        found = hashlib.blake2b(head.raw, digest_size=_DIGEST)
        file.seek(_HEAD.size + _DIGEST)
        while part := file.read(_PIECE):
            found.update(part)
        file.seek(_HEAD.size)
        if found.digest() != file.read(_DIGEST):
            raise StateError("its digest differs: it is damaged or truncated")
        try:
            return _READERS[head.version](file, head, kind)
        except RecursionError as cause:
            raise StateError("it is nested too deeply") from cause
        except (ValueError, TypeError, KeyError, OverflowError) as cause:
            raise StateError(" ".join(str(cause).split())[:300] or type(cause).__name__) from cause


class _Head(NamedTuple):
    raw: bytes
    version: int
    text: int
    arrays: int


def open_regular(path: Path) -> BufferedReader:
    """Open a regular file, without following links or waiting for pipes.

    Raises:
        StateError: it is none, or cannot be opened.
    """
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    try:
        descriptor = os.open(path, flags | getattr(os, "O_BINARY", 0))
    except OSError as cause:
        raise StateError(f"it cannot be opened ({cause.strerror})") from cause
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise StateError("it is not a regular file")
    return os.fdopen(descriptor, "rb")


def _read_head(raw: bytes, size: int) -> _Head:
    if raw[:1] == b"\x80":
        raise StateError(
            "it is a pickle, as written by earlier versions of SEALS; such a file could run "
            "commands, so it is not read"
        )
    if len(raw) < _HEAD.size or raw[: len(MAGIC)] != MAGIC:
        raise StateError("it is not a state written by SEALS")
    _, version, text, arrays = _HEAD.unpack(raw)
    if version not in _READERS:
        known = ", ".join(map(str, _READERS))
        raise StateError(f"it has format version {version}; this SEALS reads {known}")
    if text > MOST_TEXT or len(raw) + _DIGEST + text + arrays != size:
        raise StateError(f"it declares {text:,} and {arrays:,} bytes, and has {size:,} in all")
    return _Head(raw, version, text, arrays)


def _read_2(file: BufferedReader, head: _Head, kind: str) -> Any:
    about = json.loads(
        file.read(head.text).decode("ascii"),
        parse_constant=_refuse_number,
        parse_float=_finite,
        parse_int=_whole,
        object_pairs_hook=_once,
    )
    if not isinstance(about, dict) or set(about) != {"kind", "written_by", "arrays", "state"}:
        raise StateError("its JSON text has other entries")
    if about["kind"] != kind:
        raise StateError(f"it is of the kind '{str(about['kind'])[:40]}', not '{kind}'")
    return unpacked(about["state"], _arrays(about["arrays"], file, head.arrays))


def _arrays(table: Any, file: BufferedReader, held: int) -> list[np.ndarray]:
    """Read the arrays, after a check of the sum of all declared sizes."""
    declared = [_declared(row) for row in table]
    total = sum(_padded(size) for *_, size in declared)
    if total != held:
        raise StateError(f"its arrays declare {total:,} bytes and there are {held:,}")
    found = []
    for dtype, order, shape, size in declared:
        flat = np.empty(math.prod(shape), dtype)
        file.readinto(flat.view(np.uint8).data)
        file.seek(_padded(size) - size, os.SEEK_CUR)
        found.append(flat.reshape(shape, order=order))
    return found


def _declared(row: Any) -> tuple[np.dtype[Any], Any, tuple[int, ...], int]:
    dtype, order, shape = row
    if str(dtype) not in _DTYPES or str(order) not in ("C", "F"):
        raise StateError(f"an array of '{str(dtype)[:40]}', which is not a numeric type")
    if len(shape) > 16 or any(type(n) is not int or not 0 <= n <= MOST_BYTES for n in shape):
        raise StateError(f"an array of shape {str(shape)[:80]}")
    return np.dtype(dtype), order, tuple(shape), math.prod(shape) * np.dtype(dtype).itemsize


_READERS = {2: _read_2}


def _order(array: np.ndarray) -> str:
    # sums depend on the order in memory, in the last bit
    return "F" if array.flags.f_contiguous and not array.flags.c_contiguous else "C"


def _padded(size: int) -> int:
    return -(-size // _LINE) * _LINE


def _once(pairs: list[tuple[str, Any]]) -> Mapping[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise StateError("an entry of its JSON text occurs twice")
    return found


def _refuse_number(word: str) -> Any:
    raise StateError(f"its JSON text holds {word}, which is not a number of JSON")


def _finite(word: str) -> float:
    if not math.isfinite(value := float(word)):
        raise StateError(f"its JSON text holds {word[:40]}, which is not a finite number")
    return value


def _whole(word: str) -> int:
    if len(word) > _DIGITS:
        raise StateError(f"its JSON text holds a number of {len(word)} digits")
    return int(word)
