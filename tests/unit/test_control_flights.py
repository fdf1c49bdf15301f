"""Guide and controller in a run: their rates, memory, logs and refusals."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np
import pytest

from seals.api import make
from seals.control.estimate import ORIENTATION, POSITION, SPIN, VELOCITY
from seals.control.protocols import ActuatorCommand, Reference, RobotState
from seals.errors import ConfigError
from seals.frames import matrix_of
from seals.logs import Log
from seals.plugins.guides.hover import ArmMotion, Hover
from seals.plugins.guides.oval import Oval
from seals.plugins.sensors.odometry import SensorOdometry
from seals.run.assembly import build_world
from seals.run.build import run_settings
from seals.run.simulation import simulate
from seals.sensors.protocol import SensorInput

QUAD = ("robot=crazyflie", "controller=cascade", "guide=hover", "initial.position=[0,0,1]")
ARM = ("robot=aam", "guide=hover", "guide.arm=sweep", "guide.delay=0.1", "initial.position=[0,0,2]")
NOISY = ("+sensor@sensors.odometry=odometry", "controller.sense=odometry")


def flown(*overrides: str) -> Log:
    """Simulate a run and return its log."""
    record = simulate(run_settings(overrides))
    assert record.error is None
    return record.log


def test_a_quadrotor_goes_back_to_its_place_from_a_tumble() -> None:
    """Released turning and tilted, a small quadrotor is back at rest after four seconds."""
    log = flown(
        *QUAD,
        "initial.rpy=[0.5,-0.4,0.2]",
        "initial.angular_velocity=[3,-2,1]",
        "guide.position=[0,0,1]",
        "guide.yaw=[0]",
        "time.duration=4",
        "time.step=0.002",
    )
    place, turn = log.channel("position")[-1], log.channel("orientation")[-1]
    assert place == pytest.approx([0.0, 0.0, 1.0], abs=0.01)
    assert abs(turn[0]) == pytest.approx(1.0, abs=1e-3)
    assert np.abs(log.channel("velocity")[-1]).max() < 0.02


def test_the_log_holds_what_was_commanded_from_its_row_on() -> None:
    """Commands of drives and servos stand at the row of their time and hold until the next."""
    settings = run_settings([*ARM, "time.duration=0.1"])
    log = simulate(settings).log
    with contextlib.closing(build_world(settings)) as world:
        actor = world.actors["robot"]
        for row in range(20):
            world.step()
            assert actor.command is not None
            assert actor.joint_command is not None
            np.testing.assert_array_equal(log.channel("rotor_speed_cmd")[row], actor.command[0])
            np.testing.assert_array_equal(
                log.channel("joint_position_cmd")[row], actor.joint_command[0]
            )


def test_a_controlled_run_continues_from_a_snapshot_bit_for_bit() -> None:
    """The memory of guide, controller and estimate is part of the snapshot."""
    with contextlib.closing(make([*ARM, *NOISY, "water=fossen"])) as world:
        actor = world.actors["robot"]
        for _ in range(40):
            world.step()
        kept = world.snapshot()

        def on() -> np.ndarray:
            for _ in range(40):
                world.step()
            assert actor.command is not None
            return np.concatenate([*actor.body.read(), actor.command[0]])

        first = on()
        world.restore(kept)
        np.testing.assert_array_equal(on(), first)


def test_a_controlled_run_repeats_bit_for_bit() -> None:
    """Two runs of one seed give the same log; another seed does not."""
    words = [*ARM, *NOISY, "time.duration=0.3"]
    a, b, c = (flown(*words, f"seed={seed}") for seed in (1, 1, 2))
    for name, values in a.columns.items():
        np.testing.assert_array_equal(values, b.columns[name], err_msg=name)
    assert np.any(a.channel("rotor_speed_cmd") != c.channel("rotor_speed_cmd"))


def test_the_controller_is_called_at_its_own_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    """At a quarter of the steps' rate it is called every fourth step, and its order is held."""
    words = [*QUAD, "controller.rate=62.5", "guide.rate=62.5", "time.step=0.004"]
    with contextlib.closing(make(words)) as world:
        actor = world.actors["robot"]
        assert actor.pilot is not None
        law, called = actor.pilot.controller.command, list[float]()

        def marked(
            situation: RobotState, aim: Reference, memory: Any
        ) -> tuple[ActuatorCommand, Any]:
            called.append(situation.time)
            order, memory = law(situation, aim, memory)
            # every call gives another order, whatever rounding makes of the law
            return order._replace(drive=order.drive + len(called)), memory

        monkeypatch.setattr(type(actor.pilot.controller), "command", staticmethod(marked))
        given = []
        for _ in range(100):
            world.step()
            assert actor.command is not None
            given.append(actor.command[0].copy())
    np.testing.assert_allclose(called, 0.016 * np.arange(25), atol=1e-9)
    changed = np.flatnonzero(np.any(np.diff(given, axis=0) != 0.0, axis=1)) + 1
    assert changed.tolist() == list(range(4, 100, 4))


