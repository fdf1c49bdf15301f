"""Light in water by closed forms: caustics, the surface, absorption and scattering."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from seals.rendering.optics import (
    WATERS,
    Optics,
    Sight,
    SurfaceAiry,
    SurfaceStill,
    from_bytes,
    ripples,
    to_bytes,
)
from seals.rendering.optics.caustics import Patch, Sun, looked_up, pattern
from seals.rendering.optics.chain import crossing
from seals.rendering.optics.path import fresnel

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


Floats = NDArray[np.float64]

# a, b, K_d at 600, 525 and 475 nm, typed from the papers a second time
PUBLISHED = {
    "oceanic_1": ((0.228, 0.046, 0.019), (1.22e-3, 2.05e-3, 3.06e-3), (0.233, 0.049, 0.021)),
    "oceanic_3": ((0.241, 0.0821, 0.0941), (0.278, 0.292, 0.303), (0.295, 0.116, 0.116)),
    "coastal_1": ((0.248, 0.0972, 0.121), (0.416, 0.433, 0.447), (0.30, 0.13, 0.17)),
    "coastal_5": ((0.285, 0.174, 0.243), (1.16, 1.21, 1.25), (0.40, 0.31, 0.43)),
}
CHART = ((0.9, 0.9, 0.9), (0.7, 0.3, 0.1), (0.15, 0.5, 0.6), (0.0, 0.0, 0.0))
"""White, two colours, black."""
DISTANCES = (1.0, 3.0, 5.0, 10.0)
SMOOTH = {"caustics": False, "noise": False}


def level(count: int) -> NDArray[np.float32]:
    """Return level lines of sight about east, 1 degree apart, shape (1, 9, count, 3)."""
    angle = np.radians(np.arange(count) - 0.5 * count)
    line = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
    return np.broadcast_to(line, (1, 9, count, 3)).astype(np.float32)


def chart(optics: Optics, distance: float, depth: float) -> NDArray[np.float32]:
    """Return the light of the chart's patches, each filling a picture, shape (4, 3)."""
    line = np.repeat(level(9), len(CHART), axis=0)
    colour = np.zeros(line.shape, np.float32) + np.array(CHART, np.float32)[:, None, None]
    ranges = np.full(line.shape[:3], distance, np.float32)
    place = np.array([[0.0, 0.0, -depth]] * len(CHART), np.float32)
    seen = optics.look(Sight(colour, ranges, place, line), SurfaceStill(), 0.0, None)
    return seen[:, 4, 4]


def slope(x: Floats, y: Floats) -> float:
    """Return the slope of the line through points by least squares."""
    return float(np.polyfit(x, y, 1)[0])


@pytest.mark.parametrize("blur", [False, True])
@pytest.mark.parametrize("name", PUBLISHED)
def test_charts_give_the_attenuation_back(name: str, blur: bool) -> None:
    """White and coloured charts at 1, 3, 5 and 10 m: beta_D = a + b / 4 within 2 %."""
    a, b, _ = (np.array(row) for row in PUBLISHED[name])
    optics = Optics(water_type=name, blur=blur, **SMOOTH)
    seen = np.array([chart(optics, z, 2.0) for z in DISTANCES], float)
    direct = seen[:, :3] - seen[:, 3:]
    for patch in range(3):
        found = [-slope(np.array(DISTANCES), np.log(direct[:, patch, c])) for c in range(3)]
        np.testing.assert_allclose(found, a + 0.25 * b, rtol=0.02)


@pytest.mark.parametrize("name", PUBLISHED)
def test_charts_of_eight_bits_give_the_attenuation_back(name: str) -> None:
    """The same from pictures of 8 bits, where the signal is above 10 levels: within 10 %."""
    a, b, _ = (np.array(row) for row in PUBLISHED[name])
    optics = Optics(water_type=name, blur=False, **SMOOTH)
    levels = np.array([to_bytes(chart(optics, z, 0.5)) for z in DISTANCES])
    light, used = from_bytes(levels).astype(float), 0
    for patch, colour in np.ndindex(3, 3):
        signal = levels[:, patch, colour].astype(int) - levels[:, 3, colour]
        good = signal > 10
        if good.sum() >= 2:
            direct = light[good, patch, colour] - light[good, 3, colour]
            found = -slope(np.array(DISTANCES)[good], np.log(direct))
            expected = a[colour] + 0.25 * b[colour]
            assert abs(found - expected) < 0.1 * expected, (patch, colour, signal)
            used += 1
    assert used >= 6


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_black_chart_gives_the_veil_back(name: str) -> None:
    """What black shows fills up with beta_B = a + b_b, towards b_b E / (2 beta_B)."""
    a, b, k = (np.array(row) for row in PUBLISHED[name])
    # half of what molecules scatter goes back (Haltrin 1999), 1.83 % of what particles do
    clear = np.minimum(0.005826 * (400.0 / np.array([600.0, 525.0, 475.0])) ** 4.322, b)
    back = 0.5 * clear + 0.0183 * (b - clear)
    optics = Optics(water_type=name, blur=False, **SMOOTH)
    veil = np.array([chart(optics, z, 2.0)[3] for z in DISTANCES], float)
    full = chart(optics, np.inf, 2.0)[3].astype(float)
    found = [-slope(np.array(DISTANCES), np.log(1.0 - veil[:, c] / full[c])) for c in range(3)]
    np.testing.assert_allclose(found, a + back, rtol=0.02)
    # 93 to 98 % of the daylight comes through the surface
    lit = full / (0.5 * back / (a + back) * np.exp(-2.0 * k))
    assert np.all((lit > 0.93) & (lit < 0.98))


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_depth_ramp_gives_the_diffuse_attenuation_back(name: str) -> None:
    """The same chart, sunk with the camera from 0.5 to 8 m: K_d within 2 %."""
    depths = np.array([0.5, 1.0, 2.0, 4.0, 8.0])
    optics = Optics(water_type=name, blur=False, **SMOOTH)
    seen = np.array([chart(optics, 1.0, d) for d in depths], float)
    direct = seen[:, 0] - seen[:, 3]
    found = [-slope(depths, np.log(direct[:, c])) for c in range(3)]
    np.testing.assert_allclose(found, PUBLISHED[name][2], rtol=0.02)


