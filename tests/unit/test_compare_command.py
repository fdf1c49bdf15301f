"""The comparison as a user calls it: files written, page self-contained, a run as a log."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.compare.application import print_variants
from seals.logs import Log
from seals.logs.native import write_native


def last_folder(runs: Path) -> Path:
    """The newest run folder."""
    return max(runs.glob("*/*"), key=lambda p: p.stat().st_mtime)


@pytest.fixture
def fall(tmp_path: Path) -> Path:
    """A free fall with noise as a native log."""
    t = np.arange(0.0, 1.0, 0.02)
    z = 5.0 - 0.5 * 9.81 * t**2 + np.random.default_rng(0).normal(0.0, 0.003, t.size)
    folder = tmp_path / "fall"
    write_native(Log(name="fall", columns={"t": t, "position_z": z}), folder)
    return folder


def test_a_comparison_writes_page_data_and_pictures(
    fall: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """report.html loads nothing from elsewhere; comparison.json and a picture lie beside it."""
    monkeypatch.chdir(tmp_path)
    assert main(["compare", f"log={fall}", "robot=ball"]) == 0
    folder = last_folder(tmp_path / "runs")
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert not re.findall(r"<(?:script|link|img)[^>]+(?:src|href)\s*=\s*[\"']http", page)
    data = json.loads((folder / "comparison.json").read_text(encoding="utf-8"))
    assert data["groups"][0]["ladder"][0]["train"]["position"]["rms"] < 0.02
    assert (folder / "plots" / "fall.png").stat().st_size > 5000
    assert "report.html" in capsys.readouterr().out.splitlines()[-1]


@pytest.mark.thorough
def test_a_run_can_be_compared_like_a_measurement(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The log of a simulated fall in air, compared with the same model, stays within its noise."""
    monkeypatch.chdir(tmp_path)
    robot = ["robot=ball", "initial.position=[0,0,20]"]
    assert main(["run", *robot, "time.duration=0.3"]) == 0
    run = last_folder(tmp_path / "runs")
    assert main(["compare", f"log={run}", *robot, "name=self"]) == 0
    data = json.loads(
        (last_folder(tmp_path / "runs") / "comparison.json").read_text(encoding="utf-8")
    )
    scores = data["groups"][0]["ladder"][0]["train"]
    assert scores["specific_force"]["ratio"] < 1.5
    assert scores["position"]["rms"] < 1e-3


def test_a_missing_log_is_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A log that does not exist: exit code 2, no traceback, no folder left."""
    monkeypatch.chdir(tmp_path)
    assert main(["compare", "log=nowhere", "robot=ball"]) == 2
    assert "nowhere" in capsys.readouterr().err
    assert not list(tmp_path.glob("runs/*/*"))


def test_a_pure_number_is_told_without_a_unit(capsys: pytest.CaptureFixture[str]) -> None:
    """Its unit is 1, which would read as a part of the number."""
    values = [
        SimpleNamespace(key="drag.share", value=0.5, sigma=0.25, unit="1", at_bound=False),
        SimpleNamespace(key="drag.length", value=2.0, sigma=0.5, unit="m", at_bound=True),
    ]
    group = SimpleNamespace(
        name="all", variants=[SimpleNamespace(name="", scores=[], fitted=values)]
    )
    comparison: Any = SimpleNamespace(groups=[group])
    print_variants(comparison)
    told = capsys.readouterr().out.splitlines()
    assert told[-2] == "  drag.share = 0.5 +- 0.25"
    assert told[-1] == "  drag.length = 2 +- 0.5 m  (at its bound)"
