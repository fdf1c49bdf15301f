"""Hostile logs of vehicles, well-formed but not meant so: DataFlash, telemetry, bags, tables."""

from __future__ import annotations

import bz2
import os
import shutil
import struct
import subprocess
import time
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs.column_map import ColumnMap
from seals.logs.content import reader_by_content
from seals.logs.csv import read_csv
from seals.plugins.readers import dataflash, recording, tlog
from seals.plugins.readers.betaflight import ReaderBetaflight
from seals.plugins.readers.dataflash import ReaderDataflash
from seals.plugins.readers.matlab import ReaderMatlab
from seals.plugins.readers.matlab_file import arrays_of
from seals.plugins.readers.ned import quaternion_of
from seals.plugins.readers.recording import ReaderRosbag1

HEAD = b"\xa3\x95"
CODES = {"n": "4s", "N": "16s", "Z": "64s", "a": "64s"}
INERTIAL = "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"


def flash(kind: int, name: str, letters: str, labels: str, rows: list[tuple[Any, ...]]) -> bytes:
    """A declaration of DataFlash and its messages."""
    layout = "<" + "".join(CODES.get(letter, letter) for letter in letters)
    size = 3 + struct.calcsize(layout)
    head = (kind, size, name.encode(), letters.encode(), labels.encode())
    raw = HEAD + b"\x80" + struct.pack("<BB4s16s64s", *head)
    return raw + b"".join(HEAD + bytes([kind]) + struct.pack(layout, *row) for row in rows)


@pytest.mark.parametrize(
    ("letter", "stamp"),
    [
        pytest.param("Z", b"abc", id="text"),
        pytest.param("a", b"\1" * 64, id="list"),
        pytest.param("f", float("nan"), id="nan"),
        pytest.param("d", 1e300, id="huge"),
    ],
)
def test_a_time_that_is_no_whole_number_is_no_time(
    letter: str, stamp: object, tmp_path: Path
) -> None:
    """Whatever the declaration calls TimeUS: its messages are left out, the log is empty."""
    rows = [(stamp, *[1.0] * 6)] * 5
    file = tmp_path / "a.bin"
    file.write_bytes(flash(66, "IMU", f"{letter}ffffff", INERTIAL, rows))
    with pytest.raises(LogError, match="contains no sample"):
        ReaderDataflash().read(file)


def test_a_list_is_no_parameter(tmp_path: Path) -> None:
    """Values of parameters are numbers; without one every output in use counts as a motor."""
    raw = flash(64, "PARM", "QNa", "TimeUS,Name,Value", [(1, b"SERVO1_FUNCTION", b"\1" * 64)])
    raw += flash(71, "RCOU", "QHH", "TimeUS,C1,C2", [(1000 * k, 1500, 1600) for k in range(9)])
    file = tmp_path / "a.bin"
    file.write_bytes(raw)
    (log,) = ReaderDataflash().read(file)
    assert log.channel("motor_pwm")[0].tolist() == [1500.0, 1600.0]


def test_angles_without_end_are_no_attitude() -> None:
    """An infinite angle has no sine: the attitude is unknown, and nothing is said of it."""
    one, none = np.zeros(2), np.array([0.0, np.inf])
    w, *_ = quaternion_of(one, none, one)
    assert w[0] == 1.0
    assert np.isnan(w[1])


def test_bytes_of_no_message_are_given_up_early(monkeypatch: pytest.MonkeyPatch) -> None:
    """A file of heads alone, or of gaps, is refused at the tenth that is too much, not behind."""
    looked = []

    class Counted(bytes):
        def find(self, *words: Any) -> int:  # type: ignore[override]
            looked.append(words)
            return super().find(*words)

    with pytest.raises(LogError, match="belong to no message"):
        dataflash.parse(Counted(HEAD * 10_000), where="a.bin")
    assert len(looked) < 1_100


def test_messages_of_all_logs_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The shortest messages make the longest work: their number is bounded, of packets, too."""
    monkeypatch.setattr(dataflash, "_MOST_MESSAGES", 100)
    raw = flash(66, "AAA", "B", "A", [(1,)] * 99)
    dataflash.parse(raw, where="a.bin")
    with pytest.raises(LogError, match="more than 100 messages"):
        dataflash.parse(raw + raw, where="a.bin")


def test_packets_and_gaps_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Packets of sixteen bytes, and times that no packet follows."""
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    stamp = struct.pack(">Q", 1_700_000_000_000_000)
    packet = stamp + b"\xfe\0\0\1\1\0" + bytes(2)
    monkeypatch.setattr(tlog, "_MOST_PACKETS", 100)
    tlog.parse(packet * 100, where="a.tlog")
    with pytest.raises(LogError, match="more than 100 packets"):
        tlog.parse(packet * 101, where="a.tlog")
    gaps = packet + (b"\0\3" * 4 + b"\xfd\3" * 4) * 100
    with pytest.raises(LogError, match="more than 100 packets and gaps"):
        tlog.parse(gaps + packet * 200, where="a.tlog")


