"""Gaits: the order of the legs, the way of the toes, the pace."""

from __future__ import annotations

import numpy as np
import pytest

from seals.api import load_robot
from seals.errors import ConfigError
from seals.frames import matrix_of, quaternion_of_rpy
from seals.plugins.controllers.walking import Gait, Oscillators, Pattern
from seals.plugins.controllers.walking.anatomy import Anatomy, anatomy_of
from seals.plugins.controllers.walking.pattern import duty_of, phases_of
from seals.plugins.controllers.walking.walker import cadence, toes_of
from seals.robot.build import build_robot
from seals.run.build import run_settings

PLACES = np.array([[0.03, 0.06, -0.03], [0.0, 0.06, -0.03], [0.0, -0.06, -0.03]])


def legs_of(name: str) -> Anatomy:
    """Return the legs of an animal."""
    return anatomy_of(load_robot(name))


@pytest.mark.parametrize(
    ("pattern", "animal", "least", "most"),
    [
        (Pattern.tripod, "crab", 3, 3),
        (Pattern.tetrapod, "crab", 4, 4),
        (Pattern.ripple, "crab", 4, 5),
        (Pattern.wave, "crab", 5, 5),
        (Pattern.tripod, "sea_spider", 4, 4),
        (Pattern.wave, "sea_spider", 7, 7),
    ],
)
def test_enough_legs_stand(pattern: Pattern, animal: str, least: int, most: int) -> None:
    """At every instant as many legs stand as the pattern's name says."""
    legs = legs_of(animal)
    phases = phases_of(pattern, legs)
    # between the instants at which legs land and leave
    times = (np.arange(240) + 0.5) / 240.0
    standing = np.mod(times[:, None] + phases, 1.0) < duty_of(pattern, len(phases))
    count = standing.sum(axis=1)
    assert (count.min(), count.max()) == (least, most)


def test_legs_that_hang_down_spread_to_their_side() -> None:
    """A hip about a level axis has a leg's plane that is upright: it spreads level all the same."""
    legs = legs_of("crab")
    level = legs.outward()
    assert np.linalg.norm(level, axis=1) == pytest.approx(np.ones(len(legs.side)))
    assert np.all(level[:, 1] * (1.0 - 2.0 * legs.side) > 0.5)
    basis = legs.basis.copy()
    basis[:, 0] = (0.0, 0.0, -1.0)
    aside = legs._replace(basis=basis).outward()
    assert aside == pytest.approx(np.stack((0.0 * legs.side, 1.0 - 2.0 * legs.side), axis=1))


def test_a_tripod_is_every_second_leg() -> None:
    """Front and rear of one side go with the middle leg of the other."""
    phases = phases_of(Pattern.tripod, legs_of("crab"))
    assert phases.tolist() == [0.0, 0.5, 0.0, 0.5, 0.0, 0.5]


def test_a_standing_toe_rests_on_the_ground() -> None:
    """In body axes a toe on the ground moves as the ground does: against the body's own motion."""
    walk = np.array([[0.1, -0.05, 0.8]])
    step, frequency = 1e-4, 2.0
    phase = np.array([[0.1, 0.2, 0.4]])
    options = {"frequency": frequency, "duty": 0.6, "lift": 0.01}
    before = toes_of(phase, PLACES[None], walk, **options)
    after = toes_of(phase + frequency * step, PLACES[None], walk, **options)
    rate = (after - before)[0] / step
    x, y = PLACES[:, 0], PLACES[:, 1]
    ground = -np.stack((0.1 - 0.8 * y, -0.05 + 0.8 * x, 0.0 * x), axis=1)
    assert rate == pytest.approx(ground, abs=1e-9)


def test_a_toe_in_the_air_comes_back_without_a_jump() -> None:
    """Over a cycle the way of a toe is closed and continuous, and it rises by the lift."""
    phase = np.linspace(0.0, 1.0, 2001)[:, None] % 1.0
    walk = np.array([[0.2, 0.0, 0.0]])
    ways = toes_of(phase, PLACES[None, :1], walk, frequency=4.0, duty=0.5, lift=0.01)[:, 0]
    assert np.abs(np.diff(ways, axis=0)).max() < 1e-4
    assert np.ptp(ways[:, 0]) == pytest.approx(0.2 * 0.5 / 4.0, rel=1e-6)
    assert ways[:, 2].max() + 0.03 == pytest.approx(0.01, rel=1e-4)


