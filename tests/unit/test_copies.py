"""Commands side by side: each has a checkout and a package of its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks import copies

ROOT = Path(__file__).parents[2]
_WHERE = "import seals, tempfile; print(seals.__file__); print(tempfile.gettempdir())"


def _where(item: int, place: Any) -> tuple[Path, list[Path]]:
    line = [sys.executable, "-c", _WHERE]
    said = subprocess.run(
        line, cwd=place.own, env=place.environment(), capture_output=True, text=True, check=True
    )
    (place.root / "tests" / "unit" / "left_behind.py").write_text("")
    return place.root, [Path(found) for found in said.stdout.split()]


def test_every_job_has_its_own_package_and_checkout() -> None:
    """A child finds the copied package and its own temporary folder; nothing is left of either."""
    found = dict(copies.side_by_side(_where, [1, 2], 2))
    roots = {root for root, _ in found.values()}
    assert len(roots) == 2
    assert not any(root.exists() for root in roots)
    assert not (ROOT / "tests" / "unit" / "left_behind.py").exists()
    for root, (package, temporary) in found.values():
        assert package == root.parent / "site" / "seals" / "__init__.py"
        assert temporary == root.parent / "tmp"


def test_one_job_runs_where_it_stands() -> None:
    """Nothing is copied for one job, and what comes after its time is told as None."""
    assert list(copies.side_by_side(lambda item, place: place.root, ["a"], 1)) == [("a", ROOT)]
    assert list(copies.side_by_side(lambda item, place: item, ["a"], 1, -1.0)) == [("a", None)]
