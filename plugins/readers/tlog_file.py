"""Parser of telemetry logs (``.tlog``): MAVLink packets, each after its time of arrival.

Layout: https://mavlink.io/en/guide/serialization.html; before each packet stands the time since
1970 in microseconds, eight bytes, the highest first. Fields of messages are those of pymavlink.
"""

from __future__ import annotations

import functools
import re
import struct
from array import array
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import LogError, optional_import

_STAMP = 8
_V1, _V2 = 0xFE, 0xFD
_HEADER = {_V1: 6, _V2: 10}
_SIGNED = 1
_SIGNATURE = 13
_STAMPS = (946_684_800_000_000, 4_102_444_800_000_000)
"""Times since 1970 from the year 2000 to 2100 [us]."""
_MOST_STRANGE = 0.5
"""Largest share of bytes that belong to no packet; links of radios lose some."""
_MOST_KINDS = 4096
_MOST_PACKETS = 8_000_000
_NEXT = re.compile(rb"\x00[\x03-\x0e].{6}[\xfd\xfe]", re.DOTALL)
"""A time of this century and the first byte of a packet."""


@dataclass(frozen=True, kw_only=True)
class Packets:
    """All packets of one message from one sender.

    Args:
        rows: structured array, one entry for each packet, named by field.
        arrived: time of arrival since 1970 [us], shape (packets,).
    """

    rows: NDArray[Any]
    arrived: NDArray[np.int64]


def _looks_like(raw: bytes) -> bool:
    """Return whether bytes begin with a time of this century and a packet."""
    if len(raw) < _STAMP + 3 or raw[_STAMP] not in _HEADER:
        return False
    stamp = int(struct.unpack_from(">Q", raw)[0])
    return _STAMPS[0] < stamp < _STAMPS[1]


def parse(raw: bytes, *, where: str) -> dict[tuple[int, int, str], Packets]:
    """Return the packets of a log by system, component and name of the message.

    Packets with a wrong checksum and of unknown messages are passed over.

    Args:
        raw: content of the file.
        where: the file, for refusals.

    Raises:
        LogError: it is not a telemetry log, or is damaged.
        MissingExtra: pymavlink, which knows the fields of messages, is absent.
    """
    if not _looks_like(raw):
        raise LogError(f"'{where}' is not a telemetry log: it lacks the file signature.")
    known = _definitions()
    places: dict[tuple[int, int, int, int, int], array[int]] = {}
    place, strange, end, count = 0, 0, len(raw), 0
    while place + _STAMP + 3 <= end:
        count += 1
        if count > _MOST_PACKETS:
            raise LogError(
                f"'{where}' holds more than {_MOST_PACKETS:,} packets and gaps.\nCut it."
            )
        size = _size(raw, place)
        if not size or place + size > end:
            after = _NEXT.search(raw, place + 1)
            strange += (after.start() if after else end) - place
            place = after.start() if after else end
            continue
        start = place + _STAMP
        if raw[start] == _V1:
            key = (raw[start + 3], raw[start + 4], raw[start + 5], _V1, raw[start + 1])
        else:
            number = raw[start + 7] | raw[start + 8] << 8 | raw[start + 9] << 16
            key = (raw[start + 5], raw[start + 6], number, _V2, raw[start + 1])
        if key[2] in known and (key in places or len(places) < _MOST_KINDS):
            places.setdefault(key, array("q")).append(place)
        place += size
    if strange > _MOST_STRANGE * end or len(places) == _MOST_KINDS:
        raise LogError(
            f"'{where}' is damaged: {strange:,} of {end:,} bytes belong to no packet.\n"
            "Take the file as the ground station wrote it."
        )
    return _joined(np.frombuffer(raw, dtype=np.uint8), places, known)


def _size(raw: bytes, place: int) -> int:
    """Return the length of a time and the packet behind it; zero where there is none."""
    start = place + _STAMP
    header = _HEADER.get(raw[start])
    if header is None or not _looks_like(raw[place : start + 3]):
        return 0
    signed = raw[start] == _V2 and raw[start + 2] & _SIGNED
    return _STAMP + header + raw[start + 1] + 2 + (_SIGNATURE if signed else 0)