def record(header: dict[str, bytes], data: bytes) -> bytes:
    """A record of a bag."""
    entries = [name.encode() + b"=" + value for name, value in header.items()]
    raw = b"".join(struct.pack("<I", len(entry)) + entry for entry in entries)
    return struct.pack("<I", len(raw)) + raw + struct.pack("<I", len(data)) + data


def chunk(raw: bytes) -> bytes:
    """A packed chunk of a bag."""
    size = struct.pack("<I", len(raw))
    return record({"op": b"\x05", "compression": b"bz2", "size": size}, bz2.compress(raw))


def test_a_bag_unpacks_to_so_many_times_its_size(tmp_path: Path) -> None:
    """A few hundred bytes become no gigabytes, chunk by chunk."""
    index = record({"op": b"\x04"}, bytes(1 << 20))
    file = tmp_path / "a.bag"
    file.write_bytes(recording.MAGIC + chunk(index) * 30)
    assert file.stat().st_size < 10_000
    with pytest.raises(LogError, match="decompresses to more than"):
        ReaderRosbag1().read(file)


def test_zeros_are_no_records(tmp_path: Path) -> None:
    """A record says what it is: sixty megabytes of zeros would be eight million of them."""
    file = tmp_path / "a.bag"
    file.write_bytes(recording.MAGIC + bytes(1 << 20))
    with pytest.raises(LogError, match="does not state its type"):
        ReaderRosbag1().read(file)


def test_a_heading_of_blanks_is_read_in_no_time(tmp_path: Path) -> None:
    """A title of blanks took the time of its square: a minute for 40 kB."""
    title = "a" + " " * 40_000 + "x"
    file = tmp_path / "a.csv"
    file.write_text(
        f"loopIteration,time (us),{title},gyroADC[0] (deg/s)\n1,1,1,1\n2,1001,1,1\n3,2001,1,2\n"
    )
    begin = time.process_time()
    (log,) = ReaderBetaflight().read(file)
    assert time.process_time() - begin < 5.0
    assert log.columns["angular_velocity_x"] == pytest.approx(np.radians([1.0, 1.0, 2.0]))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"units": {"b": 5}}, r"units\.b=5"),
        ({"columns": {"a": "t", "b": 5}}, "columns"),
        ({"scale": {"b": 10**400}}, r"scale\.b=1000"),
        ({"negate": [5]}, "negate"),
    ],
)
def test_a_map_of_other_types_is_told(given: dict[str, Any], said: str) -> None:
    """Names are text and factors are numbers, whoever writes the map."""
    with pytest.raises(LogError, match=said):
        ColumnMap(**{"columns": {"a": "t", "b": "depth"}, **given}).refuse_stray()


def _table(tmp_path: Path) -> Path:
    file = tmp_path / "a.csv"
    file.write_text("a,b,c\n1,2,3\n2,3,4\n3,4,5\n")
    return file


@pytest.mark.parametrize(
    "given", [{"scale": {"b": 1e308}}, {"scale": {"b": 1e307}, "units": {"b": "km"}}]
)
def test_a_factor_that_leaves_the_numbers_is_told(given: dict[str, Any], tmp_path: Path) -> None:
    """Numbers that a factor or a unit makes infinite are refused in words."""
    chosen = ColumnMap(columns={"a": "t", "b": "depth"}, **given)
    with pytest.raises(LogError, match="that are too large"):
        read_csv(_table(tmp_path), chosen)


@pytest.mark.parametrize("factor", [1e300, 0.5])
def test_a_segment_is_a_whole_number(factor: float, tmp_path: Path) -> None:
    """Halves were cut to whole numbers without a word, 1e300 to any."""
    chosen = ColumnMap(columns={"a": "segment", "b": "t", "c": "depth"}, scale={"a": factor})
    with pytest.raises(LogError, match="segment column must contain an integer"):
        read_csv(_table(tmp_path), chosen)


def _modern(file: Path, more: str) -> None:
    """A file of MATLAB 7.3 with a strange entry beside two sound arrays."""
    h5py = pytest.importorskip("h5py", reason="h5py is not installed")
    with h5py.File(file, "w") as out:
        out["t"], out["depth"] = np.arange(10.0) / 10, np.arange(10.0)
        if more == "type":
            out["of_mine"] = np.dtype("f8")
            out["of_no_shape"] = h5py.Empty("f8")
        elif more == "elsewhere":
            secret = file.with_name("secret")
            secret.write_bytes(np.full(10, 7.0).tobytes())
            out.create_dataset("x", (10,), "<f8", external=[(str(secret), 0, 80)])
        elif more == "link":
            with h5py.File(file.with_name("secret"), "w") as secret_file:
                secret_file["x"] = np.full(10, 7.0)
            out["x"] = h5py.ExternalLink(str(file.with_name("secret")), "x")
        elif more == "virtual":
            with h5py.File(file.with_name("secret"), "w") as secret_file:
                secret_file["x"] = np.full(10, 7.0)
            layout = h5py.VirtualLayout((10,), "<f8")
            layout[:] = h5py.VirtualSource(str(file.with_name("secret")), "x", (10,))
            out.create_virtual_dataset("x", layout)
        elif more == "declared":
            out.create_dataset("x", (10**12,), "<f8", chunks=(1000,))
        elif more == "filter":
            made = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            made.set_chunk((10,))
            made.set_filter(32015, h5py.h5z.FLAG_OPTIONAL, (3,))
            space = h5py.h5s.create_simple((10,))
            h5py.h5d.create(out.id, b"x", h5py.h5t.IEEE_F64LE, space, made)
            out["x"].id.write_direct_chunk((0,), bytes(80), 0)


