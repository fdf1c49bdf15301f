"""Spray: drops finer than a particle that fast, torn water throws off, for films."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats

LONE, INSIDE, SURFACE, MOST_NEAR = 6, 20, 24, 33
"""Neighbours in two spacings below which a drop flies, from which on it is in the water, below
which water throws drops off, and most that are looked at [1]; inside of water are 26 or more."""
ENERGY = (0.3, 3.0)
"""Kinetic energy of a unit of mass at which water begins to throw off drops, and at its full rate
[m^2/s^2]; of flumes and robots, those of Ihmsen et al. are of ships and rivers."""
TRAPPED = (1.0, 5.0)
"""Trapped-air potential between the same [m/s]."""
RATE, MOST, LIFE = 4000.0, 6000, 2.0
"""Drops of a particle at its full rate [1/s], most of all, and the longest time of one [s]."""
SIZE, SCATTER, SIZES = 0.07, 0.5, (0.02, 0.15)
"""Radius: median [1 spacing], standard deviation of its logarithm, bounds [1 spacing]."""
GRAVITY = 9.81


class Droplets(NamedTuple):
    """Drops in flight.

    Args:
        place: [m], shape (n, 3).
        velocity: [m/s], shape (n, 3).
        radius: [m], shape (n,).
        age: [s], shape (n,).
    """

    place: Floats
    velocity: Floats
    radius: Floats
    age: Floats

    def chosen(self, rows: NDArray[np.bool_] | NDArray[np.int64]) -> Droplets:
        """Return some of them."""
        return Droplets(*(values[rows] for values in self))


class Spray:
    """Drops that water throws off and that fly until they fall back.

    Equation:
        drops in a time dt = rate Phi(v^2 / 2) Phi(I) dt, Phi from 0 to 1 between two bounds, with
        the trapped-air potential I = sum_j |v_ij| (1 - v_ij . x_ij / |v_ij| |x_ij|) (1 - r_ij / h).
        A drop starts beside its particle, within half a spacing and the way of a step, and flies
        without drag. With 20 neighbours or more, or six on its way down, it has fallen back.

    Args:
        seed: of the places and sizes.

    Limitations:
        For the eye: drops take no mass from the water. Foam and bubbles are not there.

    References:
        Ihmsen, Akinci, Akinci and Teschner 2012, The Visual Computer 28, 669, secs. 3.1 to 3.3.
    """

    def __init__(self, seed: int = 0) -> None:
        self._draw = np.random.default_rng(seed)
        none = np.zeros((0, 3))
        self.drops = Droplets(none, none, np.zeros(0), np.zeros(0))

    def advance(self, places: Floats, velocities: Floats, spacing: float, step: float) -> Droplets:
        """Let drops fly for a time and water throw off new ones; return those in flight.

        Args:
            places: of the water's particles [m], shape (n, 3).
            velocities: of them [m/s], shape (n, 3).
            spacing: at rest [m].
            step: time since the last call [s].
        """
        from scipy.spatial import cKDTree

        tree = cKDTree(places)
        old = self.drops
        fall = np.array([0.0, 0.0, -GRAVITY])
        old = Droplets(
            old.place + step * old.velocity + 0.5 * step**2 * fall,
            old.velocity + step * fall,
            old.radius,
            old.age + step,
        )
        new = self._thrown(tree, np.asarray(velocities, dtype=float), spacing, step)
        drops = Droplets(*(np.concatenate(pair) for pair in zip(old, new, strict=True)))
        near = np.asarray(tree.query_ball_point(drops.place, 2.0 * spacing, return_length=True))
        rising = drops.velocity[:, 2] > 0.0
        flies = (near < LONE) | ((near < INSIDE) & rising)
        drops = drops.chosen(flies & (drops.age < LIFE))
        if len(drops.age) > MOST:
            drops = drops.chosen(np.sort(self._draw.choice(len(drops.age), MOST, replace=False)))
        self.drops = drops
        return drops

    def _thrown(self, tree: object, velocities: Floats, spacing: float, step: float) -> Droplets:
        """New drops, those inside of the water among them."""
        places, reach = np.asarray(tree.data), 2.0 * spacing  # type: ignore[attr-defined]
        fast = np.flatnonzero(0.5 * (velocities**2).sum(axis=1) > ENERGY[0])
        distance, other = tree.query(  # type: ignore[attr-defined]
            places[fast], k=MOST_NEAR, distance_upper_bound=reach
        )
        there = (other < len(places)) & (distance > 0.0)
        torn = there.sum(axis=1) < SURFACE
        fast, distance, other, there = fast[torn], distance[torn], other[torn], there[torn]
        other = np.where(there, other, fast[:, None])
        away = places[fast][:, None] - places[other]
        past = velocities[fast][:, None] - velocities[other]
        speed = np.linalg.norm(past, axis=2)
        closing = 1.0 - (past * away).sum(axis=2) / np.maximum(
            speed * np.linalg.norm(away, axis=2), 1e-12
        )
        weight = np.where(there, 1.0 - distance / reach, 0.0)
        air = np.where(there, speed * closing * np.where(there, weight, 0.0), 0.0).sum(axis=1)
        energy = 0.5 * (velocities[fast] ** 2).sum(axis=1)
        mean = RATE * step * _share(energy, ENERGY) * _share(air, TRAPPED)
        source = fast[np.repeat(np.arange(len(fast)), self._draw.poisson(mean))]
        return self._beside(places[source], velocities[source], spacing, step)

    def _beside(self, places: Floats, velocities: Floats, spacing: float, step: float) -> Droplets:
        """Drops in a cylinder along the way of their particles."""
        n = len(places)
        aside = self._draw.normal(size=(n, 3))
        ahead = velocities / np.maximum(np.linalg.norm(velocities, axis=1, keepdims=True), 1e-12)
        aside -= (aside * ahead).sum(axis=1, keepdims=True) * ahead
        aside /= np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-12)
        far = 0.5 * np.sqrt(self._draw.uniform(size=(n, 1)))
        along = step * self._draw.uniform(size=(n, 1)) * velocities
        size = SIZE * np.exp(SCATTER * self._draw.normal(size=n))
        return Droplets(
            places + far * spacing * aside + along,
            velocities * (1.0 + 0.2 * self._draw.normal(size=(n, 1))) + far * aside,
            spacing * np.clip(size, *SIZES),
            np.zeros(n),
        )


def _share(values: Floats, bounds: tuple[float, float]) -> Floats:
    low, high = bounds
    return (np.clip(values, low, high) - low) / (high - low)


def drop_mesh(drops: Droplets) -> tuple[Floats, NDArray[np.int64]]:
    """Return drops as icosahedra: corners [m], shape (12 n, 3), and triangles, shape (20 n, 3)."""
    g = 0.5 * (1.0 + 5.0**0.5)
    ring = [(0.0, a, b * g) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    corners = np.array([tuple(np.roll(p, k)) for k in range(3) for p in ring])
    corners /= np.linalg.norm(corners[0])
    edge = np.linalg.norm(corners[:, None] - corners, axis=2)
    near = edge < 1.1 * edge[edge > 0.0].min()
    faces = np.array(
        [
            (i, j, k) if np.linalg.det(corners[[i, j, k]]) > 0.0 else (i, k, j)
            for i in range(12)
            for j in range(i + 1, 12)
            for k in range(j + 1, 12)
            if near[i, j] and near[j, k] and near[i, k]
        ]
    )
    places = (drops.place[:, None] + drops.radius[:, None, None] * corners).reshape(-1, 3)
    numbers = 12 * np.arange(len(drops.age))
    return places, (numbers[:, None, None] + faces).reshape(-1, 3)
