"""The progress display of a sweep: it ends with the sweep, whatever becomes of its folder."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from seals.errors import ConfigError
from seals.sweep import watch
from seals.sweep.book import TABLE
from seals.sweep.watch import Sweep, watched

HEAD = "number,state,code,seconds,words,message\n"


@pytest.fixture
def sweep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Sweep:
    """A sweep that looks often."""
    monkeypatch.setattr(watch, "LOOK", 0.01)
    return Sweep("run", ["-m", "seed=1,2"], resumed=False)


def _until(done: Callable[[], bool]) -> None:
    end = time.monotonic() + 20.0
    while not done() and time.monotonic() < end:
        time.sleep(0.01)
    assert done()


def test_a_damaged_book_ends_the_display_in_words(
    sweep: Sweep, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The thread says nothing, and no traceback; the end of the sweep names the line."""
    raised: list[Any] = []
    monkeypatch.setattr(threading, "excepthook", raised.append)
    sweep.begin(tmp_path, 2)
    thread = sweep._thread
    assert thread is not None
    (tmp_path / TABLE).write_text(f"{HEAD}what,done,0,1.0,seed=1,\n")
    _until(lambda: not thread.is_alive())
    assert raised == []
    with pytest.raises(ConfigError, match="line 2, is damaged"):
        sweep.stop()


def test_the_display_ends_though_its_locks_do_not(
    sweep: Sweep, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A lock that cannot be given back, on a disk that is gone say, leaves no thread behind."""

    def broken() -> None:
        raise OSError("the disk is gone")

    monkeypatch.setattr(sweep.claim, "close", broken)
    with pytest.raises(OSError, match="disk is gone"), watched(sweep):
        sweep.begin(tmp_path, 2)
    assert sweep._thread is not None
    assert not sweep._thread.is_alive()
