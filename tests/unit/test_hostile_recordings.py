"""Recordings of Foxglove and Rerun by strangers: messages of JSON that are not what they seem."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs.reader import reader_of
from seals.plugins.readers.recording import ReaderMcap

pytest.importorskip("mcap")


def recorded(path: Path, data: Callable[[int], bytes], encoding: str = "json") -> Path:
    """A recording of twenty messages of one topic."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer: Any = Writer(file)
        writer.start(profile="", library="strange")
        form = writer.register_schema("foxglove.PoseInFrame", "jsonschema", b"{}")
        topic = writer.register_channel("/pose", encoding, form)
        for k in range(20):
            writer.add_message(topic, k * 10_000_000, data(k), k * 10_000_000)
        writer.finish()
    return path


def pose(value: str) -> Callable[[int], bytes]:
    """Messages that say a place in these signs."""
    return lambda k: b'{"pose": {"position": {"x": %s}}}' % value.encode()


MESSAGES: dict[str, tuple[Callable[[int], bytes], str]] = {
    "lists without end": (lambda k: b"[" * 2000 + b"]" * 2000, "nested deeper"),
    "mappings without end": (lambda k: b'{"pose":' * 900 + b"1" + b"}" * 900, "nested deeper"),
    "a long number": (pose("9" * 1000), "1,000 digits"),
    "a text": (pose('"far"'), "holds a str, a number is needed"),
    "a list": (pose("[1, 2]"), "holds a list, a number is needed"),
    "nothing": (pose("null"), "a number is needed|no sample"),
    "no number": (pose("NaN"), "no sample"),
    "an endless number": (pose("1e999"), "no sample"),
    "no JSON": (lambda k: b"hello", "not JSON"),
    "no text": (lambda k: b"\xff\xfe{", "not JSON"),
    "another field": (lambda k: b'{"position": {"x": 1.0}}', "there is no"),
    "no mapping": (lambda k: b"5", "there is no|not a mapping|holds"),
    "the sign zero": (lambda k: b'{"po\\u0000se": 1}', "null character|there is no"),
}


@pytest.mark.parametrize("name", MESSAGES)
def test_an_odd_message_ends_in_words(name: str, tmp_path: Path) -> None:
    """Whatever JSON a topic holds, and whatever it says that it were."""
    data, words = MESSAGES[name]
    reader = ReaderMcap(columns={"/pose/pose.position.x": "position_x"})
    with pytest.raises(LogError, match=words):
        reader.read(recorded(tmp_path / "a.mcap", data))


def test_a_sound_recording_is_read(tmp_path: Path) -> None:
    """Messages of Foxglove are read by their names."""
    path = recorded(tmp_path / "a.mcap", lambda k: json.dumps({"x": 0.5 * k}).encode())
    (log,) = ReaderMcap(columns={"/pose/x": "position_x"}).read(path)
    np.testing.assert_allclose(log.columns["position_x"], 0.5 * np.arange(20))


def test_messages_of_protobuf_are_not_decoded(tmp_path: Path) -> None:
    """No code is made from definitions inside a recording."""
    path = recorded(tmp_path / "a.mcap", lambda k: b"\x08\x01", encoding="protobuf")
    with pytest.raises(LogError, match=r"\(protobuf\) cannot be decoded"):
        ReaderMcap(columns={"/pose/x": "position_x"}).read(path)


@pytest.mark.parametrize("start", [b"RRF2", b"RRF0", b"RRF1\xff\xff"])
def test_a_recording_of_rerun_is_told(start: bytes, tmp_path: Path) -> None:
    """No reader takes it: the message says what it is, not that a reader be named."""
    (tmp_path / "a.rrd").write_bytes(start + bytes(100))
    with pytest.raises(LogError, match="a recording of Rerun, which no reader accepts"):
        reader_of(tmp_path / "a.rrd")
