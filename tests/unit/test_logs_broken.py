"""Broken and hostile logs: each is refused in words, quickly, and nothing is written."""

from __future__ import annotations

import gzip
import io
import os
import struct
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs import Log, read_native, refuse_if_bad
from seals.logs.arrays import read_npy, read_npz
from seals.plugins.readers.balls import ReaderBalls
from seals.plugins.readers.crazyflie import ReaderCrazyflie
from seals.plugins.readers.csv import ReaderCsv
from seals.plugins.readers.flume import ReaderFlume
from seals.plugins.readers.glider import ReaderGlider
from seals.plugins.readers.impack import ReaderImpack
from seals.plugins.readers.pendulum import ReaderPendulum
from seals.untrusted_io import read_bytes

if TYPE_CHECKING:
    import pandas as pd

META = "format: hidden-effect-log\nformat_version: 1\n"
PATIENCE = 2.0


def _table(rows: int = 400) -> pd.DataFrame:
    """A quadrotor at rest for 4 s: 9.81 upwards, a quiet gyro, level."""
    import pandas as pd

    noise = np.random.default_rng(7).normal(0.0, 0.01, (rows, 6))
    frame: pd.DataFrame = pd.DataFrame({"t": np.arange(rows) * 0.01})
    for k, axis in enumerate("xyz"):
        frame[f"specific_force_{axis}"] = noise[:, k] + (9.81 if axis == "z" else 0.0)
        frame[f"angular_velocity_{axis}"] = noise[:, 3 + k]
    for axis in "wxyz":
        frame[f"orientation_{axis}"] = float(axis == "w")
    return frame


def _backwards(frame: pd.DataFrame) -> None:
    frame["t"] = frame["t"].to_numpy()[::-1]


def _repeated(frame: pd.DataFrame) -> None:
    frame["t"] = np.floor(frame["t"] * 50.0) / 50.0


def _holes_in_time(frame: pd.DataFrame) -> None:
    frame.loc[100:110, "t"] = np.nan


def _in_g(frame: pd.DataFrame) -> None:
    frame[[f"specific_force_{x}" for x in "xyz"]] /= 9.81


def _in_milli_g(frame: pd.DataFrame) -> None:
    frame[[f"specific_force_{x}" for x in "xyz"]] *= 1000.0 / 9.81


def _down(frame: pd.DataFrame) -> None:
    frame[["specific_force_y", "specific_force_z"]] *= -1.0


def _euler(frame: pd.DataFrame) -> None:
    frame["orientation_w"] = 0.3


def _no_samples(frame: pd.DataFrame) -> None:
    frame[frame.columns[1:]] = np.nan


def _infinite(frame: pd.DataFrame) -> None:
    frame.loc[5, "specific_force_x"] = np.inf


def _absurd(frame: pd.DataFrame) -> None:
    frame.loc[5, "angular_velocity_x"] = 1e300


def _text(frame: pd.DataFrame) -> None:
    frame["specific_force_x"] = frame["specific_force_x"].astype(str)
    frame.loc[7, "specific_force_x"] = "broken"


BREAKS: dict[str, tuple[Callable[[pd.DataFrame], None], str]] = {
    "time backwards": (_backwards, "backwards"),
    "time repeated": (_repeated, "equal the preceding"),
    "time not finite": (_holes_in_time, "not finite"),
    "accelerometer in g": (_in_g, "looks like g"),
    "accelerometer in mg": (_in_milli_g, "looks like mg"),
    "body axes down": (_down, "FRD"),
    "angles as quaternion": (_euler, "unit length"),
    "no samples": (_no_samples, "no channel holds"),
    "infinite": (_infinite, "infinite"),
    "absurdly large": (_absurd, "beyond 1e"),
    "text among numbers": (_text, "broken"),
}


@pytest.mark.parametrize("name", BREAKS)
def test_broken_log_is_refused_in_words(tmp_path: Path, name: str) -> None:
    """Each of these broken logs is refused with the cause in the message."""
    spoil, words = BREAKS[name]
    frame = _table()
    spoil(frame)
    frame.to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "meta.yaml").write_text(META)
    with pytest.raises(LogError, match=words):
        refuse_if_bad(read_native(tmp_path))


