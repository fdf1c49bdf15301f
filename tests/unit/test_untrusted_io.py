"""The one reader of files that nobody vouches for: kinds of file, sizes, depth, numbers, merges."""

from __future__ import annotations

import os
import socket
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from seals import untrusted_io
from seals.errors import LogError
from seals.untrusted_io import plain_json, plain_yaml, read_bytes, read_json, read_text

PATIENCE = 2.0
"""Most processor time that a refusal may take [s]."""


def _linked(place: Path, target: str) -> None:
    place.symlink_to(target)


def _listening(place: Path) -> None:
    with socket.socket(socket.AF_UNIX) as door:
        door.bind(str(place))


def _sparse(place: Path) -> None:
    with place.open("wb") as stream:
        stream.truncate(1 << 40)


STRANGE: dict[str, tuple[Callable[[Path], None], str]] = {
    "pipe": (os.mkfifo, "not a regular file"),
    "socket": (_listening, "not a regular file"),
    "folder": (Path.mkdir, "is a folder"),
    "nothing": (lambda _: None, "does not exist"),
    "endless zeros": (lambda p: _linked(p, "/dev/zero"), "not a regular file"),
    "endless noise": (lambda p: _linked(p, "/dev/urandom"), "not a regular file"),
    "null": (lambda p: _linked(p, "/dev/null"), "not a regular file"),
    "terminal": (lambda p: _linked(p, "/dev/tty"), "not a regular file"),
    "memory of the process": (lambda p: _linked(p, "/proc/self/mem"), "is empty"),
    "link to itself": (lambda p: _linked(p, p.name), "cannot be opened"),
    "link to nothing": (lambda p: _linked(p, "absent"), "does not exist"),
    "terabyte of holes": (_sparse, "the limit is"),
    "empty": (Path.touch, "is empty"),
    "not UTF-8": (lambda p: p.write_bytes(b'"\xff"') and None, "UTF-8|utf-8"),
}


@pytest.mark.parametrize("name", STRANGE)
def test_a_strange_file_is_refused_at_once(tmp_path: Path, name: str) -> None:
    """Neither a pipe nor a device is waited for, and no file without end is read."""
    build, words = STRANGE[name]
    build(tmp_path / "a.json")
    start = time.process_time()
    for read in (read_json, read_text):
        with pytest.raises(LogError, match=words):
            read(tmp_path / "a.json")
    assert time.process_time() - start < PATIENCE


