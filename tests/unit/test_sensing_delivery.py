"""Late and lost readings, and faults of any sensor: in the log, for the pilot, in snapshots."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np
import pytest

from seals.api import make
from seals.control.estimate import POSITION
from seals.errors import ConfigError
from seals.plugins.sensors.odometry import SensorOdometry
from seals.sensors.delivery import NEW, Delivery
from seals.sensors.noise import Noise
from seals.state_tree import packed, unpacked
from seals.world import World

FALL = ["robot=ball", "initial.position=[0,0,50]", "environment.ground_level=0"]
SUITE = [
    "robot=auv",
    "water=fossen",
    "environment.tank_bottom=-6",
    "initial.position=[0,0,0.3]",
    "initial.velocity=[0.5,0,1.5]",
    "+sensor@sensors.depth=pressure",
    "sensors.depth={latency: 0.03, dropout: 0.3, outage: 0.1}",
    "+sensor@sensors.dvl=dvl",
    "sensors.dvl={rate: 25, latency: 0.1, dropout: 0.2}",
    "+sensor@sensors.gps=gps",
    "sensors.gps={rate: 25, acquire: 0.1, latency: 0.05}",
    "+sensor@sensors.odometry=odometry",
    "sensors.odometry.latency=0.02",
    "+effect@effects.late=sensor_delay",
    "effects.late={delay: 0.02, sensors: ['*']}",
]
DEEP = ["+sensor@sensors.eye=range_finder", "sensors.eye.rpy=[0,1.5707963267948966,0]"]
QUIET = ["sensors.eye.noise=0", "sensors.eye.noise_share=0", "sensors.eye.resolution=0"]
EYE = [*DEEP, *QUIET, "sensors.eye={rate: 250, farthest: 100}"]


def world_of(*words: str) -> World:
    """A world as composed."""
    return make(list(words))


def advance(world: World, steps: int) -> list[dict[str, Any]]:
    """Readings of every step."""
    rows = []
    for _ in range(steps):
        world.step()
        rows.append(dict(world.actors["robot"].readings))
    return rows


def same(a: Any, b: Any) -> bool:
    """Whether two readings are one, bit for bit."""
    if a is None or b is None:
        return a is b
    return a.keys() == b.keys() and all(np.array_equal(a[c], b[c], equal_nan=True) for c in a)


@pytest.mark.parametrize(("share", "outage"), [(0.1, 0.0), (0.3, 0.2), (0.8, 0.5), (1.0, 0.0)])
def test_losses_have_their_share_and_length(share: float, outage: float) -> None:
    """40,000 readings at 50 Hz: the share lost, and the mean length of a loss."""
    way = Delivery(SensorOdometry(rate=50.0, dropout=share, outage=outage))
    rng, line, lost = np.random.default_rng(4), NEW, []
    for k in range(40_000):
        reading, line = way.report(0.02 * k, 0.004, {"a": np.zeros(1)}, line, rng)
        lost.append(reading is None)
    assert np.mean(lost) == pytest.approx(share, abs=0.02)
    if share < 1.0:
        starts = np.count_nonzero(np.diff(np.array(lost, dtype=int)) == 1)
        wanted = outage * 50.0 if outage else 1.0 / (1.0 - share)
        assert np.sum(lost) / starts == pytest.approx(wanted, rel=0.05)


def test_a_late_reading_keeps_its_row_and_arrives_later() -> None:
    """In the log nothing changes; the pilot hears a reading when it is 0.05 s old."""
    pilot = ["robot=crazyflie", "controller=cascade", "guide=hover", "initial.position=[0,0,1]"]
    pilot += ["+sensor@sensors.odometry=odometry", "sensors.odometry.rate=50"]
    prompt, late = (world_of(*pilot, f"sensors.odometry.latency={t}") for t in (0.0, 0.05))
    rows = [advance(world, 40) for world in (prompt, late)]
    assert all(same(a["odometry"], b["odometry"]) for a, b in zip(*rows, strict=True))
    heard = late.actors["robot"].pilot._kept.readings["odometry"]  # type: ignore[union-attr]
    # at 0.16 s: of 0.1 s, the 25th row; those of 0.12, 0.14 and 0.16 s are on their way
    np.testing.assert_array_equal(heard[POSITION], rows[1][24]["odometry"][POSITION])
    for world in (prompt, late):
        world.close()


def test_a_controller_knows_the_time_of_a_late_reading() -> None:
    """Falling at a known speed, the estimate is carried on from the time it was taken."""
    words = ["robot=crazyflie", "controller=cascade", "guide=hover", "controller.sense=odometry"]
    words += ["initial.position=[0,0,3]", "initial.velocity=[2,0,0]", "effects={}"]
    words += ["+sensor@sensors.odometry=odometry", "sensors.odometry.latency=0.06"]
    words += [f"sensors.odometry.{k}_noise=0" for k in ("position", "velocity", "attitude")]
    with contextlib.closing(world_of(*words)) as world:
        advance(world, 50)
        estimate = world.actors["robot"].pilot._kept.estimate  # type: ignore[union-attr]
    assert estimate is not None
    assert estimate.time == pytest.approx(0.2 - 0.06)
    assert estimate.position[0] == pytest.approx(2.0 * 0.14, abs=0.02)


def test_a_named_fault_makes_any_sensor_late() -> None:
    """Row t of the range finder holds what row t - 0.04 s held without it; others stay."""
    fault = ["+effect@effects.late=sensor_delay", "effects.late.delay=0.04"]
    plain = world_of(*FALL, *EYE)
    late = world_of(*FALL, *EYE, *fault, "effects.late.sensors=[eye]")
    a, b = advance(plain, 60), advance(late, 60)
    assert all(row["eye"] is None for row in b[:10])
    assert all(same(a[k]["eye"], b[k + 10]["eye"]) for k in range(50))
    assert all(same(x["imu"], y["imu"]) for x, y in zip(a, b, strict=True))
    assert a[0]["eye"]["range"] != a[10]["eye"]["range"]
    for world in (plain, late):
        world.close()


@pytest.mark.parametrize(("names", "imu", "eye"), [("[]", True, False), ("['*']", True, True)])
def test_a_delay_acts_on_inertial_sensors_or_on_all(names: str, imu: bool, eye: bool) -> None:
    """Without names as its law says; with a star on every sensor."""
    turn = ["initial.angular_velocity=[0,0,3]", "sensors.imu.position=[0.2,0,0]"]
    still = [f"sensors.imu.{s}_{k}=0" for s in ("gyroscope", "accelerometer") for k in ("noise",)]
    fault = ["+effect@effects.late=sensor_delay", "effects.late.delay=0.04"]
    worlds = [
        world_of(*FALL, *EYE, *turn, *still, *more)
        for more in ((), (*fault, f"effects.late.sensors={names}"))
    ]
    a, b = (advance(world, 40)[-1] for world in worlds)
    for world in worlds:
        world.close()
    assert same(a["eye"], b["eye"]) is not eye
    moved = np.abs(a["imu"]["specific_force"] - b["imu"]["specific_force"]).max() > 1e-6
    assert bool(moved) is imu


def test_a_turned_range_finder_looks_aside() -> None:
    """Turned by 0.3 rad about its own y axis above level ground: height over cos(0.3)."""
    fault = ["+effect@effects.askew=sensor_misalignment", "effects.askew.rotation_y=0.3"]
    with contextlib.closing(world_of(*FALL, *EYE, *fault, "effects.askew.sensors=[eye]")) as world:
        reading = advance(world, 1)[0]["eye"]
        height = float(world.actors["robot"].body.read().position[2])
    assert reading["range"][0] == pytest.approx(height / np.cos(0.3), rel=1e-9)


@pytest.mark.parametrize(
    ("effect", "name", "words"),
    [
        ("sensor_delay", "eyes", "Did you mean 'eye'"),
        ("sensor_misalignment", "odometry", "has no axes of its own"),
    ],
)
def test_faults_of_what_is_not_there_are_refused(effect: str, name: str, words: str) -> None:
    """A sensor that the robot lacks, and one without a mounting."""
    fault = [f"+effect@effects.fault={effect}", f"effects.fault.sensors=[{name}]"]
    with pytest.raises(ConfigError, match=words):
        world_of(*FALL, *EYE, "+sensor@sensors.odometry=odometry", *fault)


@pytest.mark.parametrize(
    ("robot", "plugin", "words"),
    [
        ("auv", "rotor_speed", "has no rotors"),
        ("ball", "battery_meter", "has no battery"),
        ("ball", "encoders", "has no joint"),
    ],
)
def test_a_sensor_of_what_a_robot_lacks_is_refused(robot: str, plugin: str, words: str) -> None:
    """No rotors, no battery, no joints: refused before the start."""
    with pytest.raises(ConfigError, match=words):
        world_of(f"robot={robot}", f"+sensor@sensors.it={plugin}")


def test_late_and_lost_readings_survive_a_snapshot_bit_for_bit() -> None:
    """With readings on their way, losses and faults, a world goes on as it would have."""
    with contextlib.closing(world_of(*SUITE)) as world:
        advance(world, 60)
        kept = world.snapshot()
        first = advance(world, 120)
        lost = [row["depth"] is None for row in first]
        assert 0 < sum(lost) < len(lost)
        assert any(row["gps"] is not None for row in first)
        world.restore(kept)
        again = advance(world, 120)
    for a, b in zip(first, again, strict=True):
        assert all(same(a[name], b[name]) for name in a)


def test_memory_of_sensors_can_be_stored() -> None:
    """A checkpoint holds it: what is read back continues alike."""
    with contextlib.closing(world_of(*SUITE)) as world:
        advance(world, 60)
        suite = world.actors["robot"].sensor_suite
        kept, state = suite.snapshot(), world.rngs["robot"].bit_generator.state
        copy = unpacked(*packed(kept))
        first = advance(world, 1)
        suite.restore(copy)
        world.rngs["robot"].bit_generator.state = state
        assert len(suite.heard()) == len({taken for taken, _, _ in copy[1]})
        assert all(same(kept[0][2][n], copy[0][2][n]) for n in first[0])


def test_a_drift_forgets_as_declared() -> None:
    """20,000 readings a second apart: deviation 0.5 and correlation exp(-1/10) from one on."""
    law, rng = Noise(drift=0.5, drift_time=10.0), np.random.default_rng(8)
    drift, rows = None, []
    for _ in range(20_000):
        value, drift = law.read(np.zeros(1), drift, 1.0, rng)
        rows.append(float(value[0]))
    x = np.array(rows)
    # a tenth of the readings count as independent of each other, at 2 pi a tenth or so
    assert x.std() == pytest.approx(0.5, rel=0.08)
    assert np.mean(x[1:] * x[:-1]) / x.var() == pytest.approx(np.exp(-0.1), abs=0.015)


def test_errors_act_in_their_order() -> None:
    """Scale, bias, range, whole steps; what is not a number stays so."""
    law = Noise(gain=0.1, bias=0.2, step=0.5, low=-1.0, high=3.2)
    found, _ = law.read(np.array([1.0, 9.0, -9.0, np.nan]), None, 0.1, np.random.default_rng(0))
    np.testing.assert_array_equal(found, [1.5, 3.0, -1.0, np.nan])
