"""A stand-in for PX4's SITL: it packs and reads MAVLink itself, and climbs by a PD law of its own.

It shares no code with SEALS, nor a MAVLink library. ``python fake_px4.py PORT SECONDS HEIGHT``.
"""

from __future__ import annotations

import json
import math
import socket
import struct
import sys
import time
from typing import Any

HIL_SENSOR, HIL_GPS, HIL_STATE, CONTROLS = 107, 113, 115, 93
EXTRA = {HIL_SENSOR: 108, HIL_GPS: 124, HIL_STATE: 4, CONTROLS: 47, 0: 50}
"""CRC seeds by message, from the protocol's definitions."""


def crc(raw: bytes, extra: int) -> int:
    """CRC-16/MCRF4XX of a message and its seed."""
    value = 0xFFFF
    for byte in [*raw, extra]:
        part = (byte ^ value) & 0xFF
        part = (part ^ (part << 4)) & 0xFF
        value = (value >> 8) ^ (part << 8) ^ (part << 3) ^ (part >> 4)
    return value & 0xFFFF


def packed(number: int, body: bytes) -> bytes:
    """Return a message of MAVLink 2."""
    head = struct.pack("<BBBBBB", len(body), 0, 0, 0, 1, 1) + number.to_bytes(3, "little")
    return b"\xfd" + head + body + struct.pack("<H", crc(head + body, EXTRA[number]))


def read(buffer: bytearray) -> tuple[int, bytes] | None:
    """Take a message off the front of a buffer; its end zeros are cut in flight."""
    while len(buffer) >= 12:
        assert buffer[0] == 0xFD, buffer[:4]
        size = buffer[1]
        if len(buffer) < 12 + size:
            return None
        raw = bytes(buffer[: 12 + size])
        del buffer[: 12 + size]
        number = int.from_bytes(raw[7:10], "little")
        (check,) = struct.unpack("<H", raw[-2:])
        assert check == crc(raw[1:-2], EXTRA[number])
        return number, raw[10:-2] + bytes(80)
    return None


def controls(stamp: int, values: list[float], armed: bool) -> bytes:
    """Return HIL_ACTUATOR_CONTROLS in lockstep."""
    mode = 128 if armed else 0
    return packed(CONTROLS, struct.pack("<QQ16fB", stamp, 1, *values, *[math.nan] * 12, mode))


def fly(port: int, seconds: float, height: float) -> dict[str, Any]:
    """Climb to a height and hold it; return what was seen."""
    for _ in range(600):
        try:
            wire = socket.create_connection(("127.0.0.1", port), timeout=30)
            break
        except OSError:
            time.sleep(0.05)
    wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    wire.sendall(b"rubbish" + packed(0, bytes(9)))
    buffer = bytearray()
    seen: dict[str, Any] = {"sensors": [], "gps": 0, "heights": [], "stamps": [], "up": []}
    hover = math.sqrt(0.027 * 9.81 / 4 / 1.28e-8) / 3053.0
    home, down, started = None, 0.0, 0
    while True:
        while (found := read(buffer)) is None:
            raw = wire.recv(65536)
            if not raw:
                return seen
            buffer += raw
        number, body = found
        if number == HIL_SENSOR:
            stamp, *values = struct.unpack_from("<Q13f", body)
            seen["sensors"].append(values)
            seen["stamps"].append(stamp)
        elif number == HIL_GPS:
            seen["gps"] += 1
            seen["fix"] = struct.unpack_from("<QiiiHHHhhhHBB", body)
        elif number == HIL_STATE:
            stamp, *values = struct.unpack_from("<Q7fiiihhhHHhhh", body)
            home = values[9] if home is None else home
            up, down = (values[9] - home) / 1e3, values[12] / 100.0
            seen["heights"].append(up)
            seen["quaternion"] = values[:4]
            if len(seen["heights"]) <= 50:
                # starting up: silent, as PX4 is
                continue
            started += 1
            push = 0.25 * max(-0.6, min(0.6, height - up)) + 0.18 * down
            share = max(0.0, min(1.0, hover * (1.0 + push)))
            wire.sendall(controls(stamp, [share] * 4, armed=started > 5))
            if started > seconds * 250:
                wire.close()
                return seen


if __name__ == "__main__":
    result = fly(int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3]))
    keep = ("gps", "fix", "heights", "stamps", "quaternion")
    print(json.dumps({**{k: result[k] for k in keep}, "sensors": result["sensors"][:2000]}))
