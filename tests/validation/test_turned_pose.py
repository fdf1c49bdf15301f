"""A flight of another simulator whose markers are not level: the fit turns the pose back."""

from __future__ import annotations

import csv
import gzip
import io
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from seals.cli.main import main

DATA = Path(__file__).parent / "strangers"
TURN = np.array([0.03, -0.04, 0.0])
"""Of the markers, two to three degrees [rad]."""


@pytest.mark.thorough
@pytest.mark.validation
def test_markers_that_are_not_level_are_no_effect(tmp_path: Path) -> None:
    """The wind of the flight is named alone, and the turn against the sensor found to 4 mrad.

    How pose and sensor share it, the wind hides: it pushes as a turned thrust would.
    """
    robot, flight, answer = (tmp_path / name for name in ("robot", "flight", "answer"))
    shutil.copytree(DATA / "quad", robot)
    packed = (DATA / "wind.csv.gz").read_bytes()
    rows = list(csv.DictReader(io.StringIO(gzip.decompress(packed).decode())))
    names = [f"mocap_q{axis}" for axis in "xyzw"]
    seen = Rotation.from_quat([[float(row[name]) for name in names] for row in rows])
    turned = (seen * Rotation.from_rotvec(TURN)).as_quat()
    with (tmp_path / "log.csv").open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, rows[0])
        table.writeheader()
        for row, q in zip(rows, turned, strict=True):
            table.writerow({**row, **dict(zip(names, map(str, q), strict=True))})
    words = [f"log={tmp_path / 'log.csv'}", f"map={DATA / 'map.yaml'}", f"robot={robot}"]
    assert main(["convert", *words, "rate=100", "span=[0,5]", f"out={flight}"]) == 0
    assert main(["new", "datasheet", f"log={flight}", f"robot={robot}"]) == 0
    sheet = robot / "datasheet.yaml"
    turns = "tolerance:\n  pose_misalignment: {sigma: 0.02, meaning: 'rad, each axis'}\n"
    sheet.write_text(sheet.read_text().replace("tolerance:\n", turns))
    given = [f"log={flight}", f"robot={robot}", "report=false", "plan=false"]
    assert main(["diagnose", *given, f"out={answer}"]) == 10
    found = json.loads((answer / "diagnosis.json").read_text())
    assert [effect["name"] for effect in found["effects"]] == ["wind"]
    for axis, truth in zip("xy", (3.0, -1.5), strict=True):
        wind = found["effects"][0]["parameters"][f"velocity_{axis}"]
        assert wind["value"] == pytest.approx(truth, abs=0.4)
    for axis, truth in zip("xy", TURN[:2], strict=True):
        pose, sensor = (
            found["nominal"][f"{which}_misalignment.rotation_{axis}"]["value"]
            for which in ("pose", "sensor")
        )
        assert pose - sensor == pytest.approx(truth, abs=0.004)
        assert abs(pose) > 2.0 * abs(sensor)
    # on another stretch the simulator with wind and turn is as good as a right model
    second = tmp_path / "second"
    assert main(["convert", *words, "rate=100", "span=[5,8]", f"out={second}"]) == 0
    model = [f"diagnosis={answer}", "name=windy", f"folder={tmp_path}", f"robot={robot}"]
    assert main(["add", *model]) == 0
    checked = [f"log={second}", f"model={tmp_path / 'windy.yaml'}", f"robot={robot}"]
    assert main(["verify", *checked, f"out={tmp_path / 'checked'}"]) == 0
    error = json.loads((tmp_path / "checked" / "verify.json").read_text())["error"]
    assert error["after"] < 1.3
