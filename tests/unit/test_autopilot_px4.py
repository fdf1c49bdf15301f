"""A flight in lockstep with a stand-in for PX4 that speaks MAVLink without a library."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.logs.native import read_native

pytest.importorskip("pymavlink", reason="needs aam-seals[autopilot]")
FAKE = Path(__file__).with_name("fake_px4.py")


def test_px4_climbs_and_holds_its_height(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Sensors are noisy and in PX4's axes and units; each step waits for its controls."""
    with socket.socket() as ear:
        ear.bind(("127.0.0.1", 0))
        port = ear.getsockname()[1]
    fake = subprocess.Popen(
        [sys.executable, str(FAKE), str(port), "4", "0.8"], stdout=subprocess.PIPE, text=True
    )
    try:
        words = ["protocol=px4", f"port={port}", "speed=0", "time.step=0.004", "robot=crazyflie"]
        ground = ["environment.ground_level=0", "initial.position=[0,0,0.0155]"]
        assert main(["autopilot", *words, *ground, f"hydra.run.dir={tmp_path / 'run'}"]) == 0
        seen: dict[str, Any] = json.loads(fake.communicate(timeout=30)[0])
    finally:
        fake.kill()
        fake.wait()
    stamps = np.array(seen["stamps"])
    assert np.all(np.diff(stamps) == 4000)
    assert seen["heights"][-1] == pytest.approx(0.8, abs=0.05)
    rest = np.array(seen["sensors"][:50])
    assert rest[:, 2].mean() == pytest.approx(-9.81, abs=0.05)
    # a sensor that never changes counts as stuck
    assert np.all(rest[:, [0, 3, 6, 9]].std(axis=0) > 0.0)
    # nose to the east: the field from the north comes from the left
    assert rest[:, 7].mean() == pytest.approx(-0.2, abs=0.01)
    assert rest[:, 8].mean() == pytest.approx(0.45, abs=0.01)
    # 956 hPa at 488 m
    assert rest[:, 9].mean() == pytest.approx(956.0, abs=0.5)
    turn = np.sqrt(0.5)
    assert seen["quaternion"] == pytest.approx([turn, 0.0, 0.0, turn], abs=0.01)
    fix = seen["fix"]
    assert fix[1:3] == pytest.approx([473977420, 85455940], abs=100)
    assert seen["gps"] == pytest.approx(len(stamps) / 25, abs=2)
    out, err = capfd.readouterr()
    assert "the autopilot closed the connection" in out
    assert "bytes that are not a MAVLink message" in err
    log = read_native(tmp_path / "run")
    # disarmed and starting up, it rests
    assert np.nanmax(log.columns["rotor_speed_cmd_1"][:50]) == 0.0
    assert log.columns["position_z"][-1] == pytest.approx(0.8155, abs=0.05)
    assert main(["run", f"repeat={tmp_path / 'run'}", f"hydra.run.dir={tmp_path / 'two'}"]) == 0
    assert "bit for bit" in capfd.readouterr().out