def test_odometry_spreads_as_it_says() -> None:
    """The readings' errors have the stated spread, in the axes that the channels name."""
    sensor, rng = SensorOdometry(rate=100.0), np.random.default_rng(0)
    turn = matrix_of(np.array([[0.1, -0.2, 0.3, 0.927]]) / np.linalg.norm([0.1, 0.2, 0.3, 0.927]))[
        0
    ]
    felt = SensorInput(
        0.0, 0.01, np.ones(3), turn, np.full(3, 2.0), np.full(3, 3.0), *np.zeros((2, 3))
    )
    rows = [sensor.sense(felt, None, rng, due=True)[0] for _ in range(4000)]
    assert sensor.sense(felt, None, rng, due=False)[0] is None
    table = {k: np.array([row[k] for row in rows if row is not None]) for k in sensor.channels()}
    for key, mean, sigma in (
        (POSITION, 1.0, 0.001),
        (VELOCITY, 2.0, 0.01),
        (SPIN, 3.0, 9e-5 * 10.0),
    ):
        assert table[key].std(axis=0) == pytest.approx(sigma, rel=0.05)
        assert table[key].mean(axis=0) == pytest.approx(mean, abs=5.0 * sigma / 60.0)
    back = matrix_of(table[ORIENTATION][:, [1, 2, 3, 0]])
    error = np.einsum("ji,njk->nik", turn, back)
    small = np.stack([error[:, 2, 1], error[:, 0, 2], error[:, 1, 0]], axis=1)
    assert small.std(axis=0) == pytest.approx(0.002, rel=0.05)


def test_a_sweep_uses_the_whole_range_of_every_joint() -> None:
    """Within a period every arm joint comes to both of its limits, starting from rest."""
    with contextlib.closing(make([*ARM])) as world:
        pilot = world.actors["robot"].pilot
        assert pilot is not None
        guide, robot = pilot.guide, pilot.plant.robot
        assert isinstance(guide, Hover)
        assert guide.arm is ArmMotion.sweep
        swing, index = guide._swings["arm"], list(robot.arms["arm"].joints)
        np.testing.assert_allclose(swing.at(0.0), robot.arms["arm"].stowed)
        angles = np.array([swing.at(t) for t in np.linspace(4.0, 6.0, 401)])
        np.testing.assert_allclose(angles.min(axis=0), robot.lower[index], atol=1e-3)
        np.testing.assert_allclose(angles.max(axis=0), robot.upper[index], atol=1e-3)


def test_the_oval_s_velocity_is_the_slope_of_its_place() -> None:
    """Velocity and acceleration belong to the place, through start, laps and end."""
    oval, h = Oval(laps=2, period=10.0, start_time=3.0), 1e-5
    for time in (0.5, 3.7, 5.0, 9.0, 17.0, 23.5, 25.5, 27.0):
        place, ahead, behind = (oval.place(time + d) for d in (0.0, h, -h))
        slope = (ahead.position - behind.position) / (2.0 * h)
        np.testing.assert_allclose(slope, place.velocity, atol=1e-8)
        bend = (ahead.velocity - behind.velocity) / (2.0 * h)
        np.testing.assert_allclose(bend, place.acceleration, atol=1e-6)
    heights = [oval.place(t).position[2] for t in np.linspace(6.0, 16.0, 1001)]
    assert np.mean(np.array(heights) < 0.0) == pytest.approx(0.5, abs=0.01)
    np.testing.assert_allclose(oval.place(99.0).position, oval.place(0.0).position, atol=1e-12)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (("robot=ball", "guide=hover"), "without a controller that follows it"),
        (("robot=ball", "guide=hover", "controller=cascade"), "needs four rotors"),
        (("robot=aam", "guide=hover", "controller=station"), "do not command surge"),
        (("robot=auv", "guide=hover", "controller=cascade"), "needs four rotors"),
        ((*QUAD, "controller.sense=odometri"), "no such sensor of pose"),
        ((*QUAD, "guide.yaw=[0,1]"), "wrong numbers of values"),
    ],
)
def test_what_cannot_fly_is_refused_in_words(overrides: tuple[str, ...], words: str) -> None:
    """Two lines say what does not fit."""
    with pytest.raises(ConfigError, match=words) as refusal:
        make(overrides)
    assert "\n" in str(refusal.value)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "robot", [pytest.param("hexacopter", marks=pytest.mark.slow), "aam_dual_arm"]
)
def test_other_robots_hover_without_code_of_their_own(robot: str) -> None:
    """Six rotors, or two swinging arms: the same controller holds the place."""
    log = flown(
        f"robot={robot}",
        "guide=hover",
        "guide.arm=random",
        "guide.delay=0",
        "initial.position=[0,0,2]",
        "time.duration=2.6",
    )
    away = log.channel("position")[log.time > 2.0] - [0.0, 0.0, 2.0]
    assert np.abs(away[:, :2]).max() < 0.02
    assert np.abs(away[:, 2]).max() < 0.05


def test_an_underwater_vehicle_holds_station_and_attitude() -> None:
    """Tilted and turning at the start, the submerged vehicle is level at its place after 8 s."""
    log = flown(
        "robot=auv",
        "water=fossen",
        "guide=hover",
        "guide.position=[0,0,-2]",
        "guide.yaw=[0]",
        "initial.position=[0.1,-0.1,-2]",
        "initial.rpy=[0.4,0.3,0.3]",
        "time.duration=8",
        "time.step=0.01",
        "controller.rate=100",
    )
    assert log.channel("position")[-1] == pytest.approx([0.0, 0.0, -2.0], abs=0.01)
    assert abs(log.channel("orientation")[-1, 0]) > 0.9999