def test_a_type_of_hdf5_is_no_array(tmp_path: Path) -> None:
    """A named type beside the arrays keeps none of them from being read."""
    _modern(tmp_path / "a.mat", "type")
    found = arrays_of(tmp_path / "a.mat")
    assert found.pop("") == ["of_mine", "of_no_shape"]
    assert sorted(found) == ["depth", "t"]


def test_a_file_loads_no_filter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A packing that HDF5 does not know would have it load every library in a folder."""
    compiler = shutil.which("cc")
    if compiler is None or os.name != "posix":
        pytest.skip("needs a C compiler")
    ran, source, folder = tmp_path / "ran", tmp_path / "a.c", tmp_path / "filters"
    folder.mkdir()
    source.write_text(
        "#include <stdio.h>\n__attribute__((constructor)) static void run(void) "
        f'{{ FILE *f = fopen("{ran}", "w"); if (f) fclose(f); }}\n'
    )
    command = [compiler, "-shared", "-fPIC", "-o", str(folder / "liba.so"), str(source)]
    subprocess.run(command, check=True)
    _modern(tmp_path / "a.mat", "filter")
    # behind the writing, which would load them here
    monkeypatch.setenv("HDF5_PLUGIN_PATH", str(folder))
    with pytest.raises(LogError, match="cannot be read"):
        ReaderMatlab().read(tmp_path / "a.mat")
    assert not ran.exists()


@pytest.mark.parametrize("more", ["elsewhere", "virtual", "link"])
def test_numbers_of_other_files_are_no_array(more: str, tmp_path: Path) -> None:
    """What HDF5 would fetch from another file, of any kind and place, is left alone."""
    _modern(tmp_path / "a.mat", more)
    found = arrays_of(tmp_path / "a.mat")
    assert found.pop("") == ([] if more == "link" else ["x"])
    assert sorted(found) == ["depth", "t"]


def test_declared_values_are_counted_before_they_are_there(tmp_path: Path) -> None:
    """A few kilobytes declare eight terabytes."""
    _modern(tmp_path / "a.mat", "declared")
    with pytest.raises(LogError, match=r"'x' declares 1,000,000,000,000 values"):
        arrays_of(tmp_path / "a.mat")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_no_reader_is_chosen_for_a_pipe(tmp_path: Path) -> None:
    """Looking at the first bytes of a pipe would wait without end."""
    pipe = tmp_path / "flight.bin"
    os.mkfifo(pipe)
    # opened for reading and writing, no end of it waits for the other
    held = os.open(pipe, os.O_RDWR)
    try:
        # as much as is looked at, so that nobody waits here either
        os.write(held, b"\xa3\x95\x80" + bytes(1 << 15))
        with pytest.raises(LogError, match="not a regular file"):
            reader_by_content(pipe)
    finally:
        os.close(held)


def test_a_chunk_of_a_bag_unpacks_no_further_than_it_declares(tmp_path: Path) -> None:
    """Sixty-four megabytes that call themselves ten bytes are never there."""
    file = tmp_path / "a.bag"
    header = {"op": b"\x05", "compression": b"bz2", "size": struct.pack("<I", 10)}
    file.write_bytes(recording.MAGIC + record(header, bz2.compress(bytes(1 << 26))))
    tracemalloc.start()
    try:
        with pytest.raises(LogError, match="does not hold the 10 bytes"):
            ReaderRosbag1().read(file)
        assert tracemalloc.get_traced_memory()[1] < 1 << 24
    finally:
        tracemalloc.stop()


def test_a_record_ends_in_its_chunk(tmp_path: Path) -> None:
    """One that declares more is not read by what is left of it."""
    file = tmp_path / "a.bag"
    cut = record({"op": b"\x04"}, bytes(100))[:-50]
    file.write_bytes(recording.MAGIC + chunk(cut))
    with pytest.raises(LogError, match="reaches beyond its chunk"):
        ReaderRosbag1().read(file)


def test_a_packet_with_a_wrong_checksum_is_none() -> None:
    """Its numbers are not those that were sent."""
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    stamp = struct.pack(">Q", 1_700_000_000_000_000)
    packet = bytearray(dialect.MAVLink_heartbeat_message(2, 3, 81, 0, 4, 3).pack(mav))
    sound = tlog.parse(stamp + bytes(packet), where="a.tlog")
    assert [name for _, _, name in sound] == ["HEARTBEAT"]
    packet[-3] ^= 1
    assert not tlog.parse(stamp + bytes(packet), where="a.tlog")
