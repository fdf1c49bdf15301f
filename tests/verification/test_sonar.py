"""Sonar against the sonar equation, published absorption and the statistics of speckle."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from seals.environment.settings import EnvironmentSettings, ObstacleSettings, SolidType
from seals.plugins.sensors.sonar import SensorSonar
from seals.plugins.waves.airy import WaveAiry
from seals.sensors.acoustics import HALF_POWER, absorption, line_pattern
from seals.sensors.echoes import Echoes
from seals.sensors.protocol import SensorInput
from seals.sensors.surroundings import Surroundings

ZERO = np.zeros(3)
SALT: dict[str, Any] = {"salinity": [[0.0, 35.0]], "water_temperature": [[0.0, 10.0]]}


def felt(depth: float = 50.0, **solids: ObstacleSettings) -> SensorInput:
    """A sensor at a depth, looking east, among solids in sea water."""
    around = Surroundings(EnvironmentSettings(water_level=0.0, obstacles=solids, **SALT))
    here = np.array([0.0, 0.0, -depth])
    return SensorInput(0.0, 0.004, here, np.eye(3), ZERO, ZERO, ZERO, ZERO, around=around)


def wall(way: float) -> ObstacleSettings:
    """A wall across the view."""
    return ObstacleSettings(size=[1.0, 200.0, 90.0], position=[way + 0.5, 0.0, -50.0])


def ball(radius: float, *position: float) -> ObstacleSettings:
    """A ball."""
    return ObstacleSettings(type=SolidType.sphere, size=[radius], position=list(position))


def ainslie(f: float, t: float, s: float, depth: float, acidity: float) -> float:
    """Absorption by another fit of the same measurements [dB/km], f in kHz."""
    f1, f2 = 0.78 * math.sqrt(s / 35.0) * math.exp(t / 26.0), 42.0 * math.exp(t / 17.0)
    z = 1e-3 * depth
    boric = 0.106 * f1 * f * f / (f1 * f1 + f * f) * math.exp((acidity - 8.0) / 0.56)
    salts = 0.52 * (1.0 + t / 43.0) * s / 35.0 * f2 * f * f / (f2 * f2 + f * f)
    return boric + salts * math.exp(-z / 6.0) + 4.9e-4 * f * f * math.exp(-(t / 27.0 + z / 17.0))


@pytest.mark.parametrize(
    ("conditions", "published", "tolerance"),
    [
        # example of the R package sonar 1.0.2, which takes 273.15 for the 273 of the paper
        ((50e3, 0.0, 35.0, 0.0, 6.0), 13.96602, 2e-3),
        # calculator of the National Physical Laboratory for this equation, rounded to 1 dB/km
        ((130e3, 8.0, 35.0, 15.0, 8.0), 38.0, 0.5 / 38.0),
        # example and tests of the acoustics toolbox arlpy, rounded to 0.01 and to 1 dB/km
        ((50e3, 27.0, 35.0, 10.0, 8.1), 10.71, 0.005 / 10.71),
        ((100e3, 27.0, 35.0, 10.0, 8.1), 36.0, 0.5 / 36.0),
        ((100e3, 14.0, 38.5, 0.0, 8.1), 40.0, 0.5 / 40.0),
        ((100e3, 14.0, 38.5, 2000.0, 8.1), 30.0, 0.5 / 30.0),
        ((100e3, 14.0, 38.5, 6000.0, 8.1), 16.0, 0.5 / 16.0),
    ],
)
def test_absorption_is_as_published(
    conditions: tuple[float, ...], published: float, tolerance: float
) -> None:
    """Published values of the equation of Francois and Garrison, in dB/km."""
    f, t, s, z, acidity = conditions
    found = 1e3 * absorption(f, temperature=t, salinity=s, depth=z, acidity=acidity)
    assert found == pytest.approx(published, rel=tolerance)


@pytest.mark.parametrize("f", [1e3, 1e4, 5e4, 1e5, 3e5, 7.5e5])
@pytest.mark.parametrize("t", [0.0, 10.0, 18.0])
def test_absorption_agrees_with_its_simplified_form(f: float, t: float) -> None:
    """Within the 10 % that Ainslie and McColm 1998 state against Francois and Garrison."""
    found = 1e3 * absorption(f, temperature=t, salinity=35.0, depth=100.0, acidity=8.0)
    assert found == pytest.approx(ainslie(1e-3 * f, t, 35.0, 100.0, 8.0), rel=0.1)


def test_the_pattern_is_that_of_a_line_array() -> None:
    """One half at half the width; first side lobe at -13.26 dB."""
    assert line_pattern(np.array([0.015]), 0.03)[0] == pytest.approx(0.5, rel=1e-6)
    null = 0.015 / HALF_POWER
    lobe = line_pattern(np.linspace(null, 2.0 * null, 2001), 0.03).max()
    assert 10.0 * math.log10(lobe) == pytest.approx(-13.26, abs=0.01)


@pytest.mark.parametrize("way", [2.0, 7.3, 15.01])
def test_the_range_of_a_plane_is_that_of_its_bin(way: float) -> None:
    """A wall ahead: the middle beam's first return is within half a bin, speckle or not."""
    for speckle in (False, True):
        sonar = SensorSonar(beams=65, bins=512, profile=True, speckle=speckle)
        level = sonar.ping(felt(wall=wall(way)), np.random.default_rng(0))
        # half a bin for the bin's middle, one more for the bins into which the wall curves
        assert sonar.first_returns(level)[32] == pytest.approx(way, abs=1.5 * sonar.size)


