"""Motion as small as the noise: the stated model of a slow dive moves no stated number.

The dive is made by an independent simulator, Fossen's equations with published coefficients, and
nothing is hidden in it.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from benchmarks.other_simulators import underwater
from benchmarks.other_simulators.flight_sets import write_table
from seals.cli.main import main


@pytest.mark.thorough
def test_noise_of_a_slow_dive_is_no_inertia_and_no_delay(tmp_path: Path) -> None:
    """Responses along a trajectory that follows the noise found both, by three deviations."""
    path = underwater.circle(radius=1.4, speed=0.5)
    columns = underwater.dive(rng=np.random.default_rng(1), path=path)
    write_table(tmp_path / "log.csv.gz", columns)
    for name, words in underwater.MAPS.items():
        (tmp_path / name).write_text(yaml.safe_dump(dict(words)), encoding="utf-8")
    robot = tmp_path / "robot"
    robot.mkdir()
    for name, text in underwater.ROBOTS["rov"].items():
        (robot / name).write_text(text, encoding="utf-8")
    at = f"{tmp_path}/"
    words = [f"log={at}log.csv.gz", f"map={at}map.yaml", f"robot={robot}", f"out={at}dive"]
    assert main(["convert", *words, f"rate={underwater.RATE}", f"meta={at}water.yaml"]) == 0
    assert main(["new", "datasheet", f"log={at}dive", f"robot={robot}"]) == 0

    answer = tmp_path / "answer"
    call = ["diagnose", f"log={at}dive", f"robot={robot}", f"out={answer}", "report=false"]
    assert main([*call, "processes=1", "plan=false"]) in (0, 13)

    numbers = json.loads((answer / "diagnosis.json").read_text(encoding="utf-8"))["nominal"]
    for key in ("inertia.delta_xx", "inertia.delta_yy", "sensor_delay.delay"):
        assert abs(numbers[key]["value"]) < 2.5 * numbers[key]["sd"], key
