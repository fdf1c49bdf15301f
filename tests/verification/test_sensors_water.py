"""Pressure, Doppler log and satellite receiver against closed-form geometry, called directly."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seals.environment.seawater import density_of
from seals.environment.settings import EnvironmentSettings, ShoreSettings
from seals.frames import matrix_of, quaternion_of_rpy
from seals.plugins.sensors.dvl import SensorDvl
from seals.plugins.sensors.gps import SensorGps
from seals.plugins.sensors.magnetometer import SensorMagnetometer
from seals.plugins.sensors.pressure import SensorPressure
from seals.plugins.waves.airy import WaveAiry
from seals.sensors.protocol import SensorInput
from seals.sensors.surroundings import Surroundings

G, RHO = 9.81, 1000.0
STILL = np.zeros(3)
TILTED = [0.2, -0.3, 1.1]
QUIET_DVL: dict[str, Any] = {"noise": 0.0, "range_noise": 0.0, "spin_noise": 0.0}
QUIET_GPS: dict[str, Any] = dict.fromkeys(
    ("noise", "noise_up", "drift", "drift_up", "velocity_noise"), 0.0
)
QUIET_PRESSURE: dict[str, Any] = {"noise": 0.0, "drift": 0.0, "resolution": 0.0}


def instant(
    around: Surroundings,
    position: Any,
    *,
    rpy: Any = (0.0, 0.0, 0.0),
    velocity: Any = STILL,
    angular_velocity: Any = STILL,
    time: float = 0.0,
) -> SensorInput:
    """An instant of a link; velocity in the world, spin in link axes."""
    turn = matrix_of(quaternion_of_rpy(np.array([rpy], dtype=float)))[0]
    here, v = np.asarray(position, dtype=float), np.asarray(velocity, dtype=float) @ turn
    return SensorInput(
        time,
        0.004,
        here,
        turn,
        v,
        np.asarray(angular_velocity, dtype=float),
        STILL,
        STILL,
        around=around,
    )


def read(sensor: Any, felt: SensorInput, seed: int = 0) -> Any:
    """One reading from a fresh memory."""
    rng = np.random.default_rng(seed)
    return sensor.sense(felt, sensor.start(rng), rng, due=True)[0]


def water(**more: Any) -> Surroundings:
    """Water of one density up to z = 0."""
    waves = more.pop("waves", None)
    return Surroundings(EnvironmentSettings(water_level=0.0, water_density=RHO, **more), waves)


def test_pressure_is_that_of_the_column_above_the_port() -> None:
    """A port 0.3 m off the origin of a tilted body: rho g times its own depth."""
    arm = np.array([0.3, -0.1, 0.2])
    felt = instant(water(), [4.0, 2.0, -7.0], rpy=TILTED)
    sensor = SensorPressure(position=arm.tolist(), density=RHO, **QUIET_PRESSURE)
    roll, pitch, _ = TILTED
    # third row of Rz Ry Rx, written out
    up = [-math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)]
    depth = 7.0 - float(np.dot(up, arm))
    found = read(sensor, felt)
    np.testing.assert_allclose(found["pressure"], RHO * G * depth, rtol=1e-12)
    np.testing.assert_allclose(found["depth"], depth, rtol=1e-12)


def test_pressure_in_a_stratified_column() -> None:
    """Density rising linearly down to 10 m, constant below: g (r d + s d^2 / 2) by pieces."""
    e = EnvironmentSettings(water_level=1.0, salinity=[[0.0, 5.0], [10.0, 35.0]])
    top, low = (float(density_of(np.array(20.0), np.array(s))) for s in (5.0, 35.0))
    for depth in (3.0, 10.0, 25.0):
        first = min(depth, 10.0)
        load = top * first + 0.5 * (low - top) / 10.0 * first**2 + low * (depth - first)
        found = Surroundings(e).pressure(0.0, np.array([0.0, 0.0, 1.0 - depth]))
        assert found == pytest.approx(G * load, rel=1e-12)


def test_pressure_under_a_wave_decays_with_depth() -> None:
    """Linear waves: rho g (-z + eta exp(k (z - eta))), zero at the surface, still far below it."""
    wave = WaveAiry(amplitude=0.02, period=2.0)
    k, a = wave.wavenumber, wave.amplitude
    around = water(waves=wave)
    for depth in (0.1, 0.5, 2.0, 8.0, 25.0):
        for time in np.linspace(0.0, 2.0, 9):
            eta = a * math.cos(math.pi * time)
            expected = RHO * G * (depth + eta * math.exp(-k * (depth + eta)))
            found = around.pressure(float(time), np.array([0.0, 0.0, -depth]))
            # of the wave's 196 Pa
            assert found == pytest.approx(expected, abs=0.05)
    crest = np.array([0.0, 0.0, 0.02 - 1e-9])
    assert 0.0 < around.pressure(0.0, crest) < 1e-3
    assert around.pressure(0.0, crest + np.array([0.0, 0.0, 1e-6])) == 0.0


def test_a_high_wave_is_not_felt_a_hundred_metres_below() -> None:
    """Two metres from trough to crest, 77 m long: 0.03 % of it is left at 100 m, up and down."""
    wave = WaveAiry(amplitude=1.0, period=7.0)
    around, depth = water(waves=wave), 100.0
    times = np.linspace(0.0, 7.0, 28, endpoint=False)
    felt = [around.pressure(float(t), np.array([0.0, 0.0, -depth])) for t in times]
    off = np.array(felt) - RHO * G * depth
    assert np.abs(off).max() < 1.2 * RHO * G * math.exp(-wave.wavenumber * depth)
    assert abs(off.mean()) < 0.1 * np.abs(off).max()


def test_out_of_the_water_no_depth_is_given() -> None:
    """In the air the pressure reads its errors alone, and there is no depth."""
    found = read(SensorPressure(), instant(water(), [0.0, 0.0, 0.5]))
    assert set(found) == {"pressure"}
    assert abs(float(found["pressure"][0])) < 500.0


def test_a_dvl_solves_the_velocity_of_a_tilted_turning_body() -> None:
    """Mounted off the origin and turned: velocity of the link's origin over ground, link axes."""
    velocity, spin = np.array([0.8, -0.4, 0.3]), np.array([0.5, -0.7, 0.9])
    mount = {"position": [0.4, 0.1, -0.2], "rpy": [0.1, -0.05, 0.7]}
    felt = instant(water(tank_bottom=-12.0), [3.0, 1.0, -4.0], rpy=TILTED, velocity=velocity)
    felt = felt._replace(angular_velocity=spin)
    found = read(SensorDvl(**mount, **QUIET_DVL), felt)
    assert found["velocity_valid"] == 1.0
    np.testing.assert_allclose(found["velocity"], felt.velocity, atol=1e-12)
    own = read(SensorDvl(**mount, at_origin=False, **QUIET_DVL), felt)
    np.testing.assert_allclose(
        own["velocity"], felt.velocity + np.cross(spin, mount["position"]), atol=1e-12
    )


