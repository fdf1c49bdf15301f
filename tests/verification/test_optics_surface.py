"""The water surface: Fresnel, Snell's window, where lines of sight are cut, the split view."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from seals.rendering.optics import Optics, Sight, SurfaceAiry, SurfaceStill
from seals.rendering.optics.chain import crossing
from seals.rendering.optics.path import fresnel

Floats = NDArray[np.float64]
N = 1.333
PLAIN = {"blur": False, "caustics": False, "noise": False}


def fan(angles: Floats) -> Floats:
    """Return lines of sight at angles from straight up, shape (1, 1, n, 3)."""
    return np.stack([np.sin(angles), 0.0 * angles, np.cos(angles)], axis=-1)[None, None]


def look(
    optics: Optics, height: float, line: Floats, ranges: Floats, colour: Floats, level: float = 0.0
) -> Floats:
    """Return the image of lines that meet at a height above the origin, shape (n, 3)."""
    shape = line.shape[:3]
    full = np.broadcast_to(colour, (*shape, 3)).astype(float)
    view = Sight(full, np.broadcast_to(ranges, shape) * 1.0, np.array([[0.0, 0.0, height]]), line)
    return optics.look(view, SurfaceStill(level=level), 0.0, None)[0, 0]


@pytest.mark.parametrize("ratio", [N, 1.0 / N])
def test_fresnel_by_sines_and_tangents(ratio: float) -> None:
    """R = (sin^2(i - t) / sin^2(i + t) + tan^2(i - t) / tan^2(i + t)) / 2."""
    angle = np.linspace(0.01, math.asin(min(1.0 / ratio, 1.0)) - 0.01, 50)
    turned = np.arcsin(ratio * np.sin(angle))
    gap, sum_ = angle - turned, angle + turned
    expected = 0.5 * (np.sin(gap) / np.sin(sum_)) ** 2 + 0.5 * (np.tan(gap) / np.tan(sum_)) ** 2
    np.testing.assert_allclose(fresnel(np.cos(angle), ratio), expected, rtol=1e-10)


def test_fresnel_at_marked_angles() -> None:
    """Straight on ((n - 1) / (n + 1))^2; half the s-light at Brewster's angle; all when grazing."""
    straight = ((N - 1.0) / (N + 1.0)) ** 2
    np.testing.assert_allclose(fresnel(np.array([1.0]), N), straight, rtol=1e-12)
    np.testing.assert_allclose(fresnel(np.array([1.0]), 1.0 / N), straight, rtol=1e-12)
    brewster = math.atan(N)
    across = math.sin(2.0 * brewster - 0.5 * math.pi) ** 2
    found = fresnel(np.array([math.cos(brewster)]), 1.0 / N)
    np.testing.assert_allclose(found, 0.5 * across, rtol=1e-9)
    assert fresnel(np.array([0.0]), 1.0 / N)[0] == pytest.approx(1.0)
    # both ways through the same surface: the same share is reflected
    inside = math.asin(math.sin(1.0) / N)
    ways = fresnel(np.cos(np.array([1.0])), 1.0 / N), fresnel(np.cos(np.array([inside])), N)
    np.testing.assert_allclose(*ways, rtol=1e-12)


def test_snells_window() -> None:
    """From below the sky shows within 48.6 degrees of straight up, and nowhere else."""
    angles = np.radians(np.linspace(0.0, 89.0, 8901))
    dark = {"sky_zenith": [0.0] * 3, "sky_horizon": [0.0] * 3}
    seen = [
        look(Optics(water_type="oceanic_1", **PLAIN, **more), -2.0, fan(angles), np.inf, 0.0)
        for more in ({"sky_zenith": [1.0] * 3, "sky_horizon": [1.0] * 3}, dark)
    ]
    sky = (seen[0] - seen[1])[:, 1]
    edge = np.degrees(angles[np.argmax(sky <= 0.0)])
    assert edge == pytest.approx(48.6, abs=0.05)
    assert np.all(sky[angles > np.radians(edge)] == 0.0)
    # straight up: the n^2 law, what is not reflected, and two metres of water (a + b / 4)
    loss = math.exp(-2.0 * (0.046 + 0.25 * 2.05e-3))
    through = N**2 * (1.0 - ((N - 1.0) / (N + 1.0)) ** 2) * loss
    assert sky[0] == pytest.approx(through, rel=1e-4)


def test_from_above_the_surface_mirrors_the_sky() -> None:
    """A black floor in black water shows the sky times Fresnel's share, whatever its depth."""
    angles = np.radians(180.0 - np.array([0.0, 30.0, 60.0, 80.0]))
    optics = Optics(
        water_type="oceanic_1",
        absorption=[5.0] * 3,
        scattering=[0.0] * 3,
        sky_zenith=[0.4] * 3,
        sky_horizon=[0.4] * 3,
        **PLAIN,
    )
    seen = look(optics, 3.0, fan(angles), 80.0, 0.0)
    i = math.pi - angles[1:]
    t = np.arcsin(np.sin(i) / N)
    share = 0.5 * ((np.sin(i - t) / np.sin(i + t)) ** 2 + (np.tan(i - t) / np.tan(i + t)) ** 2)
    np.testing.assert_allclose(seen[1:, 1], 0.4 * share, rtol=1e-6)
    np.testing.assert_allclose(seen[0, 1], 0.4 * ((N - 1.0) / (N + 1.0)) ** 2, rtol=1e-6)


