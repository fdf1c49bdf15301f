"""Caustics: light is kept, gathers where lens theory says, and rides the wave."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.rendering.optics import SurfaceAiry, ripples
from seals.rendering.optics.caustics import Patch, Sun, looked_up, pattern

Floats = NDArray[np.float64]
N = 1.333
OVERHEAD = Sun(0.0, 0.0)


def patch(half: float, depths: tuple[float, float], x: float = 0.0, y: float = 0.0) -> Patch:
    """Return one square patch."""
    place = (np.array([value]) for value in (x, y, half))
    return Patch(*place, np.array([depths]))


def wave(amplitude: float, length: float, omega: float = 0.0) -> SurfaceAiry:
    """Return a wave that runs along x, its crest over the origin at time zero."""
    return SurfaceAiry([amplitude], [[2.0 * math.pi / length, 0.0]], [omega], [0.0])


@pytest.mark.parametrize("zenith", [0.0, 0.6, 1.1])
@pytest.mark.parametrize("depth", [0.5, 2.0, 6.0])
def test_light_is_neither_lost_nor_made(zenith: float, depth: float) -> None:
    """Over whole wave lengths the pattern's mean is one, before the focus and past it."""
    crossed = SurfaceAiry(
        [0.01, 0.008], [[2.0 * math.pi, 0.0], [0.0, 4.0 * math.pi]], [0.0, 0.0], [0.3, 1.0]
    )
    square = patch(3.0, (depth, 1.3 * depth))
    found = pattern(square, crossed, 0.0, Sun(zenith, 0.4), cells=192)[0]
    # 192 cells on 6 m: whole wave lengths of 1 m, away from the edges
    inner = found[:, 32:160, 32:160]
    np.testing.assert_allclose(inner.mean(axis=(1, 2)), 1.0, atol=0.005)
    assert inner.std() > 0.05


def test_still_water_has_no_pattern() -> None:
    """Under a level surface the light is one everywhere."""
    found = pattern(patch(2.0, (1.0, 3.0)), wave(0.0, 1.0), 0.0, Sun(0.7, 2.0), cells=64)
    np.testing.assert_allclose(found[..., 4:-4, 4:-4], 1.0, atol=2e-3)


@pytest.mark.parametrize(("amplitude", "length"), [(0.01, 1.0), (0.004, 0.6), (0.03, 2.0)])
def test_a_sinusoid_focuses_at_the_depth_of_lens_theory(amplitude: float, length: float) -> None:
    """Under a crest light is brightest at f = n / ((n - 1) a k^2), within 7 %."""
    k = 2.0 * math.pi / length
    focus = N / ((N - 1.0) * amplitude * k * k)
    ratios = np.arange(0.5, 1.5, 0.025)
    square = 0.25 * length
    cells = 256
    # light under the crest, in a strip of 1 / 256 of the wave length about it
    strip = slice(cells // 2 - 1, cells // 2 + 1)
    light = [
        pattern(
            patch(square, (r * focus, r * focus)),
            wave(amplitude, length),
            0.0,
            OVERHEAD,
            cells=cells,
        )[0, 0, strip, cells // 4 : 3 * cells // 4].mean()
        for r in ratios
    ]
    best = ratios[int(np.argmax(light))]
    assert best == pytest.approx(1.0, abs=0.07)
    # before the focus a lens of that power: 1 / (1 - d / f)
    early = int(np.argmin(np.abs(ratios - 0.5)))
    assert light[early] == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize("depth", [0.4, 1.2, 3.0])
@pytest.mark.parametrize("zenith", [0.0, 0.7])
@pytest.mark.parametrize(("rays", "close"), [(1, 0.16), (2, 0.03), (4, 0.01)])
def test_the_pattern_is_that_of_a_million_rays(
    depth: float, zenith: float, rays: int, close: float
) -> None:
    """Rays refracted one by one and counted give the same light, the closer the denser its own."""
    sea, half, cells = wave(0.012, 0.8), 1.2, 96
    square, sun = patch(half, (depth, depth)), Sun(zenith, 0.0)
    found = pattern(square, sea, 0.0, sun, cells=cells, rays=rays)[0, 0]
    rng = np.random.default_rng(8)
    x = (np.arange(1_000_000) + rng.uniform(size=1_000_000)) * 8e-6 - 4.0
    k = 2.0 * math.pi / 0.8
    slope = -0.012 * k * np.sin(k * x)
    # plane trigonometry: angle of the ray from the vertical, before and behind the surface
    tilt = np.arctan(slope)
    run = tilt - np.arcsin(np.sin(zenith + tilt) / N)
    share = np.cos(zenith + tilt) / (np.cos(tilt) * math.cos(zenith))
    place = x + depth * np.tan(run)
    fine, cell = 10, 2.0 * half / cells
    counts, _ = np.histogram(place, cells * fine, range=(-half, half), weights=share)
    # each ray is shared between the two middles about it: a triangle two cells wide
    triangle = 1.0 - np.abs(np.arange(-fine, fine + 1)) / fine
    spread = np.convolve(counts, triangle, "same") * 8e-6 / cell
    expected = 0.5 * (spread[fine // 2 :: fine] + spread[fine // 2 - 1 :: fine])
    inner = slice(12, -12)
    one, two = found[inner, cells // 2], expected[inner]
    assert np.abs(one - two).mean() < close


def test_the_pattern_rides_on_the_wave() -> None:
    """After a time t the pattern of a wave stands c t farther on."""
    omega, length = 7.85, 1.0
    speed = omega * length / (2.0 * math.pi)
    sea = wave(0.01, length, omega)
    first = pattern(patch(1.0, (1.0, 1.0)), sea, 0.0, OVERHEAD, cells=64)
    later = pattern(patch(1.0, (1.0, 1.0), x=0.1 * speed), sea, 0.1, OVERHEAD, cells=64)
    np.testing.assert_allclose(later, first, atol=5e-3)
    same = pattern(patch(1.0, (1.0, 1.0)), sea, 0.4, OVERHEAD, cells=64)
    assert np.abs(same - first).mean() > 0.1


def test_looking_a_pattern_up() -> None:
    """Between cells the light is linear, between depths too, beside the patch it is one."""
    maps = np.zeros((1, 2, 32, 32))
    maps[0, 0] += np.arange(32)[:, None]
    maps[0, 1] += 10.0 + np.arange(32)[None, :]
    # edge of 3.2 m: cell i has its middle at (i + 0.5) / 10 - 1.6
    x = np.array([[[0.0, 0.15, 0.0, 5.0]]])
    y = np.array([[[0.0, 0.0, 0.25, 0.0]]])
    depth = np.array([[[1.0, 1.0, 3.0, 2.0]]])
    found = looked_up(maps, patch(1.6, (1.0, 3.0)), x, y, depth)
    np.testing.assert_allclose(found, [[[15.5, 17.0, 28.0, 1.0]]], atol=1e-6)


def test_ripples_have_the_slope_of_cox_and_munk() -> None:
    """The mean square slope of ripples in a wind of 5 m/s is 0.0286, over many places and times."""
    sea, rng = ripples(wind=5.0, seed=2), np.random.default_rng(0)
    x, y = rng.uniform(-500.0, 500.0, (2, 400_000))
    along, across = sea.slope(x, y, 3.0)
    assert np.mean(along**2 + across**2) == pytest.approx(0.003 + 0.00512 * 5.0, rel=0.02)