def test_the_same_log_unbroken_is_accepted(tmp_path: Path) -> None:
    """The log that these are made from passes."""
    _table().to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "meta.yaml").write_text(META)
    refuse_if_bad(read_native(tmp_path))


def test_too_few_rows_are_refused() -> None:
    """Nine rows say nothing about dynamics."""
    log = Log(name="short", columns={"t": np.arange(9.0), "depth": np.arange(9.0)})
    with pytest.raises(LogError, match="9 rows"):
        refuse_if_bad(log)


def _parquet(place: Path, cut: float = 1.0) -> None:
    raw = io.BytesIO()
    _table().to_parquet(raw)
    content = raw.getvalue()
    (place / "log.parquet").write_bytes(content[: int(len(content) * cut)])


def _native(place: Path, *, table: bytes | None = None, meta: bytes = META.encode()) -> None:
    if table is None:
        _parquet(place)
    else:
        (place / "log.csv").write_bytes(table)
    (place / "meta.yaml").write_bytes(meta)


def _cut(place: Path, share: float) -> None:
    _native(place)
    _parquet(place, share)


def _swap(place: Path) -> None:
    _native(place)
    (place / "log.parquet").unlink()
    (place / "log.parquet").mkdir()


def _pipe(place: Path) -> None:
    _native(place)
    (place / "log.parquet").unlink()
    os.mkfifo(place / "log.parquet")


def _laughs() -> bytes:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 12)]
    return (META + "\n".join(lines)).encode()


