"""What a camera sees through water and its surface."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.errors import ConfigError
from seals.plugins.waves.airy import WaveAiry
from seals.plugins.waves.still import WaveStill
from seals.rendering.optics import (
    WATERS,
    Optics,
    Sight,
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
from seals.rendering.optics.chain import blurred, pixel_angle
from seals.rendering.optics.optics import noisy, standard_normal
from seals.schema import check_tree, parameters_of

Pixels = NDArray[Any]
SEA = SurfaceSum(SurfaceAiry([0.05], [[2.0, 1.0]], [4.7], [0.2]), ripples(wind=2.0, seed=4))


def view(count: int, kind: type = np.float32, *, rise: float = -0.3) -> Sight:
    """Return views of a random scene from several depths, some dry, some half in the water."""
    rng = np.random.default_rng(11)
    across, down = np.meshgrid(np.linspace(-0.6, 0.6, 24), np.linspace(0.5, -0.5, 20))
    line = np.stack([np.ones_like(across), -across, down + rise], axis=-1)
    line = line / np.linalg.norm(line, axis=-1, keepdims=True)
    heights = np.linspace(0.4, -4.0, count)
    place = np.column_stack([rng.uniform(-3.0, 3.0, (count, 2)), heights])
    shape = (count, 20, 24)
    ranges = rng.uniform(0.5, 12.0, shape)
    ranges[rng.uniform(size=shape) < 0.2] = np.inf
    normals = rng.normal(size=(*shape, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    parts = (rng.uniform(size=(*shape, 3)), ranges, place, np.tile(line, (count, 1, 1, 1)), normals)
    return Sight(*(part.astype(kind) for part in parts))


@pytest.mark.parametrize("surface", [SurfaceStill(), SEA], ids=["still", "sea"])
def test_a_batch_is_its_views_one_by_one(surface: Surface) -> None:
    """Views looked at together give what each gives alone, also in parts and with own times."""
    views, times = view(9, np.float64), np.linspace(0.0, 2.0, 9)
    optics = Optics(water_type="coastal_1", noise=False)
    together = optics.look(views, surface, times, None)
    for n in range(9):
        one = Sight(*(part[n : n + 1] for part in views if part is not None))
        alone = optics.look(one, surface, float(times[n]), None)
        np.testing.assert_allclose(together[n], alone[0], rtol=1e-9, atol=1e-9)


def test_large_batches_are_taken_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Taking a few views at a time changes nothing."""
    views, optics = view(7), Optics(water_type="oceanic_3", noise=False)
    whole = optics.look(views, SEA, 0.5, None)
    monkeypatch.setattr("seals.rendering.optics.chain.AT_ONCE", 20 * 24 * 3)
    np.testing.assert_array_equal(optics.look(views, SEA, 0.5, None), whole)


@pytest.mark.parametrize(("kind", "close"), [(np.float32, 2e-5), (np.float64, 1e-9)])
@pytest.mark.parametrize("surface", [SurfaceStill(), SEA], ids=["still", "sea"])
def test_numpy_and_torch_agree(kind: type, close: float, surface: Surface) -> None:
    """Both libraries give the same image, noise included; single precision to 2e-5."""
    torch = pytest.importorskip("torch")
    views, optics = view(4, kind), Optics(water_type="coastal_3")
    other = Sight(*(torch.from_numpy(part) for part in views if part is not None))
    one = optics.look(views, surface, 0.7, np.random.default_rng(3))
    two = optics.look(other, surface, 0.7, np.random.default_rng(3))
    assert two.dtype == (torch.float32 if kind is np.float32 else torch.float64)
    apart = np.abs(two.numpy() - one)
    # a line of sight that grazes a wave may fall on either side of it by rounding
    assert np.mean(apart > close) < (2e-3 if surface is SEA and kind is np.float32 else 1e-9)
    assert np.median(apart) < 1e-6


def test_torch_draws_from_its_own_generator() -> None:
    """A torch generator gives the same image again from the same seed, and times of every view."""
    torch = pytest.importorskip("torch")
    views, optics = view(2), Optics(water_type="oceanic_2")
    other = Sight(*(torch.from_numpy(part) for part in views if part is not None))
    times = torch.tensor([0.3, 0.9], dtype=torch.float64)
    one, two = (optics.look(other, SEA, times, torch.Generator().manual_seed(4)) for _ in range(2))
    assert torch.equal(one, two)
    clean = dataclasses.replace(optics, noise=False).look(other, SEA, times, None)
    assert 1e-4 < float((one - clean).abs().mean()) < 1e-2