def test_only_the_wet_part_of_a_line_attenuates() -> None:
    """From 1 m above the water a floor 2 m below it fades as 2 m of water, seen straight down."""
    optics = Optics(water_type="coastal_1", **PLAIN)
    down = fan(np.array([math.pi]))
    white, black = (look(optics, 1.0, down, 3.0, c)[0] for c in (1.0, 0.0))
    a, b = np.array((0.248, 0.0972, 0.121)), np.array((0.416, 0.433, 0.447))
    k, straight = np.array((0.30, 0.13, 0.17)), ((N - 1.0) / (N + 1.0)) ** 2
    lit = np.exp(-2.0 * k - 2.0 * (a + 0.25 * b)) * (1.0 - straight) / N**2
    share = (white - black) / lit
    # the daylight's own loss at the surface, the same for all colours
    assert np.ptp(share) < 1e-6
    assert 0.93 < share[0] < 0.98


@pytest.mark.parametrize("surface", [True, False])
def test_dry_lines_keep_their_colour(surface: bool) -> None:
    """In a split view, what is seen through air alone is the renderer's picture."""
    angles = np.radians(np.linspace(20.0, 160.0, 141))
    ranges = np.where(np.arange(141) % 3 == 0, np.inf, 2.0)
    colour = np.random.default_rng(2).uniform(size=(1, 1, 141, 3))
    optics = Optics(water_type="coastal_5", surface=surface, port=0.05, **PLAIN)
    seen = look(optics, 0.01, fan(angles), ranges[None, None], colour)
    # a line leaves the dome of 5 cm above the water where it rises above -1 cm
    dry = (0.01 + 0.05 * np.cos(angles) > 0.0) & (0.01 + ranges * np.cos(angles) >= 0.0)
    assert 60 < dry.sum() < 100
    np.testing.assert_array_equal(seen[dry], colour[0, 0, dry])
    assert np.all(np.abs(seen[~dry] - colour[0, 0, ~dry]).max(axis=1) > 1e-3)


def test_the_waterline_lies_where_the_dome_meets_the_water() -> None:
    """Behind a dome of radius r, at height h above the water, lines below -h / r begin wet."""
    line = fan(np.radians(np.linspace(90.0, 179.0, 400)))
    found = crossing(
        np.array([[0.0, 0.0, 0.03]]),
        line,
        np.full((1, 1, 400), 50.0),
        SurfaceStill(),
        0.0,
        port=0.1,
    )
    np.testing.assert_array_equal(found.wet[0, 0], line[0, 0, :, 2] < -0.3)


def test_lines_meet_waves_where_a_root_finder_says() -> None:
    """The first crossing of steep lines with a wave of three parts, within 2 mm."""
    waves = SurfaceAiry(
        [0.05, 0.03, 0.02], [[2.0, 0.0], [1.0, 3.0], [-2.0, 4.0]], [4.4, 5.6, 6.6], [0.0, 1.0, 2.0]
    )
    rng = np.random.default_rng(3)
    line = rng.normal(size=(1, 20, 20, 3))
    line[..., 2] = np.where(np.abs(line[..., 2]) < 0.6, 0.6, line[..., 2])
    line /= np.linalg.norm(line, axis=-1, keepdims=True)
    for height in (-1.5, 1.2):
        place, ranges = np.array([[0.3, -0.2, height]]), np.full((1, 20, 20), 30.0)
        found = crossing(place, line, ranges, waves, 0.7, port=0.0)
        for ray, far, through in zip(
            line.reshape(-1, 3), found.distance.ravel(), found.through.ravel(), strict=True
        ):
            if ray[2] * height > 0.0:
                assert not through
                continue

            def over(s: float, ray: Floats = ray, eye: Floats = place[0]) -> float:
                x, y, z = eye + s * ray
                theta = (2.0 * x - 3.08, x + 3.0 * y - 2.92, -2.0 * x + 4.0 * y - 2.62)
                parts = zip((0.05, 0.03, 0.02), theta, strict=True)
                return float(z - sum(a * math.cos(t) for a, t in parts))

            assert through
            low, high = ((abs(height) + gap) / abs(ray[2]) for gap in (-0.11, 0.11))
            assert far == pytest.approx(brentq(over, low, high), abs=2e-3)


def test_a_moving_surface_moves_the_split() -> None:
    """A camera at the mean level is wet under a crest and dry over a trough."""
    wave = SurfaceAiry([0.2], [[1.0, 0.0]], [3.0], [0.0])
    line, ranges = fan(np.array([0.5 * math.pi])), np.full((1, 1, 1), 1.0)
    for time, wet in ((0.0, True), (math.pi / 3.0, False), (2.0 * math.pi / 3.0, True)):
        found = crossing(np.zeros((1, 3)), line, ranges, wave, time, port=0.0)
        assert bool(found.wet[0, 0, 0]) is wet
