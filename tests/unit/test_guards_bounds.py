"""Bounds of what a stranger's file may ask for, each tried alone."""

from __future__ import annotations

import sqlite3
import struct
from pathlib import Path

import numpy as np
import pytest
import yaml

from seals.errors import ConfigError, LogError, RobotError
from seals.learn.policy import load_policy
from seals.logs import table
from seals.plugins.readers.recording import _opened
from seals.plugins.readers.ulog import ReaderUlog
from seals.scaffold.takeover import Takeover
from seals.untrusted_io import plain_yaml, read_bytes, regular_file


@pytest.mark.parametrize("more", ["", 'xmlns:xacro="http://www.ros.org/wiki/xacro"'])
def test_entities_of_a_urdf_taken_over_are_refused(tmp_path: Path, more: str) -> None:
    """``seals new robot`` reads URDFs and macros by another way than ``seals run``."""
    file = tmp_path / "a.urdf"
    entity = '<!DOCTYPE robot [<!ENTITY a "b">]>'
    file.write_text(f'{entity}<robot name="r" {more}><link name="a"/></robot>')
    with pytest.raises(RobotError, match="DOCTYPE or an ENTITY"):
        Takeover(file, {})


def test_the_depth_of_yaml_is_measured_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """The loader recurses, and a compiled one crashes: deep nesting never gets to it."""

    def reached(*_: object, **__: object) -> None:
        pytest.fail("the loader was let at it")

    monkeypatch.setattr(yaml, "load", reached)
    with pytest.raises(yaml.YAMLError, match="nested deeper"):
        plain_yaml("[" * 50 + "]" * 50)


def test_the_size_of_a_file_is_bounded(tmp_path: Path) -> None:
    """A file without end is not read."""
    file = tmp_path / "a.csv"
    with file.open("wb") as stream:
        stream.truncate(1 << 40)
    with pytest.raises(LogError, match="the limit is"):
        regular_file(file)
    file.write_bytes(bytes(11))
    with pytest.raises(LogError, match="the limit is 10"):
        read_bytes(file, most=10)


def test_the_values_of_a_table_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A megabyte of one repeated value can stand for more of them than the memory holds."""
    import pyarrow as pa
    from pyarrow import parquet

    assert table.MOST_VALUES == 100_000_000
    monkeypatch.setattr(table, "MOST_VALUES", 99)
    parquet.write_table(pa.table({"t": np.arange(50), "x": np.zeros(50)}), tmp_path / "a.parquet")
    (tmp_path / "a.csv").write_text("t,x\n" + "1,2\n" * 50)
    for read, name in ((table.read_parquet, "a.parquet"), (table.read_csv_columns, "a.csv")):
        with pytest.raises(LogError, match="the limit is 99 values"):
            read(tmp_path / name)


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_packed_stream_ends_at_its_declared_size(compression: str) -> None:
    """What a stream holds beyond the size that it declares is never unpacked."""
    pytest.importorskip("mcap", reason="mcap is not installed")
    pytest.importorskip("lz4", reason="lz4 is not installed")
    import lz4.frame
    import zstandard

    from seals.plugins.readers import mcap_file

    zeros = bytes(1 << 22)
    packed = {"zstd": zstandard.compress, "lz4": lz4.frame.compress}[compression](zeros)
    unpack = {"zstd": mcap_file._zstd, "lz4": mcap_file.unpacked_lz4}[compression]
    assert len(unpack(packed, 100)) <= 101


def _record(kind: int, length: int, body: bytes = b"") -> bytes:
    return bytes([kind]) + struct.pack("<Q", length) + body


def test_a_chunk_that_declares_too_much_is_not_unpacked() -> None:
    """The declared size is judged before the packed bytes are looked at."""
    pytest.importorskip("mcap", reason="mcap is not installed")
    from seals.plugins.readers.mcap_file import unpacked

    with pytest.raises(ValueError, match="a chunk declares 134,217,728 bytes"):
        unpacked(b"", 1 << 27, "", {})


def test_a_record_that_declares_too_much_is_not_read(tmp_path: Path) -> None:
    """Room for a record is made only within the bound."""
    pytest.importorskip("mcap", reason="mcap is not installed")
    from seals.plugins.readers.recording import ReaderMcap

    file = tmp_path / "a.mcap"
    file.write_bytes(b"\x89MCAP0\r\n" + _record(1, 8, bytes(8)) + _record(0x7A, (1 << 26) + 1))
    with pytest.raises(LogError, match="limit"):
        ReaderMcap().read(file)


def test_a_database_is_opened_read_only(tmp_path: Path) -> None:
    """Neither its file nor one beside it is written."""
    file = tmp_path / "a.db3"
    with sqlite3.connect(file) as base:
        base.execute("CREATE TABLE topics(id)")
    base.close()
    opened = _opened(file)
    with pytest.raises(sqlite3.OperationalError, match="readonly"):
        opened.execute("INSERT INTO topics VALUES (1)")
    opened.close()
    assert [path.name for path in tmp_path.iterdir()] == ["a.db3"]


def test_the_fields_of_a_ulog_are_bounded(tmp_path: Path) -> None:
    """An array in a format counts with every one of its elements."""
    file = tmp_path / "a.ulg"

    def message(kind: str, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), ord(kind)) + body

    raw = b"ULog\x01\x12\x35\x01" + bytes(8)
    raw += message("F", b"a:uint64_t timestamp;uint8_t[5000] x") + message("A", b"\0\0\0a")
    file.write_bytes(raw + message("D", b"\0\0" + bytes(5008)))
    with pytest.raises(LogError, match="declares more than 4096 fields"):
        ReaderUlog().read(file)


@pytest.mark.parametrize("name", ["card.json", "policy.safetensors"])
def test_a_policy_holds_no_links(name: str, tmp_path: Path) -> None:
    """Card and weights are files of the folder, not of somewhere else."""
    torch = pytest.importorskip("torch", reason="the extra learn is not installed")
    pytest.importorskip("torchrl", reason="the extra learn is not installed")
    from seals.learn.networks import actor_of, description
    from seals.learn.policy import save_policy

    torch.manual_seed(1)
    network = description(observation=3, action=1, hidden=[4], layer_norm=False)
    tensors = actor_of(network).state_dict()
    folder = save_policy(
        tmp_path / "policy", network=network, tensors=tensors, metadata={"env": "a"}
    )
    load_policy(folder)
    (folder / name).rename(tmp_path / "elsewhere")
    (folder / name).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(ConfigError, match=r"is missing|there is no card"):
        load_policy(folder)