def test_a_file_that_becomes_a_pipe_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file that was opened is looked at, not the one that lay there before."""
    file = tmp_path / "a.json"
    os.mkfifo(file)
    monkeypatch.setattr(untrusted_io, "regular_file", lambda path, **_: Path(path))
    with pytest.raises(LogError, match="not a regular file"):
        read_bytes(file)


def test_a_text_with_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    """Such marks are common, and no part of the text."""
    (tmp_path / "a.txt").write_bytes(b"\xef\xbb\xbf{}")
    assert read_text(tmp_path / "a.txt") == "{}"
    assert read_json(tmp_path / "a.txt") == {}


JSON: dict[str, tuple[bytes | Callable[[], bytes], str]] = {
    "brackets": (b"[" * 100_000, "deeper"),
    "closed brackets": (b"[" * 100_000 + b"]" * 100_000, "deeper"),
    "names in names": (b'{"a":' * 100_000 + b"1" + b"}" * 100_000, "deeper"),
    "lists of names": (b'[{"a":' * 30 + b"1" + b"}]" * 30, "deeper"),
    "after a quote in a text": (b'["\\"", ' + b"[" * 60 + b"]" * 61, "deeper"),
    "after a backslash in a text": (b'["\\\\", ' + b"[" * 60 + b"]" * 61, "deeper"),
    "millions of lists": (lambda: b"[" + b"[]," * 3_000_000 + b"1]", "entries"),
    "millions of texts": (lambda: b"[" + b'"",' * 4_100_000 + b"1]", "entries"),
    "long number": (b"[" + b"9" * 1_000 + b"]", "digits"),
    "very long number": (lambda: b"-" + b"9" * 5_000_000, "digits"),
    "half a pair": (b'{"a": "\\ud800"}', "surrogates"),
    "half a pair as name": (b'{"\\udc00": 1}', "surrogates"),
    "zero": (b'{"a": ["b\\u0000"]}', "null character"),
    "zero as name": (b'{"\\u0000": 1}', "null character"),
    "text without end": (b'["' + b'\\"' * 1_000_000, "Unterminated"),
    "another coding": ('{"a": 1}'.encode("utf-16"), "utf-8"),
    "two of them": (b"{} {}", "Extra data"),
    "zero bytes": (bytes(10), "Expecting value"),
}


@pytest.mark.parametrize("name", JSON)
def test_hostile_json_is_refused_quickly(tmp_path: Path, name: str) -> None:
    """Each is refused before it fills the memory or the stack, with the path in the words."""
    raw, words = JSON[name]
    file = tmp_path / "run.json"
    # the long ones are made here: as constants they would stay in the memory of every test
    file.write_bytes(raw() if callable(raw) else raw)
    start = time.process_time()
    with pytest.raises(LogError, match=words) as refusal:
        read_json(file)
    assert time.process_time() - start < PATIENCE
    assert str(file) in str(refusal.value)
    assert len(str(refusal.value)) < 600


def test_brackets_inside_of_texts_do_not_count() -> None:
    """Ordinary JSON passes: brackets, quotes and backslashes in texts, numbers, pairs."""
    content = {
        "a": "[" * 99,
        "b": ['\\"[' * 50, "\\"],
        "c": [1e300, -1, 10**300],
        "d": "\U0001f9ad",
    }
    import json

    assert plain_json(json.dumps(content)) == content
    assert plain_json(json.dumps(content, ensure_ascii=False).encode()) == content


def _doubled() -> str:
    lines = ["a0: &a0 {k: 1}"]
    return "\n".join(
        [*lines, *(f"a{k}: &a{k} {{<<: [*a{k - 1}, *a{k - 1}]}}" for k in range(1, 60))]
    )


_WIDE = "a: &a {" + ",".join(f"k{k}: 1" for k in range(5000)) + "}\n"
MODULUS = 2**61 - 1
"""Its multiples have one hash in Python, so that a mapping with such keys takes quadratic time."""
YAML: dict[str, tuple[str, str]] = {
    "zero": ('a: ["b\\0c"]', "null character"),
    "zero as name": ('"b\\x00": 1', "null character"),
    "number to the base 60": ("a: 1" + ":59" * 300_000, "number of"),
    "tagged number": ("a: !!int '" + "1:" * 100_000 + "1'", "number of"),
    "number with points": ("a: " + "1:" * 100_000 + "1.0", "number of"),
    "hexadecimal": ("a: 0x" + "f" * 100_000, "number of"),
    "octal": ("a: 0o" + "7" * 1_000, "number of"),
    "binary": ("a: 0b" + "1" * 10_000, "number of"),
    "decimal": ("a: " + "1_" * 1_000 + "1", "number of"),
    "a few merges": (_WIDE + "".join(f"b{k}: {{<<: *a}}\n" for k in range(50)), "merged"),
    "merges that double": (_doubled(), "merged"),
    "one merge, often": (_WIDE + "b: {<<: [" + "*a," * 50_000 + "*a]}", "merged"),
    "many merges": (_WIDE + "".join(f"b{k}: {{<<: *a}}\n" for k in range(5000)), "merged"),
    "lists in lists": ("a: " + "[" * 60 + "]" * 60, "nested deeper"),
    "names of names": ("? " * 60 + "a", "nested deeper"),
    "lists in lines": ("- " * 60 + "a", "nested deeper"),
    "itself": ("&a [*a]", "nested deeper"),
    "keys of one hash": ("\n".join(f"{k * MODULUS}: 0" for k in range(30_000)), "whole numbers"),
    "a set of one hash": (
        "a: !!set {" + ",".join(f"? {k * MODULUS}" for k in range(30_000)) + "}",
        "whole numbers",
    ),
    "tagged keys of one hash": (
        "\n".join(f"!!int '{k * MODULUS}': 0" for k in range(1, 20_000)),
        "whole numbers",
    ),
}


@pytest.mark.parametrize("name", YAML)
def test_hostile_yaml_is_refused_quickly(name: str) -> None:
    """Each is refused before the loader computes, copies or recurses."""
    text, words = YAML[name]
    start = time.process_time()
    with pytest.raises(yaml.YAMLError, match=words):
        plain_yaml(text)
    assert time.process_time() - start < PATIENCE


def test_ordinary_merges_and_texts_are_read() -> None:
    """Merge keys count when they are few; a long text is not a number."""
    assert plain_yaml("a: &a {x: 1}\nb: {<<: *a, y: 2}") == {"a": {"x": 1}, "b": {"x": 1, "y": 2}}
    assert plain_yaml("a: " + "word " * 200)["a"] == ("word " * 200).strip()
    assert plain_yaml("a: '" + "1" * 500 + "'")["a"] == "1" * 500
    states = [2**127 + k for k in range(900)]
    assert plain_yaml(f"a: {states}\nb: {[0.1 / (k + 3) for k in range(3000)]}")["a"] == states


def test_a_small_file_takes_little_memory(tmp_path: Path) -> None:
    """The bound on a file is not what reading one of three bytes takes."""
    (tmp_path / "a.json").write_text("[1]")
    tracemalloc.start()
    try:
        assert read_json(tmp_path / "a.json") == [1]
        assert read_bytes(tmp_path / "a.json") == b"[1]"
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 1e6


def test_a_file_that_grows_is_read_to_its_bound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is added between two looks belongs to the file, but no more than is allowed."""
    place, look = tmp_path / "a", os.fstat
    place.write_bytes(b"a" * 10)

    def grown(file: int) -> os.stat_result:
        found = look(file)
        with place.open("ab") as stream:
            stream.write(b"b" * 20)
        return found

    monkeypatch.setattr(untrusted_io.os, "fstat", grown)
    assert read_bytes(place, most=40) == b"a" * 10 + b"b" * 20
    with pytest.raises(LogError, match="grows while it is read"):
        read_bytes(place, most=40)
