"""A regular wave on deep water: dispersion, orbits, decay, and what a body in it feels."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seals.config.compose import compose
from seals.errors import ConfigError
from seals.plugins.waves.airy import WaveAiry
from seals.run import build_world
from seals.run.build import build_run

WAVE = WaveAiry(amplitude=0.1, period=2.0, direction=0.6, phase=0.3)


def test_the_wave_length_is_that_of_deep_water() -> None:
    """Crests stand g P^2 / (2 pi) apart along the direction of travel."""
    length = 9.81 * 4.0 / (2.0 * math.pi)
    ahead = length * np.array([[math.cos(0.6), math.sin(0.6), 0.0]])
    here, there = (WAVE.at(p, np.zeros((1, 1)), 0.0).elevation for p in (0.0 * ahead, ahead))
    assert float(here[0, 0]) == pytest.approx(float(there[0, 0]), abs=1e-12)


def test_crests_run_in_the_direction_of_the_wave() -> None:
    """Following at the phase speed g P / (2 pi) keeps the elevation."""
    speed = 9.81 * 2.0 / (2.0 * math.pi)
    along = np.array([[math.cos(0.6), math.sin(0.6), 0.0]])
    found = [
        float(WAVE.at(speed * t * along, np.array([[t]]), 0.0).elevation[0, 0])
        for t in (0.0, 0.37, 1.1)
    ]
    assert max(found) - min(found) < 1e-12


def test_water_goes_in_circles_that_shrink_with_depth() -> None:
    """The speed is a w exp(k z) at all times: half at a depth of ln 2 / k."""
    k, omega = WAVE.wavenumber, math.pi
    for depth, share in ((0.0, 1.0), (math.log(2.0) / k, 0.5)):
        times = np.linspace(0.0, 2.0, 9)[:, None]
        place = np.tile([1.0, 2.0, -depth], (9, 1))
        velocity = WAVE.at(place, times, 0.0).velocity
        assert velocity is not None
        np.testing.assert_allclose(
            np.linalg.norm(velocity, axis=1), 0.1 * omega * share, rtol=1e-12
        )


def test_water_under_a_crest_moves_with_the_wave() -> None:
    """Under a crest the water runs forward and accelerates downward."""
    crest = WaveAiry(amplitude=0.1, period=2.0).at(np.zeros((1, 3)), np.zeros((1, 1)), 0.0)
    assert crest.velocity is not None
    assert crest.acceleration is not None
    np.testing.assert_allclose(crest.velocity, [[0.1 * math.pi, 0.0, 0.0]], atol=1e-15)
    np.testing.assert_allclose(crest.acceleration, [[0.0, 0.0, -0.1 * math.pi**2]], atol=1e-15)


def test_too_steep_a_wave_is_refused() -> None:
    """A wave beyond linear theory is refused with its steepness."""
    with pytest.raises(ConfigError, match="steepness"):
        WaveAiry(amplitude=0.5, period=1.0)


def test_a_small_float_rides_the_long_wave() -> None:
    """A light ball on a wave of 62 m length rises and falls with the surface, within 5 %."""
    wave = ["wave=airy", "wave.amplitude=0.3", "wave.period=6.3", "initial.position=[0,0,0.31]"]
    run = build_run(compose(["robot=ball", "water=fossen", *wave, "time.step=0.01"]))
    surface = WaveAiry(amplitude=0.3, period=6.3)
    world, off = build_world(run), []
    for k in range(1300):
        world.step()
        if k > 650:
            place = world.actors["robot"].body.read().position
            level = surface.at(place[None], np.array([[world.time]]), 0.0).elevation[0, 0]
            off.append(place[2] - level)
    world.close()
    # it floats deeper or higher by a constant; what is left is the part that does not follow
    assert np.ptp(off) < 0.05 * 0.6
