"""Attenuation, veil and depth: coefficients come back from charts by regression."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.rendering.optics import WATERS, Optics, Sight, SurfaceStill, from_bytes, to_bytes

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
