"""A regular wave on deep water: dispersion, orbits, decay, and what a body in it feels."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.effects.identification import Residual
from seals.environment.settings import EnvironmentSettings
from seals.errors import ConfigError
from seals.plugins.waves.airy import WaveAiry
from seals.run import build_world
from seals.run.build import run_settings

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
    run = run_settings(["robot=ball", "water=fossen", *wave, "time.step=0.01"])
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


@pytest.mark.parametrize("depth", [0.0, 4.0])
def test_waves_are_guessed_from_the_force_on_a_hull(depth: float) -> None:
    """At the surface a float is lifted by the crest, below it pushed along the orbits.

    Both with a second of period read off two minutes: a coarse grid of periods would miss it.
    """
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 120.0, 0.06)
    position = 0.1 * rng.standard_normal((len(time), 3)) - [0.0, 0.0, depth]
    side, height, amplitude, period, direction, phase = 0.5, 0.2, 0.05, 3.21, 5.2, 0.7
    omega = 2.0 * math.pi / period
    k = omega**2 / 9.81
    heading = np.array([math.cos(direction), math.sin(direction)])
    theta = k * position[:, :2] @ heading - omega * time + phase
    decay = np.exp(k * np.minimum(position[:, 2], 0.0))
    push = 998.0 * side**2 * height * amplitude * omega**2 * decay
    lift = 0.0 if depth else 998.0 * 9.81 * side**2 * amplitude
    force = np.zeros((len(time), 3))
    force[:, :2] = (push * np.sin(theta))[:, None] * heading
    force[:, 2] = (lift - push) * np.cos(theta)
    force += 0.2 * np.abs(force).max() * rng.standard_normal(force.shape)
    hull = SimpleNamespace(volume=side**2 * height, plan_area=side**2)
    subject: Any = SimpleNamespace(
        hull=hull,
        environment=EnvironmentSettings(water_level=0.0, water_density=998.0, gravity=9.81),
        nominal=lambda name, stem, medium: np.zeros(3),
    )
    residual = Residual(position=position, force=force, time=time, subject=subject)
    found = WaveAiry.guesses(residual)[0]
    assert found["period"] == pytest.approx(period, rel=0.01)
    assert abs(math.remainder(found["direction"] - direction, 2.0 * math.pi)) < math.pi / 8.0
    assert found["amplitude"] == pytest.approx(amplitude, rel=0.2)