def test_the_type_of_the_colour_is_kept() -> None:
    """Single precision in, single precision out, though ranges and places are double."""
    mixed = view(2)._replace(ranges=view(2, np.float64).ranges, origins=view(2, np.float64).origins)
    seen = Optics(water_type="coastal_1").look(mixed, SEA, 0.0, np.random.default_rng(0))
    assert seen.dtype == np.float32
    assert seen.shape == (2, 20, 24, 3)
    assert np.all(np.isfinite(seen))
    assert np.all(seen >= 0.0)


def test_the_same_seed_gives_the_same_image() -> None:
    """One seed, one image, bit for bit; another seed, other noise."""
    views, optics = view(3), Optics(water_type="oceanic_2")
    one, two, other = (
        optics.look(views, SEA, 1.0, np.random.default_rng(seed)) for seed in (5, 5, 6)
    )
    assert np.array_equal(one, two)
    assert 1e-4 < np.abs(one - other).mean() < 1e-2


def test_noise_has_the_stated_variance() -> None:
    """read^2 + shot light, mean unchanged, in the dark and in the light."""
    rng = np.random.default_rng(9)
    for light in (0.2, 0.8):
        seen = noisy(np.full((400, 400), light, np.float32), rng, read=0.01, shot=1e-3)
        assert seen.mean() == pytest.approx(light, abs=4e-4)
        assert seen.var() == pytest.approx(1e-4 + 1e-3 * light, rel=0.02)
    normal = standard_normal(np.zeros((400, 400)), rng)
    assert np.mean(normal**4) == pytest.approx(3.0, rel=0.04)


def test_noise_without_a_random_state_is_refused() -> None:
    """Noise is never drawn from a hidden state."""
    with pytest.raises(ConfigError, match=r"no random state.*\n.*numpy.random.Generator"):
        Optics().look(view(1), SurfaceStill(), 0.0, None)


def test_the_blur_spreads_light_and_keeps_it() -> None:
    """A point's light stays, and its variance is b z t^2 / 6 of what small angles can hold."""
    size, pixel, angle, scattering, length = 96, 0.01, 0.06, 0.5, 4.0
    lengths, variance = np.full((1, size, size), length), []
    # blocks of three and six pixels are averaged on the way: points at all places in them
    for place in range(45, 51):
        planes = np.zeros((3, 1, size, size))
        planes[:, 0, place, 40] = 1.0
        seen = blurred(planes, lengths, scattering, angle, pixel)[0, 0]
        assert seen.sum() == pytest.approx(1.0, abs=0.005)
        # what was never turned stays where it was; the rest is 2.45 pixels wide or wider
        straight, thin = math.exp(-scattering * length), 1.0 / (2.0 * math.pi * 6.0)
        assert straight < seen[place, 40] < straight + (1.0 - straight) * thin
        variance.append((seen.sum(axis=1) * (np.arange(size) - place) ** 2).sum() * pixel**2)
    assert np.mean(variance) == pytest.approx(scattering * length * angle**2 / 6.0, rel=0.03)
    flat = blurred(np.ones_like(planes), lengths, scattering, angle, pixel)
    np.testing.assert_allclose(flat, 1.0, rtol=1e-6)


def test_the_blur_grows_with_distance() -> None:
    """An edge far away is softer than one near by, and without water there is none."""
    edge = np.zeros((3, 1, 40, 60)) + (np.arange(60) > 29)
    soft = [
        np.abs(np.diff(blurred(edge, np.full((1, 40, 60), z), 0.5, 0.06, 0.01)[0, 0, 20])).max()
        for z in (0.0, 0.5, 2.0, 8.0)
    ]
    assert soft[0] > 0.999
    assert np.all(np.diff(soft) < -0.05)


def test_pixels_of_odd_and_tiny_pictures() -> None:
    """Sizes that no block fits, down to a single pixel, go through the whole chain."""
    for rows, columns in ((1, 1), (3, 2), (37, 53)):
        line = np.zeros((2, rows, columns, 3), np.float32)
        line[..., 0] = 1.0
        line[..., 1] = np.linspace(-0.2, 0.2, columns)
        line /= np.linalg.norm(line, axis=-1, keepdims=True)
        ranges = np.full((2, rows, columns), 3.0, np.float32)
        some = Sight(np.ones_like(line), ranges, np.array([[0, 0, -1.0], [0, 0, 0.0]]), line)
        seen = Optics(water_type="coastal_5").look(some, SEA, 0.0, np.random.default_rng(0))
        assert seen.shape == line.shape
        assert np.all(np.isfinite(seen))


