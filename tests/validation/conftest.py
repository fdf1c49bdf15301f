"""The measurements, in the folder of SEALS_DATA or beside the checkout, and a log for plans."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from seals.logs.log import Log
from seals.logs.native import read_native
from seals.sysid.diagnosis import Diagnosis, diagnose

ROOT = Path(__file__).resolve().parents[2]
BESIDE = ROOT.parent / "shared" / "data"


@pytest.fixture
def measurements(monkeypatch: pytest.MonkeyPatch) -> None:
    """Point the readers at the measurements, or skip in words."""
    root = Path(os.environ.get("SEALS_DATA") or BESIDE)
    if not root.is_dir():
        pytest.skip(f"no measurements: set SEALS_DATA, there is no folder {root}")
    monkeypatch.setenv("SEALS_DATA", str(root))


@pytest.fixture(scope="session")
def hovering(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A hover whose accelerometer reads too little: bias or scale, a hover cannot tell."""
    from tests.validation.hidden import generate

    folder = tmp_path_factory.mktemp("cases")
    words = ["--level", "confounded", "--vehicle", "quad", "--effect", "accelerometer_scale"]
    generate.main([str(folder), *words, "--count", "1", "--seed", "3", "--no-gain"])
    return next(p for p in sorted(folder.iterdir()) if p.is_dir())


@pytest.fixture(scope="session")
def windy_case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a quadrotor in wind that its model does not know, with its truth."""
    from tests.validation.hidden import generate

    folder = tmp_path_factory.mktemp("windy")
    words = ["--level", "clear", "--vehicle", "quad", "--effect", "wind"]
    generate.main([str(folder), *words, "--count", "1", "--seed", "11", "--no-gain"])
    return next(p for p in sorted(folder.iterdir()) if p.is_dir())


@pytest.fixture(scope="session")
def windy(windy_case: Path) -> tuple[Diagnosis, Log]:
    """Its diagnosis and its log; several files look at them."""
    log = read_native(windy_case)
    return diagnose(log), log
