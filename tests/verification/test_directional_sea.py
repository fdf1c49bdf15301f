"""Seas whose directions are spread: moments of the realised field against the closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seals.environment.linear_waves import spread
from seals.errors import ConfigError
from seals.plugins.waves.sea import Spectrum, WaveSea
from seals.run.build import run_settings
from seals.run.simulation import simulate

HEIGHT, PERIOD, WAVES = 2.0, 8.0, 400


def sea(spreading: float | None, **values: Any) -> WaveSea:
    """An irregular sea."""
    given: dict[str, Any] = {"direction": 0.7, "components": WAVES, **values}
    irregular = {"spectrum": Spectrum.jonswap, "spreading": spreading}
    return WaveSea(height=HEIGHT, period=PERIOD, **irregular, **given)


def moments(s: float) -> tuple[float, float]:
    """Means of cos b and of cos 2b of cos^2s(b / 2), by Beta functions."""
    return s / (s + 1.0), s * (s - 1.0) / ((s + 1.0) * (s + 2.0))


@pytest.mark.parametrize("s", [1.0, 5.0, 25.0])
def test_directions_have_the_moments_of_the_law(s: float) -> None:
    """Both circular moments of the spread, and its symmetry, within a strip of the quantiles."""
    found = spread(s, 4000)
    first, second = moments(s)
    assert np.cos(found).mean() == pytest.approx(first, abs=1e-4)
    assert np.cos(2.0 * found).mean() == pytest.approx(second, abs=4e-4)
    assert abs(np.sin(found).mean()) < 1e-10


@pytest.mark.parametrize("s", [2.0, 10.0])
def test_the_field_has_the_height_and_the_spread_of_its_law(s: float) -> None:
    """Significant height, mean direction and spread of slopes, from elevation and slopes.

    Slopes at many places and times: <(n . grad eta)^2> about the mean direction is (1 + m_2) / 2 of
    the whole, across it (1 - m_2) / 2. Each component has one direction: the share scatters by the
    number of components, weighted by their steepness.
    """
    waves, rng = sea(s), np.random.default_rng(5)
    number = 40_000
    place = np.column_stack([rng.uniform(-4e4, 4e4, (number, 2)), np.zeros(number)])
    found = waves.at(place, rng.uniform(0.0, 1e5, (number, 1)), 0.0)
    eta = np.asarray(found.elevation)[:, 0]
    # each place is a sample of the normal distribution: the variance errs by sqrt(2 / n)
    spreads = math.sqrt(2.0 / number)
    assert 4.0 * eta.std() == pytest.approx(HEIGHT, rel=4.0 * 0.5 * spreads)
    normal = np.asarray(found.normal)
    slope = -normal[:, :2] / normal[:, 2:]
    along = slope @ [math.cos(0.7), math.sin(0.7)]
    across = slope @ [-math.sin(0.7), math.cos(0.7)]
    share = (along**2).mean() / (slope**2).sum(axis=1).mean()
    weight = (waves._k * waves._amplitude) ** 2
    effective = weight.sum() ** 2 / (weight**2).sum()
    fourth = math.prod((s - k) / (s + k + 1.0) for k in range(4))
    scatter = 0.5 * math.sqrt((0.5 * (1.0 + fourth) - moments(s)[1] ** 2) / effective + spreads**2)
    assert share == pytest.approx(0.5 * (1.0 + moments(s)[1]), abs=4.0 * scatter)
    # no side is preferred: the cross moment is that of sin 2b, which vanishes
    aside = (along * across).mean() / (slope**2).sum(axis=1).mean()
    lean = 0.5 * math.sqrt(0.5 * (1.0 - fourth) / effective + spreads**2)
    assert abs(aside) < 4.0 * lean


def test_the_water_of_a_spread_sea_is_a_potential_flow() -> None:
    """Gradient, acceleration and slope are the derivatives of velocity and elevation."""
    waves, step = sea(3.0, components=20, depth=12.0), 1e-4
    place, time = np.array([[3.0, -2.0, -1.5]]), np.array([[4.2]])

    def at(offset: list[float], later: float = 0.0) -> Any:
        return waves.at(place + np.array([offset]), time + later, 0.0)

    here = at([0.0, 0.0, 0.0])
    for axis in range(3):
        move = [step * (k == axis) for k in range(3)]
        ahead, behind = at(move), at([-x for x in move])
        slope = (ahead.velocity - behind.velocity)[0] / (2.0 * step)
        np.testing.assert_allclose(here.gradient[0, :, axis], slope, atol=1e-7)
    change = (at([0.0] * 3, step).velocity - at([0.0] * 3, -step).velocity)[0] / (2.0 * step)
    np.testing.assert_allclose(here.acceleration[0], change, atol=1e-7)
    assert np.trace(here.gradient[0]) == pytest.approx(0.0, abs=1e-12)
    tilt = [
        (at([step * (k == a) for k in range(3)]).elevation - here.elevation)[0, 0] / step
        for a in range(2)
    ]
    np.testing.assert_allclose(-here.normal[0, :2] / here.normal[0, 2], tilt, atol=1e-5)


def test_a_sea_without_spread_is_the_sum_in_one_direction() -> None:
    """Phases are those of the seed, whether directions spread or not."""
    one, spread_out = sea(None, seed=3), sea(2.0, seed=3)
    phase = np.random.default_rng(3).uniform(0.0, 2.0 * math.pi, WAVES)
    place, time = np.array([[100.0, -40.0, -0.3]]), np.array([[3.0]])
    way = 100.0 * math.cos(0.7) - 40.0 * math.sin(0.7)
    theta = one._k * way - one._omega * 3.0 + phase
    height = float((one._amplitude * np.cos(theta)).sum())
    assert float(one.at(place, time, 0.0).elevation[0, 0]) == pytest.approx(height, abs=1e-12)
    at_origin = [w.at(np.zeros((1, 3)), time, 0.0).elevation for w in (one, spread_out)]
    np.testing.assert_allclose(*at_origin, atol=1e-12)


def test_a_spread_sea_moves_a_robot_and_is_stated_in_its_log() -> None:
    """Compiled and interpreted runs agree; the log says how far the directions spread."""
    words = ["robot=ball", "water=fossen", "wave=sea", "wave.spectrum=jonswap", "wave.height=0.3"]
    words += ["wave.period=3", "wave.spreading=4", "wave.components=12", "time.duration=0.4"]
    logs = [
        simulate(run_settings([*words, f"backend.compiled={c}"])).log for c in ("true", "false")
    ]
    places = [log.channel("position") for log in logs]
    np.testing.assert_allclose(places[0], places[1], atol=1e-9)
    assert np.ptp(places[0][:, 1]) > 1e-4
    assert logs[0].meta["environment"]["wave"]["spreading"] == 4.0


@pytest.mark.parametrize("value", ["0.1", "2000", "nan"])
def test_spreads_beyond_the_law_are_refused(value: str) -> None:
    """Bounds are told; a regular wave has one direction."""
    words = ["robot=ball", "water=fossen", "wave=sea"]
    with pytest.raises(ConfigError, match=r"wave\.spreading"):
        run_settings([*words, "wave.spectrum=jonswap", f"wave.spreading={value}"])
    with pytest.raises(ConfigError, match="one direction"):
        run_settings([*words, "wave.spreading=5"])
