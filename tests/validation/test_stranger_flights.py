"""Flights of a published simulator that is not ours: what was hidden is named.

The way of a newcomer: convert, write the data sheet, diagnose. The flights lie beside the checkout.
"""

from __future__ import annotations

import gzip
import json
import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml

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


def diagnosed(case: Path, place: Path) -> Any:
    """Return the diagnosis of a flight."""
    truth = yaml.safe_load((case / "truth.yaml").read_text())
    robot = place / "robot"
    shutil.copytree(FLIGHTS / "robots" / truth["robot"], robot)
    (place / "log.csv").write_bytes(gzip.decompress((case / "log.csv.gz").read_bytes()))
    maps = FLIGHTS / truth.get("map", "map.yaml")
    words = ["convert", f"log={place / 'log.csv'}", f"map={maps}", f"robot={robot}", "rate=100"]
    log = f"log={place / 'c'}"
    assert main([*words, f"out={place / 'c'}", *truth.get("convert", [])]) == 0
    assert main(["new", "datasheet", log, f"robot={robot}"]) == 0
    main(["diagnose", log, f"robot={robot}", f"out={place / 'a'}"])
    return json.loads((place / "a" / "diagnosis.json").read_text())


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
