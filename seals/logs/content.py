"""Kind of a foreign log by the first bytes of its content."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path

from seals.errors import LogError
from seals.untrusted_io import regular_file, unreadable

_LOOKED_AT = 1 << 12
_MOST = 1 << 34
_MAVLINK = (0xFE, 0xFD)
_CENTURY = (946_684_800_000_000, 4_102_444_800_000_000)
"""Microseconds since 1970, from the year 2000 to 2100."""
BLACKBOX = b"H Product:Blackbox"
"""First bytes of a raw log of Betaflight."""
DECODE = "blackbox_decode --unit-rotation deg/s --unit-acceleration g FILE"
"""Command of the program of Betaflight that makes tables of its logs."""
_TABLE = re.compile(rb"[^\r\n\0]*[,;\t|][^\r\n\0]*\r?\n")

_STARTS: tuple[tuple[bytes, str], ...] = (
    (b"ULog\x01\x12\x35", "ulog"),
    (b"\x89MCAP0\r\n", "mcap"),
    (b"SQLite format 3\0", "rosbag2"),
    (b"#ROSBAG V2.0\n", "rosbag1"),
    (b"\xa3\x95", "dataflash"),
    (b"MATLAB ", "matlab"),
    (b"\x89HDF\r\n\x1a\n", "matlab"),
    (b"loopIteration", "betaflight"),
    (b'"loopIteration', "betaflight"),
    (b'"Product","Blackbox', "betaflight"),
)
"""First bytes -> reader."""
_REFUSED: tuple[tuple[bytes, str, str], ...] = (
    (
        BLACKBOX,
        "a raw log of Betaflight",
        f"Decode it: {DECODE}; then convert the table",
    ),
    (b"#ROSBAG V1", "a bag of an old ROS version", "Convert it: rosbag migrate OLD NEW"),
    (b"FMT, 128,", "a DataFlash log as text", "Use the .bin file from which it was made"),
    (b"PK\x03\x04", "a ZIP archive (or a workbook)", "Decompress it, or save the sheet as CSV"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "Unpack it"),
    (b"Rar!", "a RAR archive", "Unpack it"),
    (b"BZh", "packed with bzip2", "Unpack it: bunzip2 FILE"),
    (b"\xfd7zXZ\0", "packed with xz", "Unpack it: unxz FILE"),
    (b"\x28\xb5\x2f\xfd", "packed with zstd", "Decompress it: zstd -d FILE"),
    (b"version https://git-lfs", "a pointer of Git LFS", "Fetch the file itself: git lfs pull"),
    (b"RRF", "a recording of Rerun", "Record as MCAP as well, or write its numbers as a CSV table"),
    (b"PAR1", "a Parquet table", "Name it log.parquet, in a folder with meta.yaml: reader=native"),
    (b"{", "JSON", "Write its numbers as a table: CSV with a column for the time"),
    (b"<", "XML or a web page", "Download the log itself, or write a CSV table"),
)
"""First bytes -> what it is, and the next step."""


def reader_by_content(
    place: Path, others: Mapping[str, Callable[[bytes], bool]] | None = None
) -> str | None:
    """Return the reader for a file, by its first bytes; None where they do not decide.

    Args:
        place: a file, plain or ``.gz``.
        others: tests of the readers of other packages, by name; what ships is tried first.

    Raises:
        LogError: it is of a kind that no reader takes; the next step is said.
    """
    start = _start(place)
    for magic, reader in _STARTS:
        if start.startswith(magic):
            return reader
    shapes = (*_SHAPES, *((test, reader) for reader, test in (others or {}).items()))
    for test, reader in shapes:
        if test(start):
            return reader
    for magic, what, remedy in _REFUSED:
        if start.startswith(magic):
            raise LogError(f"'{place}' is {what}, which no reader accepts.\n{remedy}")
    return "csv" if _TABLE.match(start) and _is_text(start) else None


def _start(place: Path) -> bytes:
    """Return the first bytes of a file, unpacked where it is packed with gzip."""
    file = regular_file(place, most=_MOST)
    try:
        with file.open("rb") as stream:
            raw = stream.read(_LOOKED_AT)
    except OSError as error:
        raise unreadable(place, error) from error
    if raw[:2] == b"\x1f\x8b" and place.suffix == ".gz":
        try:
            raw = zlib.decompressobj(wbits=31).decompress(raw, _LOOKED_AT)
        except zlib.error as error:
            raise LogError(f"'{place}' is not a valid .gz file ({error}).") from error
    return raw.removeprefix(b"\xef\xbb\xbf")


def _telemetry(start: bytes) -> bool:
    """Return whether a time of this century and a packet of MAVLink stand there."""
    if len(start) < 11 or start[8] not in _MAVLINK:
        return False
    stamp = int(struct.unpack_from(">Q", start)[0])
    return _CENTURY[0] < stamp < _CENTURY[1]


def _crazyflie(start: bytes) -> bool:
    """Return whether the head of a micro-SD log stands there: 0xBC, format 1 or 2, some events."""
    if len(start) < 7 or start[0] != 0xBC:
        return False
    version, events = struct.unpack_from("<HH", start, 1)
    return version in (1, 2) and 0 < events <= 64


def _witmotion(start: bytes) -> bool:
    """Return whether a heading of a program of WitMotion stands there."""
    return any(title in start for title in (b"ax(g)", b"AccX(g)", b"Acceleration X(g)"))


def _hdf5_later(start: bytes) -> bool:
    """Return whether HDF5 stands behind a block of the user, as in MATLAB 7.3."""
    return start[512:520] == b"\x89HDF\r\n\x1a\n"


_SHAPES: tuple[tuple[Callable[[bytes], bool], str], ...] = (
    (_telemetry, "tlog"),
    (_crazyflie, "crazyflie"),
    (_hdf5_later, "matlab"),
    (_witmotion, "witmotion"),
)


def _is_text(start: bytes) -> bool:
    try:
        start[: start.rfind(b"\n") + 1].decode("utf-8")
    except UnicodeDecodeError:
        return False
    return b"\0" not in start
