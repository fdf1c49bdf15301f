"""The Crazyflie binary layout, from bytes packed by hand."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

from seals.errors import LogError
from seals.plugins.readers.crazyflie import ReaderCrazyflie, parse

NAMES = [f"acc.{x}(f)" for x in "xyz"] + [f"gyro.{x}(f)" for x in "xyz"]
NAMES += [f"motor.m{k}(H)" for k in (1, 2, 3, 4)]


def _header(*, version: int = 2, events: int = 1, variables: int | None = None) -> bytes:
    names = b"".join(name.encode() + b"\0" for name in NAMES)
    count = len(NAMES) if variables is None else variables
    return (
        struct.pack("<BHH", 0xBC, version, events)
        + struct.pack("<H", 7)
        + b"fixed\0"
        + struct.pack("<H", count)
        + names
    )


def _row(k: int, *, version: int = 2) -> bytes:
    stamp = struct.pack("<HQ", 7, 1_000_000 + 1000 * k)
    if version == 1:
        stamp = struct.pack("<HI", 7, 1000 + k)
    return stamp + struct.pack("<6f4H", 0.0, 0.0, 1.0, 0.0, 0.0, 90.0, 0, 65535, 32768, 1)


def _sealed(body: bytes) -> bytes:
    return body + struct.pack("<I", zlib.crc32(body))


@pytest.mark.parametrize("version", [1, 2])
def test_units_and_time_come_out_in_si(tmp_path: Path, version: int) -> None:
    """Time in s, 1 g = 9.80665, 90 deg/s = pi/2, full pulse width = 1, in both versions."""
    body = _header(version=version) + b"".join(_row(k, version=version) for k in range(5))
    (tmp_path / "log").write_bytes(_sealed(body))
    (log,) = ReaderCrazyflie().read(tmp_path / "log")
    assert log.time == pytest.approx(1.0 + 0.001 * np.arange(5))
    assert log.columns["specific_force_z"][0] == pytest.approx(9.80665)
    assert log.columns["angular_velocity_z"][0] == pytest.approx(np.pi / 2)
    assert log.channel("motor_pwm")[0] == pytest.approx([0.0, 1.0, 32768 / 65535, 1 / 65535])


def test_file_cut_short_is_refused_unless_allowed() -> None:
    """A cut file is refused; when allowed, the whole records before the cut are read."""
    whole = _sealed(_header() + b"".join(_row(k) for k in range(5)))
    cut = whole[: len(_header()) + 3 * len(_row(0)) + 11]
    with pytest.raises(LogError, match="allow_truncated=true"):
        parse(cut, where="log")
    assert parse(cut, where="log", allow_truncated=True)["fixed"]["t"].size == 3


def test_one_flipped_bit_is_noticed() -> None:
    """The checksum covers every byte."""
    content = bytearray(_sealed(_header() + b"".join(_row(k) for k in range(5))))
    content[-30] ^= 1
    with pytest.raises(LogError, match="checksum"):
        parse(bytes(content), where="log")


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (b"\xbd\x02\x00", "does not begin with"),
        (_header(version=3), "format version 3"),
        (_header(events=60000), "declares 60000 events"),
        (_header(variables=60000), "declares 60000 variables"),
        (_header()[:20], "not terminated|truncated"),
        (_header().replace(b"(H)", b"(s)"), "no known type"),
        (_header(), "no records"),
        (_header() + struct.pack("<H", 9) + b"\0" * 60, "not begin a known record"),
    ],
)
def test_false_declarations_are_refused(body: bytes, words: str) -> None:
    """Huge counts, unknown types and unknown records are refused in words, checksum or not."""
    with pytest.raises(LogError, match=words):
        parse(_sealed(body), where="log")


def _blocks(*blocks: tuple[str, dict[str, float]]) -> bytes:
    """Return a log with a row of each event block, floats all."""
    head, rows = struct.pack("<BHH", 0xBC, 2, len(blocks)), b""
    for key, (name, values) in enumerate(blocks):
        head += struct.pack("<H", key) + name.encode() + b"\0" + struct.pack("<H", len(values))
        head += b"".join(f"{variable}(f)\0".encode() for variable in values)
        stamps = (struct.pack("<HQ", key, 1_000_000 + 10_000 * k) for k in range(3))
        rows += b"".join(s + struct.pack(f"<{len(values)}f", *values.values()) for s in stamps)
    return _sealed(head + rows)


def test_event_without_accelerometer_is_refused(tmp_path: Path) -> None:
    """Of several blocks none is guessed: the message names them, and the option that selects."""
    blocks = ("slow", {"pm.vbatMV": 3900.0}), ("marker", {"lh.x": 0.0})
    (tmp_path / "log").write_bytes(_blocks(*blocks))
    with pytest.raises(LogError, match=r"reader.event= selects one of: .*slow"):
        ReaderCrazyflie().read(tmp_path / "log")
    (log,) = ReaderCrazyflie(event="slow").read(tmp_path / "log")
    assert log.columns["battery_voltage"] == pytest.approx([3.9] * 3)


def test_the_only_block_is_read_with_the_estimates_of_the_filter(tmp_path: Path) -> None:
    """Position in m, attitude as a quaternion, V and mV; no noise is stated of absent sensors."""
    pose = {f"stateEstimate.{n}": v for n, v in zip("xyz", (1.0, -2.0, 0.5), strict=True)}
    turn = {f"stateEstimate.q{n}": v for n, v in zip("xyzw", (0.0, 0.6, 0.0, 0.8), strict=True)}
    (tmp_path / "log").write_bytes(_blocks(("fixed", pose | turn | {"pm.vbat": 3.7})))
    (log,) = ReaderCrazyflie().read(tmp_path / "log")
    assert log.channel("position")[0] == pytest.approx([1.0, -2.0, 0.5])
    assert log.channel("orientation")[0] == pytest.approx([0.8, 0.0, 0.6, 0.0])
    assert log.columns["battery_voltage"] == pytest.approx([3.7] * 3)
    assert "sensors" not in log.meta
