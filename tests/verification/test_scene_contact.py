"""The contact sensor against weights, and against the contacts of the engine itself."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest

from seals.plugins.sensors.contact import SensorContact
from seals.plugins.sensors.locator import SensorLocator
from seals.run.assembly import build_world
from seals.run.build import run_settings
from seals.run.settings import RunSettings
from seals.run.simulation import simulate
from seals.sensors.protocol import SensorInput
from seals.testing.sensor import check_sensor

WEIGHT = 0.1 * 9.81


def settings(*overrides: str) -> RunSettings:
    """A cube as pad on the ground, with a contact sensor without noise."""
    base = ["robot=cube", "environment.ground_level=0", "initial.position=[0,0,0.0255]"]
    sensor = ["+sensor@sensors.pad=contact", "sensors.pad.noise=0"]
    return run_settings([*base, *sensor, *overrides])


def felt(pressing: float, step: float = 0.004) -> SensorInput:
    """An instant in which a link is pressed."""
    zero = np.zeros(3)
    motion = (0.0, step, zero, np.eye(3), zero, zero, zero, zero)
    return SensorInput(*motion, pressing=pressing)


@pytest.mark.parametrize("load", [0.0, 0.2, 1.0])
def test_a_pad_reads_the_weight_that_it_carries(load: float) -> None:
    """A pad on the ground reads its own weight and that of a cube on top of it."""
    more = [f"+objects.top={{robot: cube, position: [0, 0, 0.0765], mass: {load}}}"]
    log = simulate(settings("time.duration=1.5", *(more if load else []))).log
    # the pad touches the ground from below and the load from above: both normal forces count
    expected = WEIGHT + load * 9.81 + load * 9.81
    assert log.columns["pressing"][-50:].mean() == pytest.approx(expected, rel=0.01)
    assert log.columns["contact"][-1] == 1.0


def test_contact_is_reported_only_when_the_engine_has_a_contact() -> None:
    """While a cube bounces and tumbles, the sensor and the engine's contact forces agree."""
    run = settings(
        "initial.position=[0,0,0.2]",
        "initial.rpy=[0.3,0.2,0]",
        "environment.restitution=0.8",
        "sensors.pad.threshold=1e-6",
    )
    with contextlib.closing(build_world(run)) as world:
        actor = world.actors["robot"]
        seen = []
        for _ in range(250):
            world.step()
            reading = actor.readings["pad"]
            assert reading is not None
            points = run.backend._engine.getContactPoints(
                bodyA=actor.body.engine.body, physicsClientId=run.backend._client
            )
            force = sum(point[9] for point in points)
            assert reading["contact"][0] == float(force >= 1e-6)
            assert reading["pressing"][0] == pytest.approx(min(force, 50.0), abs=1e-9)
            seen.append(reading["contact"][0])
    # it falls for 0.17 s before it can touch
    assert not any(seen[:30])
    assert 0.2 < np.mean(seen) < 0.95


def test_forces_below_the_threshold_are_no_contact() -> None:
    """A reading is zero, and no contact, below the threshold; noise never makes a contact."""
    sensor = SensorContact(threshold=0.1, noise=0.5)
    rng = np.random.default_rng(0)
    for pressing, touches in ((0.0, 0.0), (0.099, 0.0), (0.101, 1.0)):
        for _ in range(50):
            reading, _ = sensor.sense(felt(pressing), sensor.start(rng), rng, due=True)
            assert reading is not None
            assert reading["contact"][0] == touches
            assert touches or reading["pressing"][0] == 0.0


def test_a_slow_sensor_reads_the_mean_since_its_last_reading() -> None:
    """A hit between two readings is not lost: its impulse is spread over the time between them."""
    sensor = SensorContact(rate=50.0, noise=0.0)
    rng = np.random.default_rng(0)
    memory = sensor.start(rng)
    for force in (0.0, 10.0, 0.0, 0.0):
        _, memory = sensor.sense(felt(force), memory, rng, due=False)
    reading, _ = sensor.sense(felt(0.0), memory, rng, due=True)
    assert reading is not None
    assert reading["pressing"][0] == pytest.approx(2.0)


def test_a_locator_sees_the_offset_in_its_own_axes() -> None:
    """An object to the north is on the left of a robot that heads east, and ahead after a turn."""
    for yaw, expected in ((0.0, [0, 2, 0]), (np.pi / 2, [2, 0, 0])):
        run = run_settings(
            [
                "robot=cube",
                "environment.gravity=0",
                "+sensor@sensors.eye=locator",
                "sensors.eye={target: thing, noise: 0, floor: 0, rate: 250}",
                "+objects.thing={robot: ball, position: [0, 2, 0]}",
                f"initial.rpy=[0,0,{yaw}]",
                "time.duration=0.01",
            ]
        )
        log = simulate(run).log
        found = [log.columns[f"offset_{axis}"][-1] for axis in "xyz"]
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_locator_refuses_a_body_that_is_not_there() -> None:
    """A target that is no object of the run is named, with the objects that are."""
    sensor, rng = SensorLocator(target="cubus"), np.random.default_rng(0)
    instant = felt(0.0)._replace(others={"cube": np.zeros(3)})
    with pytest.raises(Exception, match="Did you mean 'cube'"):
        sensor.sense(instant, (), rng, due=True)


def test_the_surface_of_a_link_comes_from_its_urdf_or_from_the_run() -> None:
    """Friction stated in the URDF reaches the engine, and the run's value rules over it."""
    for more, expected in (([], 1.0), (["+objects.top.friction=0.3"], 0.3)):
        with contextlib.closing(
            build_world(settings("+objects.top={robot: cube, position: [0, 0, 1]}", *more))
        ) as world:
            body = world.actors["top"].body
            engine = body.engine
            info = engine._p.getDynamicsInfo(engine.body, -1, physicsClientId=engine._client)
        assert info[1] == pytest.approx(expected)
        assert info[6] == pytest.approx(0.0005)
        assert info[7] == pytest.approx(0.002)


@pytest.mark.parametrize("name", ["contact", "locator"])
def test_sensors_keep_the_contract(name: str) -> None:
    """Readings when due, the same under one seed, no hidden state."""
    assert check_sensor(name).channels