def test_the_width_of_a_beam() -> None:
    """Responses of the beams to a small ball fall to one half over the stated width."""
    sonar = SensorSonar(beams=513, sector=0.3, beam_width=0.05, farthest=12.0, rays=64)
    echo = sonar.echo(felt(ball=ball(0.08, 10.0, 0.0, -50.0))).max(axis=1)
    above = sonar.bearings[echo >= 0.5 * echo.max()]
    assert above[0] - above[-1] == pytest.approx(0.05, abs=2.0 * 0.3 / 512)


def test_the_level_of_a_ball_is_that_of_the_sonar_equation() -> None:
    """S - 40 lg r - 2 a r + target strength; far away TS = 10 lg(2 pi R^2 m / 3) (Lambert)."""
    r, radius, strength = 20.0, 0.5, 10.0**-1.5
    sonar = SensorSonar(
        **{"beams": 101, "sector": 0.06, "beam_width": 0.6, "vertical_width": 0.6},
        **{"rays": 1000, "bins": 120, "nearest": 15.0, "farthest": 23.0, "pulse": 3.0},
    )
    # the pattern is flat over the ball: at its limb, 0.025 rad, b is above 0.995
    level = 190.0 + 10.0 * math.log10(sonar.echo(felt(ball=ball(radius, r, 0.0, -50.0)))[50].max())

    def ring(angle: float) -> float:
        way = r * math.cos(angle) - math.sqrt(radius**2 - (r * math.sin(angle)) ** 2)
        facing = (r * math.cos(angle) - way) / radius
        return facing * 2.0 * math.pi * math.sin(angle) / way**2

    alpha = absorption(750e3, temperature=10.0, salinity=35.0, depth=50.0)
    exact = strength * quad(ring, 0.0, math.asin(radius / r))[0]
    # sound is absorbed on the way to the visible side, 2 R / 3 before the centre in the mean
    absorbed = 2.0 * alpha * (r - 0.67 * radius)
    assert level == pytest.approx(190.0 + 10.0 * math.log10(exact) - absorbed, abs=0.05)
    far = 10.0 * math.log10(2.0 * math.pi * radius**2 * strength / 3.0)
    # to first order in R / r the nearer front outweighs the hidden limb by 3 R / 8
    spread = 40.0 * math.log10(r - 0.375 * radius)
    assert level == pytest.approx(190.0 - spread + far - absorbed, abs=0.05)


