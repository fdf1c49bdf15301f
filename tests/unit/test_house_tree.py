"""What lies at the top of the tracked tree."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = {
    *("seals", "plugins", "conf", "robots", "animals", "experiments", "tests"),
    *("benchmarks", "constraints", "docs", ".ci", ".github"),
}


def test_the_top_of_the_tree_holds_no_strange_folder() -> None:
    """A folder that a command wrote here, such as a new robot, is not part of the project."""
    words = ["git", "ls-files"]
    asked = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    if asked.returncode != 0 or not asked.stdout:
        pytest.skip("no clone: nothing is tracked here")
    tops = {p.partition("/")[0] for p in asked.stdout.splitlines() if "/" in p}
    assert tops <= FOLDERS
