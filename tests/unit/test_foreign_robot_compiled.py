"""A robot of others, imported as the pages say, runs compiled as it runs interpreted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.cli.main import main
from seals.config.compose import compose
from seals.run.build import build_run
from seals.run.simulation import Record, simulate

pytest.importorskip("llvmlite")
pytest.importorskip("mujoco")
data = pytest.importorskip("pybullet_data")

STOPS = {'upper="0.0"': 'upper="0.5"', 'upper="0.04"': 'upper="0.14"'}
"""Limits of the file at which its joints rest, and others: nothing is to touch."""


@pytest.mark.slow
@pytest.mark.usefixtures("elsewhere")
def test_an_arm_with_a_gripper_in_free_fall() -> None:
    """Franka's Panda of PyBullet's data: two seconds, every column within 1e-12 of its largest."""
    source = Path(data.getDataPath()) / "franka_panda" / "panda.urdf"
    assert main(["new", "robot", "panda", f"urdf={source}", "medium=air"]) == 0
    file = Path("panda/panda.urdf")
    text = file.read_text("utf-8").replace('lower="0.0" upper="0.04"', 'lower="-0.1" upper="0.04"')
    for stop, beyond in STOPS.items():
        assert stop in text
        text = text.replace(stop, beyond)
    file.write_text(text, encoding="utf-8")
    plain, fast = (flown(compiled) for compiled in ("false", "true"))
    assert list(plain.log.columns) == list(fast.log.columns)
    for name, values in plain.log.columns.items():
        most = max(1.0, float(np.nanmax(np.abs(values))))
        np.testing.assert_allclose(fast.log.columns[name], values, rtol=0.0, atol=1e-12 * most)


def flown(compiled: str) -> Record:
    """Let it fall with its arm held by servos."""
    words = [
        *("robot=panda", "controller=direct", "guide=hover", "water=none", "time.duration=2"),
        *("initial.position=[0,0,2500]", "environment.ground_level=null", "backend=mujoco"),
        # noise and quantisation would hide what differs, or make steps of it
        *("~sensors.imu", f"backend.compiled={compiled}"),
    ]
    found = simulate(build_run(compose(words)))
    assert found.error is None
    assert "contacts" not in found.log.meta
    return found