SCRIPT = META.encode() + b"x: !!python/object/apply:os.system ['touch owned']\n"
HOSTILE: dict[str, tuple[Callable[[Path], None], str]] = {
    "empty table": (lambda p: _native(p, table=b""), "is empty"),
    "blank header": (lambda p: _native(p, table=b"\n\n"), "no header"),
    "not UTF-8": (lambda p: _native(p, table=b"t,\xff\xfe\n0,1\n"), "not UTF-8"),
    "binary": (lambda p: _native(p, table=b"\0\0\0\n\0\0"), "no header"),
    "no t": (lambda p: _native(p, table=b"time,depth\n0,1\n"), "no time column"),
    "column twice": (lambda p: _native(p, table=b"t,depth,depth\n0,1,2\n"), "twice: depth"),
    "ragged": (lambda p: _native(p, table=b"t,depth\n0,1,2\n"), "cannot be read"),
    "segment of halves": (lambda p: _native(p, table=b"t,segment\n0,0.5\n"), "an integer"),
    "only a header": (lambda p: _native(p, table=b"t,depth\n"), "no rows"),
    "meta empty": (lambda p: _native(p, meta=b""), "is empty"),
    "meta a list": (lambda p: _native(p, meta=b"- 1\n- 2\n"), "contains a list"),
    "meta runs code": (lambda p: _native(p, meta=SCRIPT), "not plain YAML"),
    "meta too deep": (lambda p: _native(p, meta=b"[" * 100_000), "nested deeper"),
    "meta not UTF-8": (lambda p: _native(p, meta=b"a: \xff\n"), "not UTF-8"),
    "meta explodes": (lambda p: _native(p, meta=_laughs()), "entries"),
    "meta huge": (lambda p: _native(p, meta=b"#" * (2 << 20)), "the limit is"),
    "other format": (lambda p: _native(p, meta=b"format: rosbag\n"), "format is 'rosbag'"),
    "newer version": (
        lambda p: _native(p, meta=META.replace("1", "9").encode()),
        "format_version is '9'",
    ),
    "meta not finite": (lambda p: _native(p, meta=(META + "m: .nan\n").encode()), "meta.m"),
    "parquet cut": (lambda p: _cut(p, 0.6), "not a valid Parquet"),
    "parquet one byte": (lambda p: _cut(p, 1e-4), "Parquet|empty"),
    "table is a folder": (_swap, "is a folder"),
    "table is a pipe": (_pipe, "not a regular file"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_folder_is_refused_quickly(tmp_path: Path, name: str) -> None:
    """Each hostile folder is refused in words within 2 s, and nothing is written."""
    build, words = HOSTILE[name]
    build(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    start = time.process_time()
    with pytest.raises(LogError, match=words):
        read_native(tmp_path)
    assert time.process_time() - start < PATIENCE
    assert sorted(tmp_path.rglob("*")) == before


def test_file_that_declares_too_much_is_refused(tmp_path: Path) -> None:
    """A header of an array a thousand million million values long is not believed."""
    head = io.BytesIO()
    shape = {"descr": "<f8", "fortran_order": False, "shape": (10**15,)}
    np.lib.format.write_array_header_1_0(head, shape)
    (tmp_path / "a.npy").write_bytes(head.getvalue() + b"\0" * 64)
    with pytest.raises(LogError, match="declares an array of shape"):
        read_npy(tmp_path / "a.npy")
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("x.npy", head.getvalue() + b"\0" * 64)
    with pytest.raises(LogError, match="declares an array of shape"):
        read_npz(tmp_path / "a.npz", ["x"])


def test_numbers_of_one_byte_are_counted(tmp_path: Path) -> None:
    """As numbers of a log they take eight times the room; and true is no size."""
    count = (1 << 26) + 1
    for shape, words in ((count,), "holds 67,108,865 numbers"), ((True,), "whole numbers"):
        with (tmp_path / "a.npy").open("wb") as file:
            head = {"descr": "|u1", "fortran_order": False, "shape": shape}
            np.lib.format.write_array_header_1_0(file, head)
            file.truncate(file.tell() + int(shape[0]))
        with pytest.raises(LogError, match=words):
            read_npy(tmp_path / "a.npy")


def test_pickled_array_is_refused(tmp_path: Path) -> None:
    """Python objects in a NumPy file are never loaded."""
    np.save(tmp_path / "a.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(LogError, match="numbers are needed"):
        read_npy(tmp_path / "a.npy")


def test_gzip_bomb_and_cut_gzip_are_refused(tmp_path: Path) -> None:
    """Packed data that unfold beyond the limit, or end early, are refused."""
    packed = gzip.compress(b"0" * 1_000_000)
    (tmp_path / "a.csv.gz").write_bytes(packed)
    with pytest.raises(LogError, match="decompresses to more"):
        read_bytes(tmp_path / "a.csv.gz", most=10_000)
    (tmp_path / "b.csv.gz").write_bytes(packed[:-20])
    with pytest.raises(LogError, match="truncated"):
        read_bytes(tmp_path / "b.csv.gz")


GARBAGE = np.random.default_rng(3).bytes(5000)


@pytest.mark.parametrize(
    "reader",
    [
        ReaderBalls(),
        ReaderCrazyflie(),
        ReaderCsv(),
        ReaderFlume(),
        ReaderGlider(),
        ReaderImpack(),
        ReaderPendulum(),
    ],
    ids=lambda reader: type(reader).__name__,
)
@pytest.mark.parametrize("content", [b"", GARBAGE, b"t,x\n1,two\n"], ids=["empty", "noise", "text"])
def test_every_reader_refuses_garbage(tmp_path: Path, reader: object, content: bytes) -> None:
    """An empty file, noise and the wrong text are refused in words within 2 s."""
    file = tmp_path / "data.bin"
    file.write_bytes(content)
    start = time.process_time()
    with pytest.raises(LogError):
        reader.read(file)  # type: ignore[attr-defined]
    assert time.process_time() - start < PATIENCE
    assert list(tmp_path.iterdir()) == [file]


HEADS = {
    "signs": "-" * 9000 + "1",
    "a shape of signs": "{'descr':'<f8','fortran_order':False,'shape':(" + "-" * 9000 + "1,)}",
    "brackets": "(" * 300,
    "a chain": "not " * 2000 + "1",
    "digits": "1" * 9000,
    "a null": "{'descr':'\0','fortran_order':False,'shape':(0,)}",
}


@pytest.mark.parametrize("name", HEADS)
def test_a_header_that_python_cannot_parse_is_refused(name: str, tmp_path: Path) -> None:
    """Its parser says that memory is wanting, which the user's machine has enough of."""
    head = HEADS[name].encode()
    (tmp_path / "a.npy").write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head)
    with pytest.raises(LogError, match="is not a valid NumPy array"):
        read_npy(tmp_path / "a.npy")
