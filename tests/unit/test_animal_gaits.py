"""Gaits: the order of the legs, the way of the toes, the pace."""

from __future__ import annotations

import numpy as np
import pytest

from seals.config.compose import compose
from seals.errors import ConfigError
from seals.plugins.controllers.walking import Gait, Oscillators, Pattern
from seals.plugins.controllers.walking.anatomy import Anatomy, anatomy_of
from seals.plugins.controllers.walking.pattern import duty_of, phases_of
from seals.plugins.controllers.walking.stride import Walk, cadence, toes_of
from seals.plugins.controllers.walking.walker import Pace
from seals.robot.build import build_robot
from seals.run.build import build_run

PLACES = np.array([[0.03, 0.06, -0.03], [0.0, 0.06, -0.03], [0.0, -0.06, -0.03]])


def legs_of(name: str) -> Anatomy:
    """Return the legs of an animal."""
    return anatomy_of(build_robot(build_run(compose([f"robot={name}"])).robot))


def grounded(pattern: Pattern, name: str) -> np.ndarray:
    """Return how many legs stand at instants of a cycle."""
    legs = legs_of(name)
    phases = phases_of(pattern, legs)
    # between the instants at which legs land and leave
    times = (np.arange(240) + 0.5) / 240.0
    standing = np.mod(times[:, None] + phases, 1.0) < duty_of(pattern, len(phases))
    return standing.sum(axis=1)


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
    count = grounded(pattern, animal)
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
    walk = Walk(0.1, -0.05, 0.8)
    step, frequency = 1e-4, 2.0
    phase = np.array([0.1, 0.2, 0.4])
    options = {"frequency": frequency, "duty": 0.6, "lift": 0.01}
    before = toes_of(phase, PLACES, walk, **options)
    after = toes_of(phase + frequency * step, PLACES, walk, **options)
    rate = (after - before) / step
    x, y = PLACES[:, 0], PLACES[:, 1]
    ground = -np.stack((0.1 - 0.8 * y, -0.05 + 0.8 * x, 0.0 * x), axis=1)
    assert rate == pytest.approx(ground, abs=1e-9)


def test_a_toe_in_the_air_comes_back_without_a_jump() -> None:
    """Over a cycle the way of a toe is closed and continuous, and it rises by the lift."""
    phase = np.linspace(0.0, 1.0, 2001)
    walk = Walk(0.2, 0.0, 0.0)
    ways = np.array(
        [
            toes_of(np.full(3, p % 1.0), PLACES, walk, frequency=4.0, duty=0.5, lift=0.01)[0]
            for p in phase
        ]
    )
    assert np.abs(np.diff(ways, axis=0)).max() < 1e-4
    assert np.ptp(ways[:, 0]) == pytest.approx(0.2 * 0.5 / 4.0, rel=1e-6)
    assert ways[:, 2].max() + 0.03 == pytest.approx(0.01, rel=1e-4)


def test_the_pace_follows_the_speed() -> None:
    """Strokes keep their length while the frequency can rise; then the walk is shortened."""
    places = PLACES[:, :2]
    options = {"duty": 0.5, "stroke": 0.03, "low": 1.0, "high": 4.0}
    assert cadence(Walk(0.01, 0.0, 0.0), places, **options) == (1.0, Walk(0.01, 0.0, 0.0))
    frequency, walk = cadence(Walk(0.12, 0.0, 0.0), places, **options)
    assert frequency == pytest.approx(0.12 * 0.5 / 0.03)
    frequency, walk = cadence(Walk(0.48, 0.0, 0.0), places, **options)
    assert frequency == 4.0
    assert walk.ahead == pytest.approx(0.24)


def bound(gait: Gait | Oscillators) -> Gait | Oscillators:
    """Return a gait that knows the crab."""
    from seals.control.plant import build_plant
    from seals.effects.binding import bind_effects

    settings = build_run(compose(["robot=crab"]))
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
        pace = Pace(phase, Walk(0.0, 0.0, 0.0), 0.0, 1.0, 2.0)
        for _ in range(500):
            pace = pace._replace(phase=gait.advanced(pace, manner, 0.01))
        apart = np.mod(pace.phase - order - (pace.phase[0] - order[0]) + 0.5, 1.0) - 0.5
        assert np.abs(apart).max() < 1e-3
        later = gait.advanced(pace, manner, 0.01)
        assert np.mod(later - pace.phase, 1.0) == pytest.approx(0.02, abs=1e-5)


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
