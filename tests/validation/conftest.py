"""Finds the measurements: the folder that SEALS_DATA names, or one beside the checkout."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

BESIDE = Path(__file__).resolve().parents[3] / "shared" / "data"


@pytest.fixture
def measurements(monkeypatch: pytest.MonkeyPatch) -> None:
    """Point the readers at the measurements, or skip in words."""
    root = Path(os.environ.get("SEALS_DATA") or BESIDE)
    if not root.is_dir():
        pytest.skip(f"no measurements: set SEALS_DATA, there is no folder {root}")
    monkeypatch.setenv("SEALS_DATA", str(root))
