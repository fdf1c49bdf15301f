"""Parser of ULog files (PX4), with bounds on sizes and counts.

Layout: https://docs.px4.io/main/en/dev_log/ulog_file_format.html
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import LogError

MAGIC = b"ULog\x01\x12\x35"
_HEADER = 16
_TYPES = {
    "int8_t": "<i1", "uint8_t": "<u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4",
    "uint32_t": "<u4", "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8",
    "bool": "<u1", "char": "<u1",
}  # fmt: skip
_FIELD = re.compile(r"^(?P<type>\w{1,64})(?:\[(?P<size>\d{1,5})\])? (?P<name>\w{1,128})$")
_MOST_FIELDS = 4096
_DEEPEST = 8
_MOST_MESSAGES = 10_000_000
"""Messages of a log: hours of flight, and all that 256 MB of usual ones can be."""
_KNOWN = frozenset(b"ABCDFILMOPQRS")
Samples = NDArray[Any]
"""A structured array, one entry for each message, named by field."""


@dataclass(kw_only=True)
class _State:
    """Parser state: declarations so far, and the bytes of the selected topics."""

    formats: dict[str, str] = field(default_factory=dict)
    topics: dict[int, tuple[str, int]] = field(default_factory=dict)
    payload: dict[int, list[bytes]] = field(default_factory=dict)
    known: int = 0
    strange: int = 0

    def data(self, number: int, pieces: list[bytes], where: str) -> Samples:
        name, _ = self.topics[number]
        layout = _layout(self.formats, name, where=where)
        packed = np.dtype(layout)
        # padding at the end of a message is not written
        while layout and layout[-1][0].startswith("_padding"):
            layout.pop()
        least = np.dtype(layout)
        small, large = least.itemsize, packed.itemsize
        kept = [piece[:small] for piece in pieces if small <= len(piece) <= large]
        if least.names is None or "timestamp" not in least.names or not kept:
            return np.zeros(0, dtype=least)
        return np.frombuffer(b"".join(kept), dtype=least)


def parse(raw: bytes, *, where: str) -> dict[tuple[str, int], Samples]:
    """Return the samples of each topic and instance.

    A file that ends within a message, as after a loss of power, is read up to its last whole one.

    Args:
        raw: content of the file.
        where: the file, for refusals.

    Raises:
        LogError: it is not a ULog, is damaged, or declares more than it may.
    """
    if raw[: len(MAGIC)] != MAGIC or len(raw) < _HEADER:
        raise LogError(f"'{where}' is not a ULog file: it lacks the file signature.")
    state = _State()
    start = _HEADER
    for stop in [*_appended(raw, where), len(raw)]:
        _messages(raw, start, stop, state, where)
        start = stop
    if state.strange > state.known // 10:
        raise LogError(
            f"'{where}' is damaged: {state.strange} of {state.strange + state.known} messages are "
            "of no known kind.\nCopy it from the card again."
        )
    found = {}
    for number, pieces in state.payload.items():
        samples = state.data(number, pieces, where)
        if samples.size:
            found[state.topics[number]] = samples
    return found


def _appended(raw: bytes, where: str) -> list[int]:
    """Return the offsets at which data were appended (after a crash of the autopilot), rising."""
    if raw[_HEADER + 2 : _HEADER + 3] != b"B" or len(raw) < _HEADER + 3 + 40:
        return []
    flags = raw[_HEADER + 11 : _HEADER + 19]
    if flags[0] & ~1 or any(flags[1:]):
        raise LogError(f"'{where}' is a ULog of a newer kind (flags {flags.hex()}).")
    offsets = struct.unpack_from("<3Q", raw, _HEADER + 19)
    return sorted({place for place in offsets if _HEADER < place < len(raw)} if flags[0] else ())


def _messages(raw: bytes, start: int, stop: int, state: _State, where: str) -> None:
    place = start
    while place + 3 <= stop:
        size, kind = struct.unpack_from("<HB", raw, place)
        body = raw[place + 3 : min(place + 3 + size, stop)]
        place += 3 + size
        if len(body) < size:
            return
        if state.known + state.strange > _MOST_MESSAGES:
            raise LogError(f"'{where}' holds more than {_MOST_MESSAGES:,} messages.\nCut it.")
        if kind in _KNOWN:
            state.known += 1
        else:
            state.strange += 1
        if kind == ord("D") and size > 2:
            pieces = state.payload.get(body[0] | body[1] << 8)
            if pieces is not None:
                pieces.append(body[2:])
        elif kind == ord("F"):
            name, _, fields = _text(body, where).partition(":")
            state.formats[name] = fields
        elif kind == ord("A") and size > 3:
            number = struct.unpack_from("<H", body, 1)[0]
            topic = (_text(body[3:], where), body[0])
            if state.topics.setdefault(number, topic) != topic:
                raise LogError(f"'{where}' gives the number {number} to two topics: damaged.")
            state.payload.setdefault(number, [])


def _text(body: bytes, where: str) -> str:
    try:
        return body.decode("ascii")
    except UnicodeDecodeError as error:
        raise LogError(
            f"'{where}' is damaged: a name in it is not text ({error.reason})."
        ) from error


def _layout(
    formats: dict[str, str], name: str, *, where: str, prefix: str = "", depth: int = 0
) -> list[tuple[str, str]]:
    if name not in formats or depth > _DEEPEST:
        reason = "nested too deep" if name in formats else "not declared"
        raise LogError(f"'{where}' is damaged: the message '{name[:64]}' is {reason}.")
    layout: list[tuple[str, str]] = []
    for part in filter(None, formats[name].split(";")):
        match = _FIELD.match(part)
        if match is None:
            raise LogError(f"'{where}' is damaged: '{part[:64]}' declares no field of '{name}'.")
        size, label = match["size"], prefix + match["name"]
        labels = [label] if size is None else [f"{label}[{k}]" for k in range(int(size))]
        for one in labels:
            if match["type"] in _TYPES:
                layout.append((one, _TYPES[match["type"]]))
            else:
                inner = _layout(
                    formats, match["type"], where=where, prefix=f"{one}.", depth=depth + 1
                )
                if not inner:
                    # a huge array of nothing would be counted out for ever
                    raise LogError(f"'{where}' is damaged: '{match['type']}' declares no field.")
                layout += inner
            if len(layout) > _MOST_FIELDS:
                raise LogError(f"'{where}': '{name}' declares more than {_MOST_FIELDS} fields.")
    if len({label for label, _ in layout}) < len(layout):
        raise LogError(f"'{where}' is damaged: '{name}' declares a field twice.")
    return layout
