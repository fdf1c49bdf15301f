"""A file that crashes or hangs a library is read in a child process, and refused in words."""

from __future__ import annotations

import base64
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io

from seals import isolated_reading
from seals.errors import LogError
from seals.isolated_reading import read_isolated
from seals.plugins.readers.pendulum import ReaderPendulum

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


def _swell(path: Path) -> None:
    """Stand in for a library that unpacks a few bytes to gigabytes."""
    np.zeros(3 << 30, dtype=np.uint8)


def _refuse(path: Path) -> None:
    raise LogError("not a file of ours")


def _divide(path: Path) -> float:
    """Stand in for a library that raises an error of its own."""
    return 1 / 0


def _content(path: Path) -> dict[str, Any]:
    """Stand in for a library that reads."""
    return {"name": path.name, "parts": [np.frombuffer(path.read_bytes(), np.uint8)]}


def _quit(path: Path) -> None:
    """Stand in for a library that ends the process."""
    os._exit(0)


def _cells(rows: float) -> Any:
    """One segment of three samples, as a list of MATLAB."""
    out = np.empty(1, object)
    out[0] = np.arange(3 * rows).reshape(int(rows), 3)
    return out


@pytest.fixture
def near(monkeypatch: pytest.MonkeyPatch) -> str:
    """Module of the readers above, where a child process finds it."""
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))
    return Path(__file__).stem


@pytest.mark.parametrize(
    ("reader", "words"),
    [
        ("_crash", "crashes"),
        # a library that ends the process with code 0
        ("_quit", "returned nothing"),
        # packed zeros take a thousandth of the memory that they unpack to
        pytest.param(
            "_swell",
            "more memory",
            marks=pytest.mark.skipif(os.name != "posix", reason="limits of a process are POSIX's"),
        ),
    ],
)
def test_a_reader_that_fails_is_refused(reader: str, words: str, near: str, tmp_path: Path) -> None:
    """The process of the user goes on."""
    (tmp_path / "a").write_bytes(b"x")
    with pytest.raises(LogError, match=words):
        read_isolated(f"{near}:{reader}", tmp_path / "a")


@pytest.mark.skipif(os.name != "posix", reason="limits of a process are POSIX's")
def test_an_endless_loop_is_refused(
    near: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Time of the processor is counted."""
    monkeypatch.setattr(isolated_reading, "SECONDS", 1)
    monkeypatch.setattr(isolated_reading, "PATIENCE", 60.0)
    (tmp_path / "a").write_bytes(b"x")
    with pytest.raises(LogError, match="longer than 1 s of processor time"):
        read_isolated(f"{near}:_hang", tmp_path / "a")


def test_the_clock_ends_it_as_well(
    near: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that sleeps uses no time of the processor."""
    monkeypatch.setattr(isolated_reading, "PATIENCE", 0.01)
    (tmp_path / "a").write_bytes(b"x")
    with pytest.raises(LogError, match=r"longer than 0\.05 s"):
        read_isolated(f"{near}:_hang", tmp_path / "a")


@pytest.mark.skipif(os.name != "posix", reason="limits of a process are POSIX's")
def test_nothing_is_written(near: str, tmp_path: Path) -> None:
    """Reading leaves the folder as it is."""
    (tmp_path / "a").write_bytes(b"x")
    with pytest.raises(LogError, match="its library says OSError"):
        read_isolated(f"{near}:_write", tmp_path / "a")
    written = tmp_path / "written"
    assert not written.exists() or not written.read_bytes()


@pytest.mark.skipif(os.name != "posix", reason="limits of a process are POSIX's")
def test_nothing_is_written_within_a_users_own_limit(tmp_path: Path) -> None:
    """A limit that is already lower than the content may be keeps the library from writing, too."""
    (tmp_path / "a").write_bytes(b"x")
    program = (
        "import resource\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20))\n"
        "from seals.isolated_reading import read_isolated\n"
        f"read_isolated('{Path(__file__).stem}:_write', r'{tmp_path / 'a'}')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parent)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "its library says OSError" in done.stderr
    written = tmp_path / "written"
    assert not written.exists() or not written.read_bytes()


def test_what_the_reader_itself_refuses_is_left_to_it(near: str, tmp_path: Path) -> None:
    """Its words are better than those of the child; a library's error is a refusal, too."""
    (tmp_path / "a").write_bytes(b"x")
    with pytest.raises(LogError, match=r"^not a file of ours$"):
        read_isolated(f"{near}:_refuse", tmp_path / "a")
    with pytest.raises(LogError, match="its library says ZeroDivisionError"):
        read_isolated(f"{near}:_divide", tmp_path / "a")


def test_content_is_handed_over(near: str, tmp_path: Path) -> None:
    """Arrays, numbers and text are those that the reader returned."""
    (tmp_path / "a").write_bytes(b"\x03\x01")
    found = read_isolated(f"{near}:_content", tmp_path / "a")
    assert found["name"] == "a"
    np.testing.assert_array_equal(found["parts"][0], [3, 1])


def test_the_process_of_the_user_never_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A crash depends on the memory: what ended well in a child could crash here."""
    file = tmp_path / "pendulum.mat"
    scipy.io.savemat(file, {key: _cells(2.0) for key in ("Y_id", "Y_vad")}
                     | {key: _cells(1.0) for key in ("Time_id", "Time_vad")})  # fmt: skip
    monkeypatch.setattr(scipy.io, "loadmat", None)
    logs = ReaderPendulum(path=str(file)).read()
    assert [log.name for log in logs] == ["identification", "validation"]


def test_a_damaged_matlab_file_that_crashes_its_library(tmp_path: Path) -> None:
    """The whole reader: without the trial the process of the user ends with a bus error."""
    file = tmp_path / "pendulum.mat"
    start = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    file.write_bytes(start + base64.b64decode(_CRASHES))
    with pytest.raises(LogError, match=r"cannot be read|not a valid MATLAB"):
        ReaderPendulum(path=str(file)).read()