def test_beams_of_a_dvl_meet_a_level_bottom() -> None:
    """Level at 8 m: every range is 8 / cos a, every beam the velocity along its own direction."""
    felt = instant(water(tank_bottom=-10.0), [0.0, 0.0, -2.0], velocity=[1.0, 0.5, -0.2])
    sensor = SensorDvl(azimuth=0.0, **QUIET_DVL)
    found, a = read(sensor, felt), sensor.beam_angle
    np.testing.assert_allclose(found["dvl_beam_range"], 8.0 / math.cos(a), rtol=1e-12)
    np.testing.assert_allclose(found["dvl_altitude"], 8.0, rtol=1e-12)
    s, c = math.sin(a), math.cos(a)
    # fore, port, aft, starboard; all of them downwards
    beams = [1.0 * s + 0.2 * c, 0.5 * s + 0.2 * c, -1.0 * s + 0.2 * c, -0.5 * s + 0.2 * c]
    np.testing.assert_allclose(found["dvl_beam_velocity"], beams, rtol=1e-12)


def test_beams_of_a_dvl_meet_a_slope() -> None:
    """Over a shore that climbs at 0.2 rad to the north, tilted: each range solves one plane."""
    shore = ShoreSettings(slope=0.2, waterline=30.0, heading=math.pi / 2.0, width=200.0)
    around = water(tank_bottom=-20.0, ground_level=2.0, shore=shore)
    felt = instant(around, [5.0, 0.0, -1.0], rpy=[0.1, -0.1, 0.4], velocity=[0.3, 0.6, 0.0])
    sensor = SensorDvl(**QUIET_DVL)
    found, a = read(sensor, felt), sensor.beam_angle
    for k in range(4):
        c = sensor.azimuth + k * math.pi / 2.0
        down = np.array([math.sin(a) * math.cos(c), math.sin(a) * math.sin(c), -math.cos(a)])
        way = felt.rotation @ down
        # height of the point above the slope z = tan(0.2) (y - 30) falls to zero along the beam
        rise = math.tan(0.2)
        above = -1.0 - rise * (0.0 - 30.0)
        wanted = above / (rise * way[1] - way[2])
        assert found["dvl_beam_range"][k] == pytest.approx(wanted, rel=1e-10)
        assert found["dvl_beam_velocity"][k] == pytest.approx(down @ felt.velocity, abs=1e-12)
    np.testing.assert_allclose(found["velocity"], felt.velocity, atol=1e-12)