def test_the_level_of_a_plane_is_that_of_the_sonar_equation() -> None:
    """S - 2 (20 lg h + a h) + 10 lg(m A), A = h^2 times the equivalent widths of the patterns."""
    h, width = 10.0, 0.05
    sonar = SensorSonar(
        **{"beams": 201, "sector": 1.0, "beam_width": width, "vertical_width": width},
        **{"nearest": 8.0, "farthest": 14.0, "pulse": 1.0, "rays": 64},
    )
    level = 190.0 + 10.0 * math.log10(sonar.echo(felt(wall=wall(h)))[100].max())
    # integrals of sinc^2 and sinc^4 over u are 1 and 2 / 3
    unit = 0.5 * width / HALF_POWER
    area = h * h * unit * (2.0 / 3.0 * unit)
    alpha = absorption(750e3, temperature=10.0, salinity=35.0, depth=50.0)
    loss = 2.0 * (20.0 * math.log10(h) + alpha * h)
    expected = 190.0 - loss - 15.0 + 10.0 * math.log10(area)
    # two per cent of sinc^2 lie in side lobes whose echoes come later than the pulse
    assert level == pytest.approx(expected, abs=0.15)


def test_speckle_is_rayleigh_distributed() -> None:
    """Amplitudes over noise: deviation over mean sqrt(4 / pi - 1), mean square the noise."""
    sonar = SensorSonar(noise=80.0)
    level = sonar.ping(felt(), np.random.default_rng(3))
    amplitude = 10.0 ** (level / 20.0)
    # 65,536 samples: the ratio has a standard error of 0.3 %
    assert amplitude.std() / amplitude.mean() == pytest.approx(
        math.sqrt(4.0 / math.pi - 1.0), rel=0.01
    )
    assert np.mean(amplitude**2) == pytest.approx(1e8, rel=0.02)


def test_bins_hold_the_energy_of_every_cell() -> None:
    """The sum over the bins is the power times pulse over bin, whatever the extent."""
    rng = np.random.default_rng(0)
    way, extent, power = rng.uniform(3.0, 7.0, 40), rng.uniform(0.0, 4.0, 40), rng.uniform(0, 1, 40)
    found = Echoes(way, extent, power).over_range(4, 64, nearest=0.0, size=0.16, pulse=0.3)
    np.testing.assert_allclose(found.sum(axis=1), power.reshape(10, 4).sum(axis=0) * 0.3 / 0.16)


def test_echoes_by_way_of_the_surface() -> None:
    """A ball 3 m deep: ghosts at (l + d) / 2 and at l, the length by the image, only when asked."""
    depth, x, radius = 3.0, 8.0, 0.05
    way, image = x - radius, math.hypot(x, 2.0 * depth) - radius
    here = felt(depth, ball=ball(radius, x, 0.0, -depth))
    tuning: dict[str, Any] = {"beams": 65, "sector": 0.2, "bins": 600, "farthest": 12.2}
    tuning |= {"vertical_width": 1.5, "rays": 1000, "surface": -80.0, "nearest": 0.2}
    echo = {m: SensorSonar(multipath=m, **tuning).echo(here)[32] for m in (False, True)}
    rows = [int((r - 0.2) / 0.02) for r in (way, 0.5 * (way + image), image)]
    near = [slice(k - 3, k + 4) for k in rows]
    assert all(echo[True][k].max() > 20.0 * np.median(echo[True]) for k in near)
    direct, mixed, twice = (echo[True][k].sum() for k in near)
    assert direct > mixed > twice > 0.0
    np.testing.assert_allclose(echo[False][near[0]], echo[True][near[0]], rtol=1e-4)
    assert all(echo[False][k].max() < 0.01 * echo[True][k].max() for k in near[1:])


def test_in_waves_the_surface_is_that_above_the_sensor() -> None:
    """A crest of 0.3 m above a sensor 2 m below the mean level: the surface echo is at 2.3 m."""
    wave = WaveAiry(amplitude=0.3, period=4.0)
    around = Surroundings(EnvironmentSettings(water_level=0.0, **SALT), wave)
    times = np.linspace(0.0, 4.0, 401)
    here = np.array([0.0, 0.0, -2.0])
    crest = max(times, key=lambda t: around.surface(t, here[None])[0])
    turn = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    instant = SensorInput(crest, 0.004, here, turn, ZERO, ZERO, ZERO, ZERO, around=around)
    sonar = SensorSonar(beams=9, sector=0.2, bins=400, farthest=4.2, speckle=False)
    echo = sonar.echo(instant)[4]
    assert 0.2 + (np.argmax(echo) + 0.5) * 0.01 == pytest.approx(2.3, abs=0.015)
