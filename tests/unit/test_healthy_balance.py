"""Balance of a flight: what of it is flown, and what its log must hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from seals.arrays import Floats
from seals.errors import LogError
from seals.logs.log import Log
from seals.sysid.data.vehicle import read_vehicle
from seals.sysid.healthy_flights.balance import Balance, balance_of, layout_of
from tests.unit.test_healthy_flights import META, WEIGHT


def flown(time: Floats, speed: Floats, height: Floats | float, name: str = "one") -> Log:
    """A log of four equal rotors."""
    columns = {f"rotor_speed_cmd_{k}": speed for k in (1, 2, 3, 4)}
    return Log(name=name, columns={"t": time, **columns, "position_z": 0.0 * time + height})


def balance(log: Log, **vehicle: object) -> Balance:
    """Balance of a log of the small vehicle, some of whose metadata differ."""
    around = {"environment": vehicle.pop("environment", META["environment"])}
    found = read_vehicle({**META, **around, "vehicle": {**META["vehicle"], **vehicle}})  # type: ignore[dict-item]
    return balance_of(log, found, layout_of(found, log))


def test_a_vehicle_that_floats_flies_while_its_thrusters_rest() -> None:
    """Thrusts that come and go at one depth are one leg; their mean is the balance."""
    time = np.arange(0.0, 8.0, 0.02)
    speed = np.where(time < 4.0, 1000.0, 200.0)
    hull = {
        "primitives": [{"type": "sphere", "size": 0.1, "position": [0.0, 0.0, 0.0]}],
        "displaced_volume": 0.00419, "centre_of_buoyancy": [0.0, 0.0, 0.0], "plan_area": 0.0314,
    }  # fmt: skip
    around = {**META["environment"], "water_level": 0.0}  # type: ignore[dict-item]
    found = balance(flown(time, speed, -3.0), mass=5.0, hull=hull, environment=around)
    assert found.floats
    assert len(found.legs) == 1
    assert found.mean == pytest.approx(1e-8 * 0.5 * (1000.0**2 + 200.0**2), rel=0.01)
    # a flight of the same vehicle in air above the same water
    aloft = flown(time, 0.0 * time + 3000.0, 2.0)
    assert not balance(aloft, mass=5.0, hull=hull, environment=around).floats


def test_a_stated_mass_far_too_high_lets_no_vehicle_float() -> None:
    """Take-off and landing are left out of the mean whatever mass is stated."""
    time = np.arange(0.0, 12.0, 0.02)
    aloft = (time > 2.0) & (time < 10.0)
    log = flown(time, np.where(aloft, 3000.0, 300.0), np.where(aloft, 1.0, 0.0))
    for mass in (WEIGHT / 9.81, 5.0 * WEIGHT / 9.81):
        assert balance(log, mass=mass).mean == pytest.approx(0.09)


def test_a_command_of_zero_in_flight_is_no_landing() -> None:
    """A vehicle that starts aloft stands nowhere; one that landed for long does."""
    time = np.arange(0.0, 8.0, 0.02)
    speed = np.where(np.arange(time.size) == 200, 0.0, 3000.0)
    found = balance(flown(time, speed, 2.0))
    assert len(found.legs) == 1
    assert found.mean == pytest.approx(0.09)
    # a drop out of 1.2 s high up, with the ground below at the end
    time = np.arange(0.0, 10.0, 0.02)
    high = np.where(time < 8.0, 2.0, 0.0)
    speed = np.where(((time > 3.0) & (time < 4.2)) | (time > 8.0), 0.0, 3000.0)
    assert len(balance(flown(time, speed, high)).legs) == 2
    with pytest.raises(LogError, match=r"never leaves the ground(.|\n)*Give the log of a flight"):
        balance(flown(time, np.where(time < 4.0, 3000.0, 0.0), 2.0))


def test_a_drive_without_a_command_is_named() -> None:
    """The column of one drive holds no value in any row."""
    time = np.arange(0.0, 8.0, 0.02)
    log = flown(time, 0.0 * time + 3000.0, 2.0)
    empty = {**log.columns, "rotor_speed_cmd_3": np.full(time.size, np.nan)}
    with pytest.raises(LogError, match="rotor_speed_cmd_3 has no value"):
        balance(replace(log, columns=empty))


def test_an_accelerometer_that_is_silent_in_flight_is_named() -> None:
    """Values on the ground alone tell nothing of what the drives carry."""
    time = np.arange(0.0, 12.0, 0.02)
    aloft = (time > 2.0) & (time < 10.0)
    log = flown(time, np.where(aloft, 3000.0, 0.0), np.where(aloft, 1.0, 0.0))
    force = {
        f"specific_force_{axis}": np.full(time.size, value)
        for axis, value in zip("xyz", (0.0, 0.0, 9.81), strict=True)
    }
    force["specific_force_z"][aloft] = np.nan
    vehicle = read_vehicle(META)
    silent = replace(log, columns={**log.columns, **force})
    with pytest.raises(LogError, match="specific_force_z has no value in flight"):
        balance_of(silent, vehicle, layout_of(vehicle, silent), inertial=True)
