"""Water surfaces for light: slopes, waves of plug-ins, grids; and sRGB."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seals.plugins.waves.airy import WaveAiry
from seals.plugins.waves.still import WaveStill
from seals.rendering.optics import (
    Surface,
    SurfaceAiry,
    SurfaceGrid,
    SurfaceSmooth,
    SurfaceStill,
    SurfaceSum,
    SurfaceWaves,
    from_bytes,
    ripples,
    to_bytes,
    to_linear,
    to_srgb,
)

X, Y = (np.random.default_rng(k).uniform(-4.0, 4.0, (2, 5, 6)) for k in (1, 2))
SWELL = SurfaceAiry([0.1, 0.02], [[2.0, 0.5], [-3.0, 6.0]], [4.5, 8.1], [0.2, 1.0], level=0.7)


@pytest.mark.parametrize(
    "surface",
    [SurfaceStill(level=0.3), SWELL, SurfaceSum(SWELL, ripples(wind=1.0, seed=0))],
    ids=["still", "airy", "sum"],
)
def test_slopes_are_differences_of_heights(surface: Surface) -> None:
    """The slope along x and y is the limit of the height's differences, within its reach."""
    along, across = surface.slope(X, Y, 1.3)
    step = 1e-5
    for found, dx, dy in ((along, step, 0.0), (across, 0.0, step)):
        high, low = (surface.height(X + s * dx, Y + s * dy, 1.3) for s in (1.0, -1.0))
        np.testing.assert_allclose(found, (high - low) / (2.0 * step), atol=1e-6)
    assert np.all(np.abs(surface.height(X, Y, 1.3) - surface.level) <= surface.reach + 1e-12)
    assert isinstance(surface, Surface)


def test_a_smoothed_slope_is_the_mean_over_a_gaussian() -> None:
    """Seen from afar the slope is averaged: here against an average over many places."""
    assert isinstance(SWELL, SurfaceSmooth)
    rng, width = np.random.default_rng(5), 0.15
    around = rng.normal(scale=width, size=(2, 200_000))
    along, across = SWELL.slope(0.4 + around[0], -0.7 + around[1], 0.0)
    place = (np.array([0.4]), np.array([-0.7]))
    found = SWELL.slope_over(*place, 0.0, np.array([width]))
    np.testing.assert_allclose(np.concatenate(found), [along.mean(), across.mean()], atol=1e-3)


def test_a_surface_of_a_wave_plug_in() -> None:
    """The airy plug-in's surface is the wave written out; still water is still."""
    wave = WaveAiry(amplitude=0.05, period=2.0, direction=0.6, phase=0.3)
    found = SurfaceWaves(wave, level=-0.2, reach=0.05)
    k, omega = (2.0 * math.pi / 2.0) ** 2 / 9.81, math.pi
    theta = k * (X * math.cos(0.6) + Y * math.sin(0.6)) - omega * 3.1 + 0.3
    np.testing.assert_allclose(found.height(X, Y, 3.1), -0.2 + 0.05 * np.cos(theta), atol=1e-12)
    along, across = found.slope(X, Y, 3.1)
    rise = -0.05 * k * np.sin(theta)
    np.testing.assert_allclose(along, rise * math.cos(0.6), atol=1e-12)
    np.testing.assert_allclose(across, rise * math.sin(0.6), atol=1e-12)
    still = SurfaceWaves(WaveStill(), level=0.4, reach=0.0)
    np.testing.assert_array_equal(still.height(X, Y, 0.0), np.full(X.shape, 0.4))
    assert not np.any(still.slope(X, Y, 0.0)[0])


def test_times_of_its_own_for_every_view() -> None:
    """An array of times gives each view the surface of its instant, also days later."""
    times = np.array([0.2, 86400.5])[:, None, None]
    for surface in (SWELL, SurfaceWaves(WaveAiry(amplitude=0.02), level=0.0, reach=0.02)):
        both = surface.height(X, Y, times)
        for n in range(2):
            alone = surface.height(X[n], Y[n], float(times[n, 0, 0]))
            np.testing.assert_allclose(both[n], alone, atol=1e-9)
    exact = SWELL.height(X, Y, 86400.5)
    single = SWELL.height(X.astype(np.float32), Y.astype(np.float32), 86400.5)
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, exact, atol=1e-5)


def test_a_grid_is_linear_between_its_cells() -> None:
    """Heights on a plane come back exactly inside, the edge's beyond it."""
    east, north = np.meshgrid(np.arange(8) * 0.5 + 0.25, np.arange(6) * 0.25 + 0.125, indexing="ij")
    grid = SurfaceGrid(1.0 + 0.2 * east - 0.1 * north, (0.0, 0.0), (0.5, 0.25))
    x, y = np.array([0.3, 2.0, 3.7]), np.array([0.2, 0.7, 1.3])
    np.testing.assert_allclose(grid.height(x, y, 0.0), 1.0 + 0.2 * x - 0.1 * y)
    np.testing.assert_allclose(grid.slope(x, y, 0.0), [[0.2] * 3, [-0.1] * 3])
    beyond = grid.height(np.array([-9.0]), np.array([0.125]), 0.0)
    np.testing.assert_allclose(beyond, 1.0 + 0.2 * 0.25 - 0.1 * 0.125)


def test_srgb_there_and_back() -> None:
    """Encoding and decoding undo each other; the standard's points are met."""
    light = np.linspace(0.0, 1.0, 2001)
    np.testing.assert_allclose(to_linear(to_srgb(light)), light, atol=1e-6)
    # IEC 61966-2-1: middle grey of 18 % is 0.4613..., the straight part has slope 12.92
    np.testing.assert_allclose(to_srgb(np.array([0.18, 0.002])), [0.461356, 0.02584], atol=1e-6)


def test_bytes_are_the_nearest_levels() -> None:
    """All 256 levels come back as themselves, and light is rounded to the nearest level."""
    levels = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(to_bytes(from_bytes(levels)), levels)
    light = np.random.default_rng(4).uniform(-0.1, 1.2, (50, 40)).astype(np.float32)
    exact = 255.0 * to_srgb(light.astype(float))
    assert np.abs(to_bytes(light) - exact).max() < 0.6


def test_bytes_by_torch() -> None:
    """Torch gives the same levels and the same light."""
    torch = pytest.importorskip("torch")
    light = np.random.default_rng(4).uniform(0.0, 1.0, (30, 20)).astype(np.float32)
    found = to_bytes(torch.from_numpy(light))
    np.testing.assert_array_equal(found.numpy(), to_bytes(light))
    np.testing.assert_allclose(from_bytes(found).numpy(), from_bytes(to_bytes(light)), rtol=1e-5)
