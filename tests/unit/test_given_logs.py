"""What a log does not say of its vehicle, every command takes from the robot's data sheet."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from seals.config.compose import compose
from seals.logs import read_native
from seals.logs.native import write_native
from seals.logs.shipped import find_log
from seals.sysid.report.given_logs import read_log
from seals.sysid.validation.application import _read

ROOTS = ("add", "verify", "calibrate", "diagnose")


@pytest.mark.parametrize("root", ROOTS)
def test_the_data_sheet_of_the_robot_fills_what_a_log_leaves_out(root: str, tmp_path: Path) -> None:
    """A converted log states no tolerances: those of datasheet.yaml reach every command."""
    config = compose([], root=root)
    given = read_native(find_log("hidden_effect/flight_a"))
    bare = {k: v for k, v in given.meta.items() if k != "environment"}
    log = write_native(replace(given, meta=bare), tmp_path / "log")
    robot = tmp_path / "robot"
    robot.mkdir()
    (robot / "datasheet.yaml").write_text("environment: {gravity: 9.5}\nmass: 77.0\n")
    config.robot.folder = str(robot)
    read: Any = (
        _read(config, str(log), "log") if root in ("add", "verify") else read_log(config, log)
    )
    assert read.meta["environment"] == {"gravity": 9.5}
    assert read.meta["vehicle"] == given.meta["vehicle"]
