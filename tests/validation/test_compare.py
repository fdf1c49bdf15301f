"""Comparisons with measurements that nobody here made: errors on data that the fit never saw."""

from __future__ import annotations

import numpy as np
import pytest

from seals.compare.application import compare_logs, read_logs, settings_of
from seals.compare.events import find_drop
from seals.compare.result import Group
from seals.config.compose import compose
from seals.plugins.readers.impack import ReaderImpack

pytestmark = pytest.mark.validation

LIGHT = {
    # held-out error [m] with linear drag by an independent script: fit on drop 1, judged on drop 2
    "blue_basketball": 0.183,
    "green_basketball": 0.100,
    "volleyball": 0.136,
    "tennis_ball": 0.270,
    "whiffle_ball_1": 0.114,
    "whiffle_ball_2": 0.432,
    "yellow_whiffle_ball": 0.559,
    "orange_whiffle_ball": 0.126,
}


def groups(*overrides: str) -> dict[str, Group]:
    """Run a comparison and return its groups by name."""
    settings = settings_of(compose(list(overrides), root="compare"))
    return {g.name: g for g in compare_logs(settings, read_logs(settings)).groups}


def held_out(group: Group, channel: str) -> list[float]:
    """Held-out error of every variant."""
    return [variant.rms(channel, held_out=True) for variant in group.variants]


def test_every_drop_into_water_is_read_right(measurements: None) -> None:
    """Release, entry and catch of all 15 drops; the free fall reads 0 g within 0.1 m/s^2."""
    logs = ReaderImpack().read()
    assert len(logs) == 15
    for log in logs:
        events = find_drop(log.time, log.channel("specific_force"))
        nominal = log.meta["drop"]["nominal_speed"]
        assert 9.81 * events.fall == pytest.approx(nominal, rel=0.03), log.name
        assert abs(events.offset) < 0.1, log.name
        # the catch comes 0.1 to 0.25 s after the water, and is by far the larger spike
        assert events.caught, log.name
        assert 0.09 < events.catch - events.entry < 0.26, log.name


@pytest.mark.thorough
@pytest.mark.parametrize(
    "ball", ["whiffle_ball_1", pytest.param("tennis_ball", marks=pytest.mark.slow)]
)
def test_drag_explains_the_second_drop_of_a_light_ball(ball: str, measurements: None) -> None:
    """The held-out error falls to that of an independent fit."""
    group = groups("experiment=falling_balls", f"only=[{ball}]")[ball]
    gravity, linear, quadratic = held_out(group, "position")
    assert linear <= 1.1 * LIGHT[ball]
    assert quadratic < 0.5 * gravity


@pytest.mark.thorough
def test_no_drag_is_found_on_the_bowling_ball(measurements: None) -> None:
    """A drag that helps the first drop only is not claimed: the held-out error stays."""
    group = groups("experiment=falling_balls", "only=[bowling_ball]")["bowling_ball"]
    gravity, linear, quadratic = held_out(group, "position")
    assert max(linear, quadratic) <= 1.02 * gravity
    assert all(f.value <= 2.0 * f.sigma for variant in group.variants for f in variant.fitted)


@pytest.mark.slow
@pytest.mark.parametrize("ball", sorted(LIGHT))
def test_drag_explains_every_light_ball(ball: str, measurements: None) -> None:
    """All eight light balls reach the error of an independent fit."""
    group = groups("experiment=falling_balls", f"only=[{ball}]")[ball]
    assert held_out(group, "position")[1] <= 1.1 * LIGHT[ball]


@pytest.mark.slow
def test_slamming_and_drag_explain_the_water_entry(measurements: None) -> None:
    """Fitted at 2 and 6 m/s, the error at 4 m/s falls from above 4.5 to below 2.7 m/s^2."""
    group = groups("experiment=impack_entry")["impack_entry"]
    _, buoyancy, slamming, drag = held_out(group, "specific_force")
    assert buoyancy > 4.5
    assert slamming < buoyancy
    assert drag < 2.7
    assert not any(f.at_bound for f in group.variants[-1].fitted)


@pytest.mark.slow
def test_viscous_friction_explains_the_pendulum_and_coulomb_does_not(measurements: None) -> None:
    """Viscous friction brings the held-out angle below 0.013 rad; Coulomb friction does not."""
    group = groups("experiment=single_pendulum")["single_pendulum"]
    undamped, viscous, coulomb = held_out(group, "joint_position")
    assert undamped > 0.03
    assert viscous < 0.013
    assert coulomb > 0.95 * viscous
    assert np.isclose(
        group.variants[-1].fitted[1].value, 0.0, atol=3 * group.variants[-1].fitted[1].sigma
    )
