"""The measurements, in the folder of SEALS_DATA or beside the checkout, and a log for plans."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from seals.logs.log import Log
from seals.logs.native import read_native
from seals.logs.shipped import find_log
from seals.sysid.diagnosis import Diagnosis
from seals.sysid.report.estimator import MissingEffect

ROOT = Path(__file__).resolve().parents[2]
BESIDE = ROOT.parent / "shared" / "data"
WINDY = "hidden_effect/flight_a"
"""What is hidden in it: hidden_effect_truth.yaml."""


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
def fitted() -> MissingEffect:
    """An estimator that has seen a flight in a wind that its model lacks; several files look."""
    return MissingEffect().fit(WINDY)


@pytest.fixture(scope="session")
def windy(fitted: MissingEffect) -> tuple[Diagnosis, Log]:
    """Its diagnosis and its log."""
    return fitted.diagnosis_, read_native(find_log(WINDY))