@pytest.mark.parametrize(
    ("height", "rpy", "locked"),
    [
        (-4.0, [0.0, 0.0, 0.0], True),
        (0.3, [0.0, 0.0, 0.0], False),  # out of the water
        (-9.97, [0.0, 0.0, 0.0], False),  # 3 cm above the bottom
        (-9.94, [0.0, 0.0, 0.0], True),  # 6 cm
        (-4.0, [0.51, 0.0, 0.0], True),
        (-4.0, [0.54, 0.0, 0.0], False),  # beyond 30 deg
        (-4.0, [math.pi, 0.0, 0.0], False),  # upside down
    ],
)
def test_a_dvl_knows_when_it_has_lost_the_bottom(height: float, rpy: Any, locked: bool) -> None:
    """Without lock the flag is 0 and there is no velocity at all, not a zero."""
    found = read(SensorDvl(), instant(water(tank_bottom=-10.0), [0, 0, height], rpy=rpy))
    assert bool(found["velocity_valid"][0]) is locked
    assert ("velocity" in found) is locked
    assert ("dvl_altitude" in found) is locked
    assert bool(np.isfinite(found["dvl_beam_range"]).all()) is locked


def test_a_dvl_loses_the_bottom_too_high_above_it() -> None:
    """The largest altitude is along the axis; above a bottom that is too deep nothing returns."""
    for depth, locked in ((-51.9, True), (-52.1, False)):
        found = read(SensorDvl(), instant(water(tank_bottom=depth), [0.0, 0.0, -2.0]))
        assert bool(found["velocity_valid"][0]) is locked
    found = read(SensorDvl(), instant(water(), [0.0, 0.0, -2.0]))
    assert found["velocity_valid"] == 0.0


def test_three_beams_are_enough_for_a_dvl() -> None:
    """Nose up before a shore one beam falls on its dry part; the others give the velocity."""
    shore = ShoreSettings(slope=0.5, waterline=1.2, width=200.0)
    around = water(tank_bottom=-3.0, ground_level=3.0, shore=shore)
    sensor = SensorDvl(azimuth=0.0, beam_angle=1.2, largest_tilt=0.5, **QUIET_DVL)
    tilt, slow = [0.0, -0.45, 0.0], [0.2, -0.1, 0.05]
    felt = instant(around, [0.0, 0.0, -0.05], rpy=tilt, velocity=slow)
    found = read(sensor, felt)
    assert np.isfinite(found["dvl_beam_velocity"]).tolist() == [False, True, True, True]
    np.testing.assert_allclose(found["velocity"], felt.velocity, atol=1e-12)


def test_the_noise_of_a_dvl_follows_from_its_beams() -> None:
    """Level: sigma / (2 cos a) down and sigma / (sqrt(2) sin a) across, from 4,000 readings."""
    sensor = SensorDvl(noise=0.02)
    felt = instant(water(tank_bottom=-10.0), [0.0, 0.0, -4.0])
    rng, rows = np.random.default_rng(3), []
    memory = sensor.start(rng)
    for _ in range(4000):
        found, memory = sensor.sense(felt, memory, rng, due=True)
        rows.append(found["velocity"])  # type: ignore[index]
    a = sensor.beam_angle
    wanted = np.array([0.02 / (math.sqrt(2.0) * math.sin(a))] * 2 + [0.02 / (2.0 * math.cos(a))])
    # 4,000 readings know a deviation to 1.1 %
    np.testing.assert_allclose(np.std(rows, axis=0), wanted, rtol=0.045)
    assert sensor.sigmas()["velocity"] == pytest.approx(wanted.max(), rel=1e-9)


