"""Messages by sound against closed forms: delay, images in surface and bottom, loss, range."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seals.arrays import Floats
from seals.environment.settings import EnvironmentSettings, ObstacleSettings
from seals.errors import ConfigError
from seals.plugins.sensors.modem import SensorModem
from seals.run.build import run_settings
from seals.run.simulation import simulate
from seals.sensors.acoustics import sound_speed
from seals.sensors.protocol import SensorInput
from seals.sensors.surroundings import Surroundings

ZERO, STEP, DEEP = np.zeros(3), 0.004, 20.0
WATER: dict[str, Any] = {"water_level": 0.0, "tank_bottom": -DEEP}


def heard(
    modem: SensorModem,
    here: list[float],
    seconds: float,
    *,
    velocity: list[float] | None = None,
    sender: Any = None,
    seed: int = 0,
    **environment: Any,
) -> list[tuple[float, dict[str, Floats]]]:
    """Times and readings of a receiver that starts at a place and moves steadily."""
    around = Surroundings(EnvironmentSettings(**(WATER | environment)))
    rng, speed = np.random.default_rng(seed), np.array(velocity or ZERO, dtype=float)
    memory, found, due = modem.start(rng), [], 0.0
    for k in range(round(seconds / STEP)):
        time = k * STEP
        place = np.array(here) + speed * time
        others = {} if sender is None else {"other": sender(time)}
        felt = SensorInput(
            *(time, STEP, place, np.eye(3), speed, ZERO, ZERO, ZERO), around=around, others=others
        )
        sent = time >= due - 1e-9
        due += sent / modem.rate
        reading, memory = modem.sense(felt, memory, rng, due=sent)
        if reading is not None:
            found.append((time, reading))
    return found


def speed_at(depth: float) -> float:
    """The speed of sound in the water of the default environment."""
    e = EnvironmentSettings()
    warm, salt = e.water_temperature[0][1], e.salinity[0][1]
    return sound_speed(temperature=warm, salinity=salt, depth=depth)


def test_a_message_is_late_by_the_distance_over_the_speed_of_sound() -> None:
    """It stands in the row after its arrival, and tells its travel to rounding."""
    modem = SensorModem(place=[90.0, 120.0, -15.0], rate=1.0, farthest=200.0)
    (when, found), *_ = heard(modem, [0.0, 0.0, -5.0], 0.5)
    delay = math.sqrt(90.0**2 + 120.0**2 + 10.0**2) / speed_at(10.0)
    assert found["modem_delay"][0] == pytest.approx(delay, rel=1e-12)
    assert delay <= when < delay + STEP
    np.testing.assert_array_equal(found["modem_position"], [90.0, 120.0, -15.0])


def test_a_receiver_that_runs_away_hears_later() -> None:
    """Sound that catches up with a receiver needs d / (c - v)."""
    modem = SensorModem(place=[0.0, 0.0, -10.0], rate=0.01)
    for v in (2.0, -2.0):
        (_, found), *_ = heard(modem, [100.0, 0.0, -10.0], 0.2, velocity=[v, 0.0, 0.0])
        assert found["modem_delay"][0] == pytest.approx(100.0 / (speed_at(10.0) - v), rel=1e-12)


def test_a_message_tells_where_the_sender_was() -> None:
    """The position is that at the time of sending, not that of the arrival."""

    def sender(time: float) -> Floats:
        return np.array([100.0 + 50.0 * time, 0.0, -10.0])

    modem = SensorModem(target="other", rate=25.0)
    found = heard(modem, [0.0, 0.0, -10.0], 0.6, sender=sender)
    told = np.array([reading["modem_position"][0] for _, reading in found])
    np.testing.assert_allclose(told, 100.0 + 2.0 * np.arange(len(told)), rtol=1e-12)
    # two are under way at once; the last one that comes by 0.596 s was sent at 0.48 s
    assert len(told) == 13


def test_echoes_come_by_the_images_of_the_sender() -> None:
    """Four paths in water of depth H: levels and lengths by the images, closed form."""
    r, source, place = 40.0, 5.0, 12.0
    modem = SensorModem(place=[r, 0.0, -source], multipath=True, bottom_reflection=0.4)
    (_, found), *_ = heard(modem, [0.0, 0.0, -place], 0.1)
    both, apart = source + place, source - place
    rises = np.array([both, 2 * DEEP - both, 2 * DEEP + apart, 2 * DEEP - apart])
    ways, direct = np.hypot(r, rises), math.hypot(r, source - place)
    speed = speed_at(0.5 * (source + place))
    np.testing.assert_allclose(found["modem_echo_delay"], (ways - direct) / speed, rtol=1e-9)
    levels = 20 * np.log10(np.array([1.0, 0.4, 0.4, 0.4]) * direct / ways)
    np.testing.assert_allclose(found["modem_echo_level"], levels, rtol=1e-9)
    (_, bare), *_ = heard(modem, [0.0, 0.0, -place], 0.1, tank_bottom=None)
    assert np.isfinite(bare["modem_echo_delay"]).tolist() == [True, False, False, False]


def test_messages_are_lost_by_the_seed_and_in_their_share() -> None:
    """The number that arrives is binomial; the same seed loses the same."""
    modem, place = SensorModem(place=[3.0, 0.0, -5.0], rate=100.0, loss=0.3), [0.0, 0.0, -5.0]
    number = 1000
    first = heard(modem, place, number / 100.0)
    again = heard(modem, place, number / 100.0)
    other = heard(modem, place, number / 100.0, seed=1)
    assert [t for t, _ in first] == [t for t, _ in again]
    assert [t for t, _ in first] != [t for t, _ in other]
    spread = math.sqrt(number * 0.3 * 0.7)
    assert abs(len(first) - 0.7 * number) < 4.0 * spread
    assert heard(SensorModem(place=[3.0, 0.0, -5.0], loss=1.0), place, 2.0) == []


@pytest.mark.parametrize(
    ("place", "more"),
    [
        ([0.0, 201.0, -5.0], {}),
        ([0.0, 30.0, 1.0], {}),
        ([0.0, 30.0, -5.0], {"water_level": None}),
        (
            [0.0, 30.0, -5.0],
            {"obstacles": {"rock": ObstacleSettings(size=[4, 4, 30], position=[0, 15, -5])}},
        ),
    ],
)
def test_nothing_is_heard_beyond_the_range_in_the_air_or_behind_a_rock(
    place: list[float], more: dict[str, Any]
) -> None:
    """What does not arrive leaves no reading, and nothing behind it waits."""
    assert heard(SensorModem(place=place, rate=10.0), [0.0, 0.0, -5.0], 0.5, **more) == []


def test_two_robots_exchange_positions() -> None:
    """In a run each hears where the other was, later by the distance over the speed of sound."""
    one = (
        "robots.{}={{robot: {}, initial: {{position: [{}, 0, -8], velocity: [0, 1, 0]}}, "
        "sensors: {{link: {{sensor: modem, target: {}, rate: 10}}}}}}"
    )
    words = [one.format("a", "cube", 0, "b"), one.format("b", "ball", 45, "a")]
    fleet = simulate(run_settings(["water=fossen", "time.duration=0.6", *words])).fleet
    for name, other in (("a", "b"), ("b", "a")):
        own, sender = fleet[name].log, fleet[other].log
        rows = np.flatnonzero(np.isfinite(own.columns["modem_delay"]))
        assert len(rows) == 5
        delay = own.columns["modem_delay"][rows]
        sent = np.rint(10.0 * (own.time[rows] - delay)) / 10.0
        told = own.channel("modem_position")[rows]
        was = sender.channel("position")[np.rint(sent / STEP).astype(int)]
        np.testing.assert_allclose(told, was, atol=1e-12)
        way = np.linalg.norm(own.channel("position")[rows] - told, axis=1)
        # the receiver moves by some millimetres in the step of the arrival
        np.testing.assert_allclose(delay * speed_at(8.0), way, atol=0.01)


def test_a_sender_that_is_not_there_is_named() -> None:
    """A wrong target is refused with those that are there."""
    with pytest.raises(ConfigError, match="modem needs the target 'othr'"):
        heard(SensorModem(target="othr"), [0.0, 0.0, -5.0], 0.1, sender=lambda _: ZERO)
