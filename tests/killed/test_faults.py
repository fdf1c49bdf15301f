"""Whichever write, flush, rename or close fails or kills, no folder is mixed."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

from benchmarks.fault_cases import CASES
from benchmarks.faults import reports, told

needs_shim = pytest.mark.skipif(
    not sys.platform.startswith("linux") or shutil.which("cc") is None,
    reason="the shim needs Linux and a C compiler",
)


@pytest.mark.thorough
@needs_shim
def test_some_points_of_a_conversion(tmp_path: Path) -> None:
    """A few calls of the shortest command, each killed once."""
    lines = list(reports(["convert"], "--most", "8", "--modes", "kill", "--out", str(tmp_path)))
    assert lines[-1] == "exit code 0\n", lines
    assert (count := int(lines[0].split()[1])) >= 5
    with (tmp_path / "convert.jsonl").open("a") as file:
        file.write('{"mode": "kill", "n":')  # cut off in the middle of a line
    assert list(told(tmp_path))[-1] == f"all: {count} of {count} points tried, 0 bad"


@needs_shim
@pytest.mark.killed
@pytest.mark.parametrize("name", CASES)
def test_every_point_of_a_command(name: str) -> None:
    """Every call of every command, killed, failed, and on a disk that is full from there on."""
    lines = list(reports([name]))
    assert lines[-1] == "exit code 0\n", lines


@needs_shim
@pytest.mark.killed
@pytest.mark.parametrize("name", CASES)
def test_forked_processes_end_like_fresh_ones(name: str) -> None:
    """A process that was forked, its imports done, comes to the same as one that starts afresh."""
    lines = list(reports([name], "--fresh", "--most", "3", "--modes", "kill,error,full"))
    assert lines[-1] == "exit code 0\n", lines
