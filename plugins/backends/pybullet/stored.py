"""Check of a stored PyBullet scene for completeness, which the engine does not do."""

from __future__ import annotations

import struct
from pathlib import Path

_HEAD = 12
"""Mark, size of numbers and pointers, byte order, version."""
_LAST = b"DNA1"
"""Name of the last chunk: the description of all the others."""
_LONG = b"-"
"""Mark of 8-byte pointers; the other one, ``_``, stands for 4 bytes."""


def whole(path: Path) -> bool:
    """Return whether the file of a stored scene contains all its chunks in full.

    A file is a head and chunks of name, length, pointer, type and count, each followed by as many
    bytes as it says.

    References:
        Bullet 3.25, ``btSerializer.h`` and ``bFile.cpp``.
    """
    raw = path.read_bytes()
    if raw[:6] != b"BULLET" or raw[8:9] not in (b"v", b"V"):
        return False
    head = "4si" + ("8x" if raw[7:8] == _LONG else "4x") + "ii"
    order = "<" if raw[8:9] == b"v" else ">"
    place, name = _HEAD, b""
    while place + struct.calcsize(order + head) <= len(raw):
        name, length, *_ = struct.unpack_from(order + head, raw, place)
        if length < 0:
            return False
        place += struct.calcsize(order + head) + length
    return place == len(raw) and name == _LAST
