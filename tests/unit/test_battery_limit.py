"""Drives at a low battery: commands of a log are followed as far as the voltage allows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.arrays import Floats
from seals.cli.main import main
from seals.effects.binding import bind_effects
from seals.logs.log import Log
from seals.logs.native import read_native
from seals.plugins.effects.battery import Battery
from seals.sysid.data.join import join_logs
from seals.sysid.data.robot_description import describe_robot, describe_run
from seals.sysid.data.samples import read_samples
from seals.sysid.data.supply import supplied, supply_words
from seals.sysid.data.vehicle import Vehicle, read_vehicle
from seals.world.drivetrain import response_of
from tests.unit.test_replay_of_a_run import repeated

META: dict[str, Any] = {"environment": {"gravity": [0.0, 0.0, -9.81], "water_level": None}}


@pytest.fixture(scope="module")
def hexacopter() -> Vehicle:
    """Rotors of 940 rad/s at most; 4 cells, 16.4116 V when full."""
    return read_vehicle(META, describe_robot("hexacopter"))


def test_the_limit_falls_with_the_measured_voltage(hexacopter: Vehicle) -> None:
    """940 rad/s times V / V_full; between its samples the voltage is interpolated."""
    command = np.full((4, 6), 1000.0) * [1.0, 1.0, 1.0, -1.0, -1.0, 0.1]
    volts = 16.4116 * np.array([1.0, 0.9, np.nan, 1.1])
    found = supplied(command, volts, 0.1 * np.arange(4), hexacopter)
    # a battery above its full voltage lifts no limit
    assert found[:, 0] == pytest.approx([940.0, 846.0, 940.0, 940.0], rel=1e-5)
    assert found[:, 4] == pytest.approx([-940.0, -846.0, -940.0, -940.0], rel=1e-5)
    assert found[:, 5] == pytest.approx(100.0)


def test_thrusters_fall_with_the_square_of_the_voltage() -> None:
    """Their thrust goes with the square of the speed; without a battery nothing is limited."""
    bare = read_vehicle(META, describe_robot("auv"))
    command = np.full((2, len(bare.lag)), 1e4)
    volts = 0.9 * Battery().full_voltage * np.ones(2)
    assert supplied(command, volts, np.arange(2.0), bare) is command
    fed = replace(bare, effects={**bare.effects, "battery": Battery()})
    limit = response_of(bind_effects(bare.effects, bare.robot.links)).limit
    assert supplied(command, volts, np.arange(2.0), fed)[0] == pytest.approx(0.81 * limit)


def test_a_log_without_voltage_is_told_of(hexacopter: Vehicle) -> None:
    """Only where a drive comes near its limit, and only with a battery."""
    command = np.full((4, 6), 500.0)
    assert not supply_words(command, hexacopter)
    command[3, 2] = 900.0
    assert "25 % of the rows" in supply_words(command, hexacopter)
    effects = {k: e for k, e in hexacopter.effects.items() if k != "battery"}
    assert not supply_words(command, replace(hexacopter, effects=effects))


@pytest.mark.thorough
@pytest.mark.parametrize("sensitivity", [pytest.param(0.0, marks=pytest.mark.slow), 2.0])
def test_a_climb_at_full_throttle_is_repeated(tmp_path: Path, sensitivity: float) -> None:
    """The voltage falls by 4 %, the thrust at the limit by 8 %; the replay knows it."""
    words = ["robot=aam", "guide=waypoints", "guide.delay=0.0", "guide.speed=8.0"]
    words += ["guide.places=[[0.0,0.0,9.0]]", "initial.position=[0.0,0.0,2.0]"]
    words += ["initial.drives=carrying", "initial.joint_position=[1.55,0,0,-0.6,-0.6,-0.6]"]
    words += [f"effects.battery.sensitivity={sensitivity}"]
    assert main(["run", *words, "time.duration=0.6", f"hydra.run.dir={tmp_path / 'climb'}"]) == 0
    log = read_native(tmp_path / "climb")
    vehicle = read_vehicle(log.meta, describe_run(tmp_path / "climb"))
    limit = response_of(bind_effects(vehicle.effects, vehicle.robot.links)).limit
    at_limit = log.channel("rotor_speed_cmd") > 0.999 * limit
    assert at_limit.any(axis=1).sum() > 10
    error = np.abs(repeated(vehicle, log, start=50).error[0])
    # the resolution that the log of a run states
    assert error[:, :6].max() < 1e-3
    blind = replace(log, columns={k: v for k, v in log.columns.items() if "battery" not in k})
    assert np.abs(repeated(vehicle, blind, start=50).error[0])[:, :6].max() > 5e-3


def test_logs_without_voltage_have_a_full_battery() -> None:
    """Of two logs fitted together one has no voltage: nothing sags there."""
    columns = {"t": 0.01 * np.arange(50.0)}
    columns |= {f"position_{a}": np.zeros(50) for a in "xyz"}
    columns |= {f"orientation_{a}": np.full(50, float(a == "w")) for a in "wxyz"}
    columns |= {f"rotor_speed_cmd_{k}": np.full(50, 940.0) for k in range(1, 7)}
    channels = {name: {"sigma": 0.01} for name in ("position", "orientation")}
    meta = {**META, "sensors": {"channels": channels}}
    fed = Log(name="fed", columns={**columns, "battery_voltage": np.full(50, 15.0)}, meta=meta)
    joined = join_logs([fed, Log(name="bare", columns=columns, meta=meta)])
    samples = read_samples(joined, read_vehicle(joined.meta, describe_robot("hexacopter")))
    assert samples.voltage is not None
    assert samples.voltage[[0, 49, 50, 99], 0] == pytest.approx([15.0, 15.0, 16.4116, 16.4116])
    assert samples.command[[49, 50], 0] == pytest.approx([940.0 * 15.0 / 16.4116, 940.0])


def _voltage_of(volts: Floats) -> Floats:
    """Voltage of a log's samples, (T,), as a diagnosis takes it."""
    rows = len(volts)
    columns = {"t": 0.01 * np.arange(float(rows)), "battery_voltage": volts}
    columns |= {f"position_{a}": np.zeros(rows) for a in "xyz"}
    columns |= {f"orientation_{a}": np.full(rows, float(a == "w")) for a in "wxyz"}
    columns |= {f"rotor_speed_cmd_{k}": np.full(rows, 500.0) for k in range(1, 7)}
    channels = {name: {"sigma": 0.01} for name in ("position", "orientation")}
    log = Log(name="log", columns=columns, meta={**META, "sensors": {"channels": channels}})
    vehicle = read_vehicle(log.meta, describe_robot("hexacopter"))
    voltage = read_samples(log, vehicle).voltage
    assert voltage is not None
    return voltage[:, 0]


def test_a_voltage_that_falls_with_the_current_is_not_blurred() -> None:
    """Noise of 10 mV is smoothed away where the voltage is calm; a ripple of 0.5 V stays."""
    rng, time = np.random.default_rng(3), 0.01 * np.arange(1500.0)
    for ripple, missed in ((0.0, 0.003), (0.5, 0.012)):
        true = 15.5 - 0.02 * time + ripple * np.sin(4.0 * np.pi * time)
        seen = _voltage_of(true + 0.01 * rng.standard_normal(1500))
        assert np.sqrt(np.mean((seen - true) ** 2)) < missed
