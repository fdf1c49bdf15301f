"""Spray over particle water: where it is thrown off, how it flies, how it is drawn."""

from __future__ import annotations

import numpy as np
import pytest

from seals.run.spray import GRAVITY, MOST, Droplets, Spray, drop_mesh

SPACING = 0.05


def block() -> np.ndarray:
    """Places of a block of water a metre wide, its top at zero."""
    axis = SPACING * (np.arange(20) + 0.5)
    x, y, z = np.meshgrid(axis, axis, axis[:8] - 8 * SPACING, indexing="ij")
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def thrown(speed: float) -> Spray:
    """Spray of a block whose particles all have random velocities of a size."""
    places = block()
    rng = np.random.default_rng(1)
    velocities = rng.normal(size=places.shape)
    velocities *= speed / np.linalg.norm(velocities, axis=1, keepdims=True)
    spray = Spray()
    spray.advance(places, velocities, SPACING, 0.02)
    return spray


def test_slow_water_and_smooth_water_keep_their_drops() -> None:
    """Nothing is thrown off at rest, by slow water, or by water that moves as one."""
    assert len(thrown(0.0).drops.age) == len(thrown(0.5).drops.age) == 0
    spray, places = Spray(), block()
    assert not len(spray.advance(places, np.tile([3.0, 0, 0], (len(places), 1)), SPACING, 0.02).age)


def test_torn_water_throws_off_more_the_faster_it_is() -> None:
    """Droplets lie over the block, out of the water; no more than are drawn."""
    slow, fast = thrown(1.5).drops, thrown(3.0).drops
    assert 0 < len(slow.age) < len(fast.age) <= MOST
    outside = ((fast.place < 0.0) | (fast.place > [1.0, 1.0, 0.0])).any(axis=1)
    assert outside.mean() > 0.95


def test_drops_fly_freely_and_fall_back() -> None:
    """A parabola to the bit of rounding; in water they are gone."""
    spray = thrown(3.0)
    up = (spray.drops.velocity[:, 2] > 2.0) & (spray.drops.place[:, 2] > 0.0)
    spray.drops = Droplets(*(values[up][:1] for values in spray.drops))
    place, velocity = spray.drops.place[0].copy(), spray.drops.velocity[0].copy()
    places = block()
    for _ in range(5):
        spray.advance(places, np.zeros_like(places), SPACING, 0.02)
    fall = np.array([0.0, 0.0, -GRAVITY])
    assert spray.drops.place[0] == pytest.approx(place + 0.1 * velocity + 0.005 * fall, abs=1e-9)
    for _ in range(100):
        spray.advance(places, np.zeros_like(places), SPACING, 0.02)
    assert len(spray.drops.age) == 0


def test_drops_are_closed_and_look_outwards() -> None:
    """Two icosahedra: every edge twice, volume 2.5362 r^3 each (that of the solid)."""
    radius = np.array([0.002, 0.003])
    drops = Droplets(np.array([[0.0, 0, 0], [1.0, 2, 3]]), np.zeros((2, 3)), radius, np.zeros(2))
    corners, faces = drop_mesh(drops)
    assert corners.shape == (24, 3)
    assert faces.shape == (40, 3)
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    for k, r in enumerate(radius):
        a, b, c = (corners[faces[20 * k : 20 * k + 20, n]] - drops.place[k] for n in range(3))
        volume = (a * np.cross(b, c)).sum() / 6.0
        assert volume == pytest.approx(2.53615 * r**3, rel=1e-4)