def test_the_pace_follows_the_speed() -> None:
    """Strokes keep their length while the frequency can rise; then the walk is shortened."""
    places = PLACES[:, :2]
    options = {"duty": 0.5, "stroke": 0.03, "low": 1.0, "high": 4.0}
    found = [
        cadence(np.array([[speed, 0.0, 0.0]]), places[None], **options)
        for speed in (0.01, 0.12, 0.48)
    ]
    assert [f.item() for f, _ in found] == pytest.approx([1.0, 0.12 * 0.5 / 0.03, 4.0])
    assert [walk[0, 0] for _, walk in found] == pytest.approx([0.01, 0.12, 0.24])


def bound(gait: Gait | Oscillators) -> Gait | Oscillators:
    """Return a gait that knows the crab."""
    from seals.control.plant import build_plant
    from seals.effects.binding import bind_effects

    settings = run_settings(["robot=crab"])
    robot = build_robot(settings.robot)
    effects = bind_effects({**settings.effects, **settings.actuators}, robot.links)
    gait.bind(build_plant(robot, effects, settings.environment))
    return gait


def test_oscillators_find_their_order() -> None:
    """From any phases the legs fall into the order of the lags, and keep the frequency."""
    gait = bound(Oscillators(along=1.0 / 3.0, across=0.5, coupling=8.0))
    manner = gait.manner({})
    order = gait.order(manner)
    for seed in range(5):
        phase = order + np.random.default_rng(seed).uniform(-0.2, 0.2, 6)
        pace = gait.start()._replace(phase=phase[None], frequency=np.array([[2.0]]))
        for _ in range(500):
            pace = pace._replace(phase=gait.advanced(pace, manner, 0.01))
        apart = np.mod(pace.phase[0] - order - (pace.phase[0, 0] - order[0]) + 0.5, 1.0) - 0.5
        assert np.abs(apart).max() < 1e-3
        later = gait.advanced(pace, manner, 0.01)
        assert np.mod(later - pace.phase, 1.0) == pytest.approx(0.02, abs=1e-5)


def test_each_robot_of_a_batch_steps_by_its_own_wishes() -> None:
    """Two crabs told together how to go and turn step as each one told alone."""
    gait = bound(Gait(turn_gain=0.0))
    assert isinstance(gait, Gait)
    many, alone = gait.walking(2, np.zeros(1)), gait.walking(1, np.zeros(1))
    pace, own = many.start(), [alone.start(), alone.start()]
    rng = np.random.default_rng(0)
    for k in range(40):
        yaw, goes = rng.uniform(-3.0, 3.0, 2), k % 20 < 12
        rotation = matrix_of(quaternion_of_rpy(np.stack((0.0 * yaw, 0.0 * yaw, yaw), axis=1)))
        velocity, turn = rng.uniform(-0.3, 0.3, (2, 3)) * goes, rng.uniform(-2.5, 2.5, (2, 1))
        wishes = {"frequency": rng.uniform(1.0, 6.0, (2, 1)), "duty": rng.uniform(0.4, 0.8, (2, 1))}
        values, pace = many.command(rotation, velocity, turn, wishes, pace, step=0.008)
        for row in range(2):
            given = (x[row : row + 1] for x in (rotation, velocity, turn))
            wish = {name: x[row : row + 1] for name, x in wishes.items()}
            told, own[row] = alone.command(*given, wish, own[row], step=0.008)
            np.testing.assert_allclose(values[row], told[0], atol=1e-12)
            np.testing.assert_allclose(pace.phase[row], own[row].phase[0], atol=1e-12)


def test_a_guide_may_say_how_to_step() -> None:
    """Wishes rule over the gait's own values; a wish for what there is not is refused."""
    gait = bound(Gait(lift=0.008))
    manner = gait.manner({"frequency": 3.0, "lift": 0.012})
    assert (manner.low, manner.high, manner.lift) == (3.0, 3.0, 0.012)
    assert gait.manner({}).lift == 0.008
    with pytest.raises(ConfigError, match="lift"):
        gait.manner({"lifft": 0.1})


def test_frequencies_in_order() -> None:
    """A lowest frequency above the highest is refused."""
    with pytest.raises(ConfigError, match=r"controller\.lowest=5\.0 is above"):
        bound(Gait(lowest=5.0, highest=2.0))