def test_the_angle_of_a_pixel() -> None:
    """The middle pixels of a pinhole camera are 2 tan(fov / 2) / columns apart."""
    half, columns = math.tan(0.6), 128
    across = (np.arange(columns) + 0.5 - 64.0) * 2.0 * half / columns
    line = np.stack([np.ones(columns), -across, np.zeros(columns)], axis=-1)
    line /= np.linalg.norm(line, axis=-1, keepdims=True)
    found = pixel_angle(np.broadcast_to(line, (1, 3, columns, 3)).astype(np.float32))
    assert found == pytest.approx(2.0 * half / columns, rel=1e-3)


def test_caustics_light_only_what_is_under_water_and_faces_up() -> None:
    """Faces turned from the sun, and things in the air, are lit as under still water."""
    views = view(3)
    down = views._replace(normals=np.broadcast_to((0.0, 0.0, -1.0), views.colour.shape))
    up = views._replace(normals=np.broadcast_to((0.0, 0.0, 1.0), views.colour.shape))
    plain, whole = (
        Optics(water_type="oceanic_1", noise=False, blur=False, caustics=c) for c in (False, True)
    )
    np.testing.assert_array_equal(
        whole.look(down, SEA, 0.0, None), plain.look(down, SEA, 0.0, None)
    )
    gap = np.abs(whole.look(up, SEA, 0.0, None) - plain.look(up, SEA, 0.0, None))
    assert gap[2].max() > 0.05
    dry = (views.ranges * views.directions[..., 2] + views.origins[:, 2, None, None]) > 0.2
    assert np.all(gap[dry & np.isfinite(views.ranges)] < 1e-6)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"water_type": "costal_5"}, r"water_type=costal_5.*\nDid you mean 'coastal_5'"),
        ({"water_type": "murky"}, r"Allowed: coastal_1,.*none"),
        ({"absorption": [0.1, 0.2]}, r"absorption=.*2 numbers.*\n.*red, green and blue"),
        ({"diffuse": [0.1, -0.2, 0.3]}, r"diffuse\[1\]=-0.2.*\nAllowed.*0 to 20 1/m"),
        ({"sun_zenith": 1.6}, r"sun_zenith=1.6.*\nAllowed.*0 to 1.4 rad"),
        ({"exposure": math.nan}, r"exposure=nan.*\nAllowed"),
        ({"cells": 4}, r"cells=4.*\nAllowed: a whole number from 8 to 1024"),
        ({"rays": 0}, r"rays=0.*\nAllowed: a whole number from 1 to 8"),
        ({"sky_zenith": [1.0]}, r"sky_zenith=.*\nAllowed: 3 numbers"),
    ],
)
def test_refusals(options: dict[str, Any], words: str) -> None:
    """What was given, what is allowed, and the nearest name."""
    with pytest.raises(ConfigError, match=words):
        Optics(**options)


def test_own_coefficients_take_the_place_of_the_types() -> None:
    """Given coefficients replace those of the water type, the others stay."""
    water = Optics(water_type="coastal_3", absorption=[0.5, 0.2, 0.1]).water
    assert water is not None
    assert water.absorption == [0.5, 0.2, 0.1]
    assert water.scattering == WATERS["coastal_3"].scattering


@pytest.mark.parametrize("name", WATERS)
def test_waters_are_possible(name: str) -> None:
    """Light falls with depth at least as fast as absorption and backscattering take it."""
    medium = Optics(water_type=name).medium
    assert medium is not None
    for absorbed, falls in zip(WATERS[name].absorption, medium.diffuse, strict=True):
        assert falls > absorbed
    # molecules scatter back evenly: K_d falls short of a + b_b by a few per cent at the most
    for veiling, falls in zip(medium.veiling, medium.diffuse, strict=True):
        assert falls > 0.95 * veiling


def test_waters_stand_in_order() -> None:
    """From type I to 9C every water is murkier than the one before, at green and blue."""
    mediums = [Optics(water_type=name).medium for name in WATERS]
    for colour in (1, 2):
        for kind in ("direct", "diffuse"):
            values = [getattr(medium, kind)[colour] for medium in mediums]
            assert values == sorted(values)


def test_every_number_has_unit_bounds_and_source() -> None:
    """Physical fields carry their metadata, and the defaults are within their bounds."""
    named = parameters_of(Optics)
    numbers = {f.name for f in dataclasses.fields(Optics) if f.type in ("float", "list[float]")}
    assert numbers == set(named)
    assert all(meta.source and meta.unit for meta in named.values())
    check_tree(Optics(), where="optics")


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
