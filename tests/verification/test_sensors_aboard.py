"""Sensors of robots in the world, against the simulator's truth."""

from __future__ import annotations

import contextlib
import math
from typing import Any

import numpy as np
import pytest

from seals.api import make
from seals.run.build import run_settings
from seals.run.simulation import simulate
from seals.world import World


def world_of(*words: str) -> World:
    """A world as composed."""
    return make(list(words))


def sensor(name: str, plugin: str, **values: Any) -> list[str]:
    """Overrides that add a sensor."""
    own = [f"sensors.{name}.{key}={value}" for key, value in values.items()]
    return [f"+sensor@sensors.{name}={plugin}", *own]


def quiet(*fields: str) -> dict[str, float]:
    """Errors of zero."""
    return dict.fromkeys(fields, 0.0)


def test_encoders_count_the_joints_of_a_moving_arm() -> None:
    """Every reading is a whole number of counts, within half a count of the joint."""
    step = 0.002
    arm = ["robot=aam", "guide=hover", "guide.arm=sweep", "guide.delay=0.0"]
    words = [*arm, "initial.position=[0,0,2]", *sensor("q", "encoders", resolution=step)]
    with contextlib.closing(world_of(*words, "sensors.q.rate=50")) as world:
        seen, moved = 0, []
        for _ in range(250):
            world.step()
            reading = world.actors["robot"].readings["q"]
            if reading is None:
                continue
            truth = world.actors["robot"].body.joint_positions()
            counts = reading["joint_position"] / step
            np.testing.assert_allclose(counts, np.rint(counts), atol=1e-9)
            assert np.abs(reading["joint_position"] - truth).max() <= 0.5 * step + 1e-12
            seen += 1
            moved.append(truth)
    assert seen == 50
    assert np.ptp(moved, axis=0).max() > 20 * step


def test_chosen_joints_are_read_in_the_order_asked() -> None:
    """Two of six joints, the elbow first."""
    with contextlib.closing(
        world_of("robot=aam", *sensor("q", "encoders", joints="[elbow,shoulder]", resolution=0))
    ) as world:
        world.step()
        for _ in range(4):
            world.step()
        actor = world.actors["robot"]
        truth = actor.body.joint_positions()
        reading = actor.readings["q"] or {}
    np.testing.assert_array_equal(reading["joint_position"], truth[[1, 0]])


def test_rotor_speeds_are_those_that_turn() -> None:
    """In the air the reading is the drive's state of the step that has passed; it does vary."""
    fields = sensor("rpm", "rotor_speed", rate=250, **quiet("noise", "resolution"))
    place = ["initial.position=[0,0,2]", "initial.rpy=[0.3,-0.2,0]"]
    with contextlib.closing(world_of("robot=aam", "guide=hover", *place, *fields)) as world:
        actor, rows = world.actors["robot"], []
        for _ in range(100):
            world.step()
            assert actor.drive is not None
            reading = actor.readings["rpm"] or {}
            np.testing.assert_allclose(reading["rotor_speed"], actor.drive[0], rtol=1e-12)
            rows.append(reading["rotor_speed"])
    assert np.ptp(rows, axis=0).min() > 50.0


def test_a_meter_reads_the_battery_under_load() -> None:
    """Voltage and current are those of the battery at the new time."""
    errors = quiet("voltage_noise", "voltage_step", "current_noise", "current_step")
    fields = sensor("meter", "battery_meter", rate=250, **errors)
    with contextlib.closing(
        world_of("robot=aam", "guide=hover", "initial.position=[0,0,2]", *fields)
    ) as world:
        actor = world.actors["robot"]
        for _ in range(100):
            world.step()
        voltage, current, _ = actor.battery_state()
        reading = actor.readings["meter"] or {}
    assert current > 5.0
    np.testing.assert_allclose(reading["battery_voltage"], voltage, rtol=1e-12)
    np.testing.assert_allclose(reading["battery_current"], current, rtol=1e-12)