def test_a_magnetometer_gives_the_heading() -> None:
    """Level, with iron taken off, atan2(-y, x) of a field to the north is the turn from north."""
    iron, quiet = [3e-6, -2e-6, 1e-6], {"noise": 0.0, "resolution": 0.0, "east": 0.0}
    for heading in (0.0, 1.0, -2.5):
        # x points north at a yaw of a quarter turn
        felt = instant(water(), [0.0, 0.0, 1.0], rpy=[0.0, 0.0, 0.5 * math.pi + heading])
        found = read(SensorMagnetometer(hard_iron=iron, **quiet), felt)["magnetic_field"] - iron
        assert math.atan2(-found[1], found[0]) == pytest.approx(heading, abs=1e-12)
        assert found[2] == pytest.approx(-4.5e-5, rel=1e-12)


def test_a_receiver_reads_the_antenna_in_the_world() -> None:
    """Position and velocity of the antenna, not of the body's origin."""
    arm, spin, velocity = np.array([0.1, 0.0, 0.4]), np.array([0.0, 0.5, 1.0]), [1.0, 2.0, 0.0]
    felt = instant(water(), [7.0, 8.0, 0.2], rpy=TILTED, velocity=velocity, angular_velocity=spin)
    found = read(SensorGps(position=arm.tolist(), **QUIET_GPS), felt)
    np.testing.assert_allclose(found["gps_position"], felt.position + felt.rotation @ arm)
    moving = velocity + felt.rotation @ np.cross(spin, arm)
    np.testing.assert_allclose(found["gps_velocity"], moving, atol=1e-12)


def test_a_receiver_is_silent_under_the_local_surface() -> None:
    """An antenna held at 5 cm in waves of 20 cm reads exactly while a cos(w t) is below it."""
    wave = WaveAiry(amplitude=0.2, period=4.0)
    sensor, rng = SensorGps(acquire=0.0, **QUIET_GPS), np.random.default_rng(0)
    around, memory = water(waves=wave), sensor.start(rng)
    heard = 0
    for time in np.arange(0.05, 8.0, 0.1).tolist():
        felt = instant(around, [0.0, 0.0, 0.05], time=time)
        reading, memory = sensor.sense(felt, memory, rng, due=True)
        dry = 0.2 * math.cos(2.0 * math.pi / 4.0 * time) < 0.05
        assert (reading is not None) is dry
        heard += dry
    assert 30 < heard < 60


def test_a_receiver_needs_a_while_after_a_dive() -> None:
    """With a dive of one second it comes back ``acquire`` after the last instant under water."""
    sensor, rng = SensorGps(acquire=1.5, **QUIET_GPS), np.random.default_rng(0)
    around, memory, heard = water(), sensor.start(rng), []
    for k in range(60):
        time = 0.1 * k
        height = -0.1 if 1.0 <= time < 2.0 else 0.1
        reading, memory = sensor.sense(
            instant(around, [0.0, 0.0, height], time=time), memory, rng, due=True
        )
        heard.append(reading is not None)
    # under water last at 1.9 s, so from 3.4 s on
    assert heard == [not 1.0 <= 0.1 * k < 3.4 - 1e-9 for k in range(60)]


def test_the_error_of_a_receiver_wanders_as_declared() -> None:
    """400 receivers: deviation of the slow error, and its correlation after 60 s, exp(-60/300)."""
    quiet = {**QUIET_GPS, "drift": 2.0, "drift_up": 4.0}
    sensor, rng = SensorGps(rate=1.0, drift_time=300.0, **quiet), np.random.default_rng(5)
    pairs = []
    for _ in range(400):
        memory = sensor.start(rng)
        rows = []
        for time in (0.0, 20.0, 60.0):
            felt = instant(water(), [0.0, 0.0, 1.0], time=time)
            reading, memory = sensor.sense(felt, memory, rng, due=True)
            rows.append(reading["gps_position"] - felt.position)  # type: ignore[index]
        pairs.append(rows)
    error = np.array(pairs) / np.array([2.0, 2.0, 4.0])
    # 1,200 numbers: a deviation to 2 %, a correlation to 1 - r^2 over 35
    np.testing.assert_allclose(error.std(axis=(0, 2)), 1.0, rtol=0.09)
    for later, span in ((1, 20.0), (2, 60.0)):
        found = float(np.mean(error[:, 0] * error[:, later]))
        assert found == pytest.approx(math.exp(-span / 300.0), abs=0.12)
