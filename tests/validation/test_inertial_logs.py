"""Logs of an inertial sensor alone, from a start that is stated."""

from __future__ import annotations

import csv
import gzip
import io
import shutil
from pathlib import Path

import pytest
import yaml

from seals.cli.main import main

STRANGERS = Path(__file__).parents[2].parent / "shared" / "strangers"
pytestmark = pytest.mark.skipif(
    not STRANGERS.is_dir(), reason="flights of another simulator are not beside the checkout"
)
START = {
    "position": [-0.25193565, 0.35246136, -0.72664141],
    "orientation": [-0.986359, 0.157128, 0.048554, -0.006988],
    "velocity": [0.441724096, -0.9915214947, 0.1628254649],
    "angular_velocity": [0.113968, 0.058166, 0.632923],
    "sigma": {"angular_velocity": 0.01, "orientation": 0.004, "position": 0.003, "velocity": 0.02},
}
"""Of the flight with a wind and a weak rotor, as its pose says."""


@pytest.mark.thorough
def test_a_model_that_rolls_away_from_its_start_says_what_would_hold_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Four seconds in a wind that the model lacks, from an exact start, run out of digits."""
    text = gzip.decompress((STRANGERS / "cases/13_wind_weak/log.csv.gz").read_bytes()).decode()
    rows = list(csv.DictReader(io.StringIO(text)))
    kept = [name for name in rows[0] if not name.startswith("mocap")]
    with (tmp_path / "log.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, kept, extrasaction="ignore")
        table.writeheader()
        table.writerows(rows)
    chart = yaml.safe_load((STRANGERS / "map.yaml").read_text())
    chart["columns"] = {k: v for k, v in chart["columns"].items() if k in kept}
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(chart))
    (tmp_path / "start.yaml").write_text(yaml.safe_dump({"initial_state": [START]}))
    shutil.copytree(STRANGERS / "robots" / "hb_plain", tmp_path / "robot")
    flight, robot = f"log={tmp_path / 'flight'}", f"robot={tmp_path / 'robot'}"
    words = [f"map={tmp_path / 'map.yaml'}", robot, "rate=100", "span=[0,4]"]
    meta = [f"meta={tmp_path / 'start.yaml'}", f"out={tmp_path / 'flight'}"]
    assert main(["convert", f"log={tmp_path / 'log.csv'}", *words, *meta]) == 0
    assert main(["new", "datasheet", flight, robot]) == 0
    capsys.readouterr()
    out = f"out={tmp_path / 'answer'}"
    assert main(["diagnose", flight, robot, out, "report=false", "plan=false"]) != 0
    said = capsys.readouterr().out
    assert "measure pose or velocity" in said or "Give a measured pose or velocity" in said