def test_a_current_does_not_enter_the_bottom_lock() -> None:
    """Carried off by 0.7 m/s of current, a Doppler log reads the velocity over ground."""
    errors = quiet("noise", "spin_noise", "range_noise")
    mount = {"position": "[0.1,0,-0.1]", "rpy": "[0,0,0.7]"}
    words = ["robot=auv", "water=fossen", "environment.tank_bottom=-9", "initial.position=[0,0,-3]"]
    words += ["initial.rpy=[0.2,0.1,0.5]", "+effect@effects.stream=current"]
    words += ["effects.stream.velocity_x=0.7", *sensor("dvl", "dvl", rate=250, **errors, **mount)]
    with contextlib.closing(world_of(*words)) as world:
        actor = world.actors["robot"]
        for _ in range(250):
            world.step()
            kinematics, moving = actor.look()
            reading = actor.readings["dvl"] or {}
            np.testing.assert_allclose(reading["velocity"], moving.twists[0, 0, :3], atol=1e-12)
        east = float((kinematics.rotations[0, 0] @ reading["velocity"])[0])
    assert 0.1 < east < 0.7


def test_a_receiver_is_silent_while_a_robot_surfaces_in_waves() -> None:
    """An antenna of 0.1 m on a rising robot: a fix exactly when it is above the wave."""
    fields = sensor("gps", "gps", rate=50, acquire=0, position="[0,0,0.1]")
    wave = ["wave=airy", "wave.amplitude=0.1", "wave.period=1.5"]
    words = ["robot=auv", "water=fossen", *wave, "initial.position=[0,0,-1]"]
    with contextlib.closing(
        world_of(*words, *fields, "effects.buoyancy.volume_change=0.001")
    ) as world:
        actor, k = world.actors["robot"], (2.0 * math.pi / 1.5) ** 2 / 9.81
        dry = []
        for _ in range(2000):
            world.step()
            if abs(world.time * 50.0 - round(world.time * 50.0)) > 1e-6:
                continue
            c = actor.body.read()
            antenna = c.position + 0.1 * actor.look()[0].rotations[0, 0, :, 2]
            surface = 0.1 * math.cos(k * antenna[0] - 2.0 * math.pi / 1.5 * world.time)
            assert (actor.readings["gps"] is not None) is bool(antenna[2] > surface)
            dry.append(bool(antenna[2] > surface))
    changes = int(np.abs(np.diff(np.array(dry, dtype=int))).sum())
    assert not dry[0]
    # it comes up and is washed over again and again
    assert changes >= 3


def test_another_robot_is_found_by_a_range_finder() -> None:
    """A ball of 50 mm lies 2 m ahead as an object: the reading is 2 m less its radius."""
    thing = ["+objects.thing={robot: ball, position: [2,0,5]}"]
    fields = sensor("eye", "range_finder", rate=250, **quiet("noise", "noise_share", "resolution"))
    with contextlib.closing(
        world_of("robot=ball", "initial.position=[0,0,5]", *thing, *fields)
    ) as world:
        world.step()
        reading = world.actors["robot"].readings["eye"] or {}
        radius = world.actors["thing"].robot.hulls[0].radius  # type: ignore[union-attr]
    # both fall alike
    assert reading["range"][0] == pytest.approx(2.0 - radius, abs=1e-9)


def test_silence_is_an_empty_cell_of_the_log() -> None:
    """A dive and a rise: no position and no velocity without fix and lock, and a flag of zero."""
    gps = sensor("gps", "gps", rate=50, acquire=0, latency=0.1)
    dvl = sensor("dvl", "dvl", rate=50, rpy="[0,0,0]")
    words = ["robot=ball", "water=fossen", "environment.tank_bottom=-1", "time.duration=1.0"]
    words += ["initial.position=[0,0,0.5]", "initial.velocity=[0.4,0,0]", *gps, *dvl]
    record = simulate(run_settings(words))
    assert record.error is None
    log = record.log
    due = np.arange(5, len(log.time), 5)
    under = log.channel("position")[due, 2] < 0.0
    assert 5 < under.sum() < len(due) - 5
    there = np.isfinite(log.channel("gps_position")).all(axis=1)
    np.testing.assert_array_equal(there[due], ~under)
    assert not there[np.setdiff1d(np.arange(len(there)), due)].any()
    np.testing.assert_array_equal(log.columns["velocity_valid"][due], under.astype(float))
    np.testing.assert_array_equal(np.isfinite(log.columns["velocity_x"][due]), under)
    told = log.meta["sensors"]["channels"]
    assert told["gps_position"] == {
        "rate": 50.0,
        "sensor": "gps",
        "unit": "m",
        "sigma": 0.6,
        "latency": 0.1,
    }
    assert set(log.columns) >= {f"dvl_beam_velocity_{k}" for k in (1, 2, 3, 4)}
