"""A file that crashes or hangs a library is tried in a process of its own, and refused in words."""

from __future__ import annotations

import base64
import os
import time
from pathlib import Path

import pytest

from seals import reading_trial
from seals.errors import LogError
from seals.plugins.readers.pendulum import ReaderPendulum
from seals.reading_trial import try_reading

_CRASHES = (
    b"DwAAAJUBAAB4nKVRWShEURi+MzGGNEkebE2TZEmSh0mT9OVBkmRtkjQkNBRNmmQZ+y7b2JeRJEKS5EGSJEke"
    b"lC1JkjxIUr8HyZKce5ziwZu//v577v2/5XxXI0lSvVKSVGyqWSuk73L+dVaK6cI6o6ikIKcoX9KwZ53iB6f6"
    b"A6f9xeen/cXnypqkn/pYeDpOykvB98zFW23xpnXALM4WVHstx99UWcX7ClTeB0Wqlw=="
)
"""Packed variable of a MATLAB file, damaged so that SciPy's reader leaves its memory."""


def _crash(path: Path) -> None:
    """Stand in for a library that crashes."""
    os.abort()


def _hang(path: Path) -> None:
    """Stand in for a library that loops without end."""
    while True:
        time.monotonic()


def _write(path: Path) -> None:
    """Stand in for a library that writes beside what it reads."""
    path.with_name("written").write_text("x")


def _refuse(path: Path) -> None:
    raise LogError("not a file of ours")


@pytest.fixture
def near(monkeypatch: pytest.MonkeyPatch) -> str:
    """Module of the readers above, where a child process finds it."""
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))
    return Path(__file__).stem


def test_a_crash_is_refused(near: str, tmp_path: Path) -> None:
    """The process of the user goes on."""
    (tmp_path / "a").write_bytes(b"x")
    with pytest.raises(LogError, match="crashes"):
        try_reading(f"{near}:_crash", tmp_path / "a")


@pytest.mark.skipif(os.name != "posix", reason="limits of a process are POSIX's")
def test_an_endless_loop_is_refused(
    near: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Time of the processor is counted."""
    monkeypatch.setattr(reading_trial, "SECONDS", 1)
    monkeypatch.setattr(reading_trial, "PATIENCE", 60.0)
    (tmp_path / "a").write_bytes(b"x")
    with pytest.raises(LogError, match="longer than 1 s of computing"):
        try_reading(f"{near}:_hang", tmp_path / "a")


def test_the_clock_ends_it_as_well(
    near: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that sleeps uses no time of the processor."""
    monkeypatch.setattr(reading_trial, "PATIENCE", 0.01)
    (tmp_path / "a").write_bytes(b"x")
    with pytest.raises(LogError, match=r"longer than 0\.05 s"):
        try_reading(f"{near}:_hang", tmp_path / "a")


@pytest.mark.skipif(os.name != "posix", reason="limits of a process are POSIX's")
def test_nothing_is_written(near: str, tmp_path: Path) -> None:
    """Reading leaves the folder as it is."""
    (tmp_path / "a").write_bytes(b"x")
    try_reading(f"{near}:_write", tmp_path / "a")
    written = tmp_path / "written"
    assert not written.exists() or not written.read_bytes()


def test_what_the_reader_itself_refuses_is_left_to_it(near: str, tmp_path: Path) -> None:
    """Its words are better than those of the trial."""
    (tmp_path / "a").write_bytes(b"x")
    try_reading(f"{near}:_refuse", tmp_path / "a")


def test_a_damaged_matlab_file_that_crashes_its_library(tmp_path: Path) -> None:
    """The whole reader: without the trial the process of the user ends with a bus error."""
    file = tmp_path / "pendulum.mat"
    start = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    file.write_bytes(start + base64.b64decode(_CRASHES))
    with pytest.raises(LogError, match=r"cannot be read|not a valid MATLAB"):
        ReaderPendulum(path=str(file)).read()
