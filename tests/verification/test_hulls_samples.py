"""Sampled hulls: draught, waves, and broken meshes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from seals.hydrostatics import Hull, HullBox, HullSamples, HullSphere

Vector = NDArray[np.float64]
EDGE = np.array([0.4, 0.3, 0.2])


def in_box(points: Vector) -> NDArray[np.bool_]:
    """Return which points lie in the box."""
    return np.asarray((np.abs(points) < EDGE / 2).all(axis=1))


def floating(hull: Hull, up: Vector, volume: float) -> float:
    """Return the level at which ``volume`` is wet [m]."""
    bound = hull.reach
    return float(brentq(lambda h: hull.wetted(up, h).volume - volume, -bound, bound, xtol=1e-9))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("density", [0.2, 0.5, 0.8])
def test_draught_of_a_sampled_box(seed: int, density: float) -> None:
    """A sampled box floats within 0.34 % of its height of the exact draught, upright and tilted."""
    samples = HullSamples.inside(
        in_box, low=(-EDGE / 1.9).tolist(), high=(EDGE / 1.9).tolist(), seed=seed
    )
    box = HullBox(size=EDGE.tolist())
    assert len(samples.points) >= 4096
    for up in (np.array([0.0, 0.0, 1.0]), np.array([0.48, 0.0, math.sqrt(1 - 0.48**2)])):
        exact = floating(box, up, density * box.volume)
        height = float(np.abs(up) @ EDGE)
        assert abs(floating(samples, up, density * box.volume) - exact) < 0.0034 * height


def test_sampled_area_is_the_slope_of_the_volume() -> None:
    """The waterplane area of samples is the derivative of their volume."""
    samples = HullSamples.inside(in_box, low=(-0.2, -0.15, -0.1), high=(0.2, 0.15, 0.1))
    rng, step = np.random.default_rng(2), 1e-9
    for _ in range(20):
        up = rng.normal(size=3)
        up /= np.sqrt(up @ up)
        level = float(rng.uniform(-0.05, 0.05))
        ahead, behind = samples.wetted(up, level + step), samples.wetted(up, level - step)
        slope = (ahead.volume - behind.volume) / (2 * step)
        assert samples.wetted(up, level).waterplane_area == pytest.approx(slope, rel=1e-3)


def test_wave_under_a_box() -> None:
    """Under a wave along x, the wetted volume of a box is the integral of the surface height."""
    samples = HullSamples.inside(
        in_box, low=(-0.2, -0.15, -0.1), high=(0.2, 0.15, 0.1), count=16384
    )
    k, amplitude, place = 9.0, 0.04, np.array([3.0, -1.0, 0.5])

    def height(x: Vector, y: Vector) -> Vector:
        return np.asarray(0.5 + amplitude * np.sin(k * (x - 3.0)) + 0.02 * (y + 1.0))

    wet = samples.wetted_wave(np.eye(3), place, height)
    x, y, z = EDGE
    assert wet.volume == pytest.approx(x * y * z / 2, rel=5e-3)
    # first moment of the surface along x: integral of A sin(k x) x over the length, times the width
    half = x / 2
    moment = amplitude * y * 2 * (math.sin(k * half) / k**2 - half * math.cos(k * half) / k)
    assert wet.volume * wet.centroid[0] == pytest.approx(moment, rel=2e-2)


def test_flat_wave_is_the_plane() -> None:
    """A flat wavy surface gives the plane's answer for a turned and moved body."""
    ball = HullSphere(radius=0.1)
    samples = HullSamples.inside(
        lambda p: (p * p).sum(axis=1) < 0.01, low=(-0.1,) * 3, high=(0.1,) * 3
    )
    turn = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    wave = samples.wetted_wave(turn, np.array([0.0, 0.0, -0.03]), lambda x, y: 0.0 * x)
    plane = samples.wetted(turn[2], 0.03)
    assert wave.volume == pytest.approx(plane.volume, rel=1e-12)
    assert wave.centroid == pytest.approx(plane.centroid, abs=1e-12)
    assert wave.volume == pytest.approx(ball.wetted(turn[2], 0.03).volume, rel=5e-3)
