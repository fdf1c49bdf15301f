"""Parser of DataFlash files (ArduPilot, ``.bin``), with bounds on sizes and counts.

Layout: https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html; each message is
0xA3 0x95, its type and a packed structure, which messages FMT (type 128) declare.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import LogError

HEAD = b"\xa3\x95"
_FMT, _FMT_SIZE = 128, 89
_TYPES: dict[str, tuple[str, float]] = {
    "a": ("<i2", 1.0), "b": ("<i1", 1.0), "B": ("<u1", 1.0), "h": ("<i2", 1.0), "H": ("<u2", 1.0),
    "i": ("<i4", 1.0), "I": ("<u4", 1.0), "f": ("<f4", 1.0), "d": ("<f8", 1.0), "g": ("<f2", 1.0),
    "n": ("S4", 0.0), "N": ("S16", 0.0), "Z": ("S64", 0.0), "M": ("<u1", 1.0),
    "c": ("<i2", 1e-2), "C": ("<u2", 1e-2), "e": ("<i4", 1e-2), "E": ("<u4", 1e-2),
    "L": ("<i4", 1e-7), "q": ("<i8", 1.0), "Q": ("<u8", 1.0),
}  # fmt: skip
"""Letter of a format -> type of NumPy, and what a number is multiplied by; 0 for text."""
_LIST = "a"
_LIST_LENGTH = 32
_MOST_MESSAGES = 20_000_000
_MOST_STRANGE = 0.1
"""Largest share of bytes that belong to no message."""


@dataclass(frozen=True, kw_only=True)
class Messages:
    """All messages of one name.

    Args:
        rows: structured array, one entry for each message.
        letters: field -> its letter in the declaration.
    """

    rows: NDArray[Any]
    letters: dict[str, str]

    def column(self, field: str) -> NDArray[Any]:
        """Return the numbers of a field in the unit that the declaration means, or its text."""
        kind, scale = _TYPES[self.letters[field]]
        values = self.rows[field]
        return values if kind.startswith("S") else values.astype(np.float64) * scale


def parse(raw: bytes, *, where: str) -> dict[str, Messages]:
    """Return the messages of a log by name.

    Bytes between messages, as after a loss of power, are passed over.

    Args:
        raw: content of the file.
        where: the file, for refusals.

    Raises:
        LogError: it is not a DataFlash log, or is damaged.
    """
    if raw[:2] != HEAD:
        raise LogError(f"'{where}' is not a DataFlash log: it lacks the file signature.")
    sizes: dict[int, int] = {_FMT: _FMT_SIZE}
    declared: dict[int, bytes] = {}
    places: dict[int, array[int]] = {}
    place, strange, end, count = 0, 0, len(raw), 0
    while place + 3 <= end and strange <= _MOST_STRANGE * end:
        size = sizes.get(raw[place + 2], 0) if raw[place : place + 2] == HEAD else 0
        if not size:
            after = raw.find(HEAD, place + 1)
            after = end if after < 0 else after
            strange += after - place
            place = after
            continue
        if place + size > end:
            break
        kind = raw[place + 2]
        if kind == _FMT:
            _declare(raw[place + 3 : place + size], sizes, declared, where)
        else:
            places.setdefault(kind, array("q")).append(place)
        place += size
        count += 1
        if count > _MOST_MESSAGES:
            raise LogError(f"'{where}' holds more than {_MOST_MESSAGES:,} messages.\nCut it.")
    if strange > _MOST_STRANGE * end:
        raise LogError(
            f"'{where}' is damaged: of {end:,} bytes {strange:,} or more belong to no message.\n"
            "Download it from the vehicle again."
        )
    content = np.frombuffer(raw, dtype=np.uint8)
    found: dict[str, Messages] = {}
    for kind, starts in places.items():
        name, layout = _layout(declared[kind])
        if layout and name not in found:
            packed = np.dtype([(field, f"({_LIST_LENGTH},)<i2" if letter == _LIST else
                                _TYPES[letter][0]) for field, letter in layout])  # fmt: skip
            found[name] = Messages(rows=_gathered(content, starts, packed), letters=dict(layout))
    return found


def _declare(body: bytes, sizes: dict[int, int], declared: dict[int, bytes], where: str) -> None:
    """Take a declaration; one that does not fit itself leaves its messages unread."""
    kind, size = body[0], body[1]
    if declared.setdefault(kind, body) != body:
        raise LogError(f"'{where}' declares the message {kind} twice, differently: damaged.")
    if kind != _FMT and size >= 3:
        sizes[kind] = size


def _layout(body: bytes) -> tuple[str, list[tuple[str, str]]]:
    """Return the name, and field and letter of each entry; none where they do not fit."""
    name, letters, labels = (
        part.split(b"\0", 1)[0].decode("latin-1") for part in (body[2:6], body[6:22], body[22:86])
    )
    fields = [label.strip() for label in labels.split(",")]
    fits = len(fields) == len(letters) == len(set(fields)) and set(letters) <= set(_TYPES)
    if not fits or 3 + sum(map(_width, letters)) != body[1] or not all(fields):
        return name, []
    return name, list(zip(fields, letters, strict=True))


def _width(letter: str) -> int:
    size = np.dtype(_TYPES[letter][0]).itemsize
    return size * _LIST_LENGTH if letter == _LIST else size


def _gathered(content: NDArray[np.uint8], starts: array[int], packed: np.dtype[Any]) -> Any:
    """Return the structures that stand 3 bytes behind the given places."""
    rows = np.empty((len(starts), packed.itemsize), dtype=np.uint8)
    first = np.frombuffer(starts, dtype=np.int64) + 3
    for k in range(packed.itemsize):
        rows[:, k] = content[first + k]
    return rows.view(packed)[:, 0]