def test_an_object_is_lit_at_its_own_depth() -> None:
    """Straight down, a floor z below the camera fades with beta_D + K_d."""
    (a, b, k), reach = (np.array(r) for r in PUBLISHED["coastal_1"]), np.array([1.0, 2.0, 4.0])
    line = np.broadcast_to((0.0, 0.0, -1.0), (6, 1, 2, 3))
    colour = np.concatenate([np.ones((3, 1, 2, 3)), np.zeros((3, 1, 2, 3))])
    ranges = np.concatenate([reach, reach])[:, None, None] * np.ones((6, 1, 2))
    view = Sight(colour, ranges, np.array([[0.0, 0.0, -1.0]] * 6), line)
    optics = Optics(water_type="coastal_1", blur=False, **SMOOTH)
    seen = optics.look(view, SurfaceStill(), 0.0, None)[:, 0, 0]
    found = [-slope(reach, np.log(seen[:3, c] - seen[3:, c])) for c in range(3)]
    np.testing.assert_allclose(found, a + 0.25 * b + k, rtol=1e-6)


@pytest.mark.parametrize(
    "name", ["oceanic_1", "oceanic_1a", "oceanic_1b", "oceanic_2", "oceanic_3"]
)
def test_red_vanishes_before_blue(name: str) -> None:
    """In clear water the red of white falls below a hundredth before green and blue do."""
    optics = Optics(water_type=name, blur=False, **SMOOTH)
    reach = np.geomspace(0.5, 400.0, 200)
    seen = np.array([chart(optics, float(z), 1.0) for z in reach], float)
    share = (seen[:, 0] - seen[:, 3]) / (seen[0, 0] - seen[0, 3])
    gone = [float(reach[np.argmax(share[:, c] < 0.01)]) for c in range(3)]
    assert gone[0] < 0.75 * min(gone[1:])
    left = share[:, 0] > 1e-4
    assert np.all(np.diff(share[left, 0] / share[left, 2]) < 0.0)


@pytest.mark.parametrize("name", WATERS)
def test_radiance_never_exceeds_direct_and_veiling_light(name: str) -> None:
    """Random scenes: no pixel above J E exp(-beta_D z) + B_inf, nor above J + B_inf."""
    rng = np.random.default_rng(5)
    shape = (4, 20, 20)
    line = rng.normal(size=(*shape, 3))
    # up to a little above the horizon: straight up there is no such thing as an endless path
    line[..., 2] = -np.abs(line[..., 2]) + 0.05
    line /= np.linalg.norm(line, axis=-1, keepdims=True)
    colour, ranges = rng.uniform(0.0, 1.0, (*shape, 3)), rng.exponential(6.0, shape)
    place = np.column_stack([np.zeros((4, 2)), -rng.uniform(3.0, 12.0, 4)])
    optics = Optics(water_type=name, blur=False, surface=False, **SMOOTH)
    seen = optics.look(Sight(colour, ranges, place, line), SurfaceStill(), 0.0, None)
    water = WATERS[name]
    a, b, k = (np.array(x) for x in (water.absorption, water.scattering, water.diffuse))
    clear = np.minimum(0.005826 * (400.0 / np.array([600.0, 525.0, 475.0])) ** 4.322, b)
    back = 0.5 * clear + 0.0183 * (b - clear)
    depth = -place[:, 2][:, None, None, None]
    rate = a + back - k * line[..., 2:]
    assert np.all(rate > 0.0)
    veil = 0.5 * back * np.exp(-k * depth) / rate
    ends = np.clip(depth - (ranges * line[..., 2])[..., None], 0.0, None)
    direct = colour * np.exp(-k * ends - (a + 0.25 * b) * ranges[..., None])
    assert np.all(seen <= direct + veil + 1e-9)
    assert np.all(seen <= colour + veil + 1e-9)
    assert np.all(seen >= 0.9 * direct)


def test_no_water_leaves_the_picture_alone() -> None:
    """Without water and noise the picture comes back as it was."""
    colour = np.random.default_rng(1).uniform(size=(1, 9, 9, 3)).astype(np.float32)
    view = Sight(colour, np.ones((1, 9, 9)), np.zeros((1, 3)), level(9))
    assert np.array_equal(Optics(noise=False).look(view, SurfaceStill(), 0.0, None), colour)
