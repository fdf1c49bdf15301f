"""Fuzz targets: readers of published measurements (spreadsheet, MATLAB, binary, tables)."""

from __future__ import annotations

import gzip
import io
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fuzz_targets import Target, checked


def _balls() -> Target:
    import openpyxl

    from seals.plugins.readers.balls import ReaderBalls

    book, stream = openpyxl.Workbook(), io.BytesIO()
    sheet = book.active
    sheet.title = "Golf Ball"
    sheet.append(["Drop #", "Time (s)", "Height (m)"])
    for k in range(30):
        sheet.append([1 + k // 15, k / 15, 30.0 - 0.1 * k])
    book.save(stream)
    return Target(whole=stream.getvalue(), name="a.xlsx", load=checked(ReaderBalls()))


def _pendulum() -> Target:
    from scipy.io import savemat

    from seals.plugins.readers.pendulum import ReaderPendulum

    def cells(*parts: Any) -> Any:
        out: Any = np.empty(len(parts), dtype=object)
        out[:] = parts
        return out

    time = np.arange(30) / 1000
    stream: Any = io.BytesIO()
    values = np.stack([np.pi + np.sin(time), np.cos(time)])
    groups = {"Time_id": cells(time, time + 1), "Y_id": cells(values, values)}
    groups |= {"Time_vad": cells(time, time + 1), "Y_vad": cells(values, values)}
    savemat(stream, groups, do_compression=True)
    return Target(whole=stream.getvalue(), name="a.mat", load=checked(ReaderPendulum()))


def _glider() -> Target:
    from seals.plugins.readers.glider import ReaderGlider

    stream = io.BytesIO()
    np.save(stream, np.arange(240.0).reshape(6, 40))
    return Target(whole=stream.getvalue(), name="a.npy", load=checked(ReaderGlider()))


def _crazyflie() -> Target:
    from seals.plugins.readers.crazyflie import parse

    names = [f"acc.{x}(f)" for x in "xyz"] + [f"gyro.{x}(f)" for x in "xyz"]
    body = struct.pack("<BHH", 0xBC, 2, 1) + struct.pack("<H", 7) + b"fixed\0"
    body += struct.pack("<H", len(names)) + b"".join(n.encode() + b"\0" for n in names)
    for k in range(30):
        body += struct.pack("<HQ6f", 7, 1000 * k, 0.0, 0.0, 1.0, 0.0, 0.0, 90.0)

    def load(path: Path) -> None:
        # sealed here: damage that the checksum catches would never get any further
        raw = path.read_bytes()
        parse(raw + struct.pack("<I", zlib.crc32(raw)), where=str(path), allow_truncated=True)

    return Target(whole=body, name="log", load=load)


def _flume() -> Target:
    from seals.plugins.readers.flume import ReaderFlume

    head = "Time [s],WM_Position [m],WP_4,WP_6,Heave\n"
    rows = "".join(f"{k / 200},{k % 3},0.0{k % 7},0.01,0.002\n" for k in range(40))
    whole = gzip.compress((head + rows).encode(), mtime=0)
    return Target(whole=whole, name="3042.csv.gz", load=checked(ReaderFlume()))


def _impack() -> Target:
    from seals.plugins.readers.impack import ReaderImpack

    stream = io.BytesIO()
    np.savez_compressed(stream, t_dc=np.arange(40) / 2000, acc_dc_g=np.ones((3, 40)))
    return Target(whole=stream.getvalue(), name="sphere_4.npz", load=checked(ReaderImpack()))


PUBLISHED: dict[str, Callable[[], Target]] = {
    "balls": _balls,
    "pendulum": _pendulum,
    "glider": _glider,
    "crazyflie": _crazyflie,
    "flume": _flume,
    "impack": _impack,
}
"""Readers of published data sets by name."""
