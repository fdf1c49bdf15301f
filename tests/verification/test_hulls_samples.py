"""Sampled hulls: draught, waves, and broken meshes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from seals.hydrostatics import Hull, HullBox, HullSamples

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