def _joined(
    content: NDArray[np.uint8],
    places: dict[tuple[int, int, int, int, int], array[int]],
    known: dict[int, _Definition],
) -> dict[tuple[int, int, str], Packets]:
    """Return packets of all lengths of a message together, in the order of their arrival."""
    parts: dict[tuple[int, int, str], list[tuple[NDArray[Any], NDArray[Any], NDArray[Any]]]] = {}
    for (system, component, number, version, length), starts in places.items():
        first = np.frombuffer(starts, dtype=np.int64)
        header = _HEADER[version]
        body = _taken(content, first + _STAMP + 1, header - 1 + length + 2)
        first = first[_sound(body, known[number].extra)]
        # zeros at the end of a payload are not sent; version 1 has no extensions
        packed = np.zeros((first.size, known[number].packed.itemsize), dtype=np.uint8)
        used = min(length, packed.shape[1])
        packed[:, :used] = _taken(content, first + _STAMP + header, used)
        rows = packed.view(known[number].packed)[:, 0]
        arrived = _taken(content, first, _STAMP).view(">i8")[:, 0].astype(np.int64)
        key = (system, component, known[number].name)
        parts.setdefault(key, []).append((first, rows, arrived))
    found = {}
    for key, pieces in parts.items():
        order = np.argsort(np.concatenate([first for first, _, _ in pieces]))
        rows = np.concatenate([rows for _, rows, _ in pieces])[order]
        arrived = np.concatenate([arrived for _, _, arrived in pieces])[order]
        if rows.size:
            found[key] = Packets(rows=rows, arrived=arrived)
    return found


def _taken(content: NDArray[np.uint8], first: NDArray[np.int64], size: int) -> NDArray[np.uint8]:
    """Return so many bytes from each place on, shape (places, size)."""
    out = np.empty((first.size, size), dtype=np.uint8)
    for k in range(size):
        out[:, k] = content[first + k]
    return out


def _sound(body: NDArray[np.uint8], extra: int) -> NDArray[np.bool_]:
    """Return which packets have the right checksum (CRC-16/MCRF4XX).

    Args:
        body: header without its first byte, payload and checksum, shape (packets, bytes).
        extra: byte of the message's definition, which is summed last.
    """
    crc = np.full(body.shape[0], 0xFFFF, dtype=np.uint16)
    last = np.full((body.shape[0], 1), extra, dtype=np.uint8)
    for column in np.concatenate([body[:, :-2], last], axis=1).T:
        low = column ^ (crc & 0xFF).astype(np.uint8)
        low = (low ^ (low << 4)).astype(np.uint16)
        crc = (crc >> 8) ^ (low << 8) ^ (low << 3) ^ (low >> 4)
    sent = body[:, -2].astype(np.uint16) | body[:, -1].astype(np.uint16) << 8
    matches: NDArray[np.bool_] = crc == sent
    return matches


@dataclass(frozen=True, kw_only=True)
class _Definition:
    """Name, byte of the checksum and layout of a message."""

    name: str
    extra: int
    packed: np.dtype[Any]


@functools.cache
def _definitions() -> dict[int, _Definition]:
    with optional_import(
        "telemetry logs need pymavlink", "Install it: pip install 'aam-seals[logs]'"
    ):
        from pymavlink.dialects.v20 import ardupilotmega
    found = {}
    for number, message in ardupilotmega.mavlink_map.items():
        # NumPy knows the letters of `struct`
        codes = iter(message.native_format.decode("ascii").lstrip("<"))
        layout = []
        for name, length in zip(message.ordered_fieldnames, message.array_lengths, strict=True):
            code = next(codes)
            text = f"S{length}" if code == "c" else f"({length},)<{code}" if length else f"<{code}"
            layout.append((str(name), text))
        found[int(number)] = _Definition(
            name=str(message.msgname), extra=int(message.crc_extra), packed=np.dtype(layout)
        )
    return found
