"""Flights of a published simulator that is not ours: what was hidden is named.

The way of a newcomer: convert, write the data sheet, diagnose. The flights lie beside the checkout.
"""

from __future__ import annotations

import csv
import gzip
import io
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.signal import savgol_filter

from seals.cli.main import main

FLIGHTS = Path(__file__).resolve().parents[3] / "shared" / "strangers"
QUICK = "T07_slipping_prop"
"""The flight of the default run; the others are slow."""
NAMED = {
    "04_drag": ("quadratic_drag", {"coefficient_x": 0.02, "coefficient_z": 0.04}),
    "08_rotor_lag": ("rotor_lag", {"time_constant_change": 0.03}),
    "10_cog": ("centre_of_gravity", {"offset_x": 0.006, "offset_y": -0.004}),
    "12_acc_bias": ("accelerometer_bias", {"bias_x": 0.25, "bias_y": -0.15}),
    QUICK: ("weak_rotor", {"relative_loss": 0.2}),
    "T10_motor_curve": ("motor_curve", {"offset": 100.0}),
}
"""Effect of each flight and its hidden numbers, from ``truth.yaml``."""


def diagnosed(case: Path, place: Path, changed: Callable[[str], str] = str) -> Any:
    """Return the diagnosis of a flight, whose table may be changed before."""
    truth = yaml.safe_load((case / "truth.yaml").read_text())
    robot = place / "robot"
    shutil.copytree(FLIGHTS / "robots" / truth["robot"], robot)
    table = gzip.decompress((case / "log.csv.gz").read_bytes()).decode()
    (place / "log.csv").write_text(changed(table), encoding="utf-8")
    maps = FLIGHTS / truth.get("map", "map.yaml")
    words = ["convert", f"log={place / 'log.csv'}", f"map={maps}", f"robot={robot}", "rate=100"]
    log = f"log={place / 'c'}"
    assert main([*words, f"out={place / 'c'}", *truth.get("convert", [])]) == 0
    assert main(["new", "datasheet", log, f"robot={robot}"]) == 0
    main(["diagnose", log, f"robot={robot}", f"out={place / 'a'}"])
    return json.loads((place / "a" / "diagnosis.json").read_text())


@pytest.mark.thorough
@pytest.mark.validation
@pytest.mark.parametrize(
    "name", [QUICK, *(pytest.param(n, marks=pytest.mark.slow) for n in NAMED if n != QUICK)]
)
def test_what_was_hidden_is_named(name: str, tmp_path: Path) -> None:
    """The name alone, and its numbers within 5 % or within twice the interval's half width."""
    if not FLIGHTS.is_dir():
        pytest.skip(f"the flights are not at {FLIGHTS}")
    found = diagnosed(FLIGHTS / "cases" / name, tmp_path)
    effect, numbers = NAMED[name]
    assert (found["verdict"], [e["name"] for e in found["effects"]]) == ("named", [effect])
    for key, value in numbers.items():
        one = found["effects"][0]["parameters"][key]
        half = 0.5 * (one["high90"] - one["low90"])
        assert abs(one["value"] - value) <= max(0.05 * abs(value), 2.0 * half), key


@pytest.mark.slow
@pytest.mark.validation
def test_a_sensor_beside_its_place_is_named(tmp_path: Path) -> None:
    """What the arm adds to the accelerometer, by the smoothed gyroscope: name and place."""
    if not FLIGHTS.is_dir():
        pytest.skip(f"the flights are not at {FLIGHTS}")
    arm = np.array([0.06, -0.08, 0.0])

    def moved(text: str) -> str:
        rows = list(csv.DictReader(io.StringIO(text)))
        spin = np.array([[float(row[f"g{a}"]) for a in "xyz"] for row in rows])
        smooth, rising = (savgol_filter(spin, 9, 3, deriv=k, delta=0.01, axis=0) for k in (0, 1))
        more = np.cross(rising, arm) + np.cross(smooth, np.cross(smooth, arm))
        out = io.StringIO()
        table = csv.DictWriter(out, rows[0])
        table.writeheader()
        for row, added in zip(rows, more, strict=True):
            felt = {f"a{a}": float(row[f"a{a}"]) + v for a, v in zip("xyz", added, strict=True)}
            table.writerow({**row, **felt})
        return out.getvalue()

    found = diagnosed(FLIGHTS / "cases" / "01_none", tmp_path, moved)
    assert [e["name"] for e in found["effects"]] == ["sensor_place"]
    for axis, value in zip("xyz", arm, strict=True):
        assert found["effects"][0]["parameters"][f"offset_{axis}"]["value"] == pytest.approx(
            value, abs=0.008
        )


@pytest.mark.validation
@pytest.mark.slow
def test_a_thrust_that_falls_along_the_log_is_no_step(tmp_path: Path) -> None:
    """Ten per cent from the first row to the last, without a logged voltage: told with its size."""
    if not FLIGHTS.is_dir():
        pytest.skip(f"the flights are not at {FLIGHTS}")
    found = diagnosed(FLIGHTS / "cases" / "21_sag", tmp_path)
    assert found["verdict"] == "none_of_these"
    said = found["reasons"][0]
    change = re.search(r"thrust_coefficient changes steadily along the log here, by (\S+) ", said)
    assert change is not None
    assert float(change[1]) == pytest.approx(-0.1, abs=0.01)
