"""Basin geometry: particle lattice of the water at rest, walls, wave maker paddle."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.environment.settings import ObstacleSettings, SolidType
from seals.errors import ConfigError, refuse_unlisted
from seals.plugins.fluids.sampling import PITCH, Samples, box_walls, fewest_places
from seals.plugins.fluids.sampling.tank import SIDES, WALL

FEWEST = 6
"""Least spacings along each side: below it there is no water between two walls."""
SLAB = 0.5
"""Thickness of walls as solids [m]: more than a body sinks in within one step."""


class Basin(NamedTuple):
    """Box of water whose sides are multiples of the particle spacing.

    Args:
        spacing: of the particles [m].
        lower: corner of the water, on the floor [m], shape (3,).
        upper: opposite corner, on the surface [m], shape (3,).
        top: up to where particles may fly [m].
        behind: room behind the low end of x for a wave maker [m].
        open_sides: sides without a wall.
    """

    spacing: float
    lower: Floats
    upper: Floats
    top: float
    behind: float
    open_sides: frozenset[str]

    @property
    def counts(self) -> tuple[int, int, int]:
        """Particles along each side."""
        n = np.round((self.upper - self.lower) / self.spacing).astype(int)
        return int(n[0]), int(n[1]), int(n[2])

    @property
    def depth(self) -> float:
        """Depth of the water [m]."""
        return float(self.upper[2] - self.lower[2])

    @property
    def boundary(self) -> int:
        """Least number of boundary samples of floor and walls, without sampling them."""
        closed = {*SIDES[:5]} - self.open_sides - ({"x_low"} if self.behind else set())
        return fewest_places((*self.counts[:2], self._rows), closed=closed)

    def domain(self, reach: float = 0.0) -> tuple[Floats, Floats]:
        """Corners of the solver's domain [m].

        Args:
            reach: further room on all sides.
        """
        margin = (WALL + 2.0) * self.spacing + reach
        low, high = self.lower - margin, self.upper + margin
        low[0] -= self.behind
        high[2] = self.top + reach
        return low, high

    def lattice(self) -> Floats:
        """Particle positions of the water at rest [m], shape (n, 3)."""
        axes = [
            low + self.spacing * (np.arange(n) + 0.5)
            for low, n in zip(self.lower, self.counts, strict=True)
        ]
        return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)

    def walls(self, *, floor: bool, paddle: bool) -> Samples:
        """Samples of floor and walls.

        Args:
            floor: whether the floor stands still and is one of them.
            paddle: whether a wave maker stands in place of the wall at low x.
        """
        closed = {*SIDES[:4], "z_low"} - self.open_sides
        closed -= set() if floor else {"z_low"}
        closed -= {"x_low"} if paddle else set()
        high = np.array([*self.upper[:2], self.lower[2] + self._rows * self.spacing])
        low = self.lower.copy()
        low[0] -= round(self.behind / self.spacing) * self.spacing if paddle else 0.0
        return box_walls(low, high, self.spacing, closed=closed)

    @property
    def _rows(self) -> int:
        """Rows of wall from the floor to the top."""
        return max(1, round(float(self.top - self.lower[2]) / self.spacing))

    def floor(self) -> Samples:
        """Samples of a moving floor, relative to its centre at rest."""
        walls = box_walls(
            self.lower - np.array([self.behind, 0.0, 0.0]),
            self.upper,
            self.spacing,
            closed=("z_low",),
        )
        return Samples(walls.points - self.middle, walls.volumes)

    @property
    def middle(self) -> Floats:
        """Centre of the floor [m]."""
        return np.array([*(0.5 * (self.lower + self.upper))[:2], self.lower[2]])

    def paddle(self) -> Samples:
        """Samples of the wave maker paddle about its foot, at the low end of x."""
        d = self.spacing
        width, high = d * self.counts[1], d * self._rows
        across, up = round(width / (PITCH * d)), round(high / (PITCH * d))
        j, k = np.meshgrid(np.arange(across) + 0.5, np.arange(up) + 0.5, indexing="ij")
        points = np.stack(
            [
                np.full(j.size, -0.5 * d),
                j.ravel() * width / across - 0.5 * width,
                k.ravel() * high / up,
            ],
            axis=1,
        )
        return Samples(points, np.full(len(points), width * high * d / len(points)))

    @property
    def foot(self) -> Floats:
        """Foot of the wave maker paddle at rest [m]."""
        return np.array([self.lower[0], self.middle[1], self.lower[2]])


def build_basin(
    *,
    spacing: float,
    size: Sequence[float],
    centre: Sequence[float],
    level: float,
    bottom: float | None,
    freeboard: float,
    behind: float,
    open_sides: Collection[str],
) -> Basin:
    """Return a basin of exact depth whose sides are multiples of the spacing.

    The nearest spacing that divides the depth is taken.

    Args:
        spacing: wanted [m].
        size: length, width and depth [m].
        centre: of the basin, east and north [m].
        level: of the water [m].
        bottom: height of the floor, which rules over the depth [m]; None for none.
        freeboard: room above the water [m].
        behind: room behind the low end of x [m].
        open_sides: sides without a wall, such as ``x_high``.

    Raises:
        ConfigError: a side is unknown, or too short for the spacing.
    """
    depth = size[2] if bottom is None else level - bottom
    for side in open_sides:
        refuse_unlisted(side, SIDES[:4], f"open_sides: there is no side '{side}'")
    for name, length in zip(("length", "width", "depth"), (*size[:2], depth), strict=True):
        if length < FEWEST * spacing:
            raise ConfigError(
                f"the basin's {name} of {length:.3g} m is too small for a spacing of "
                f"{spacing:g} m.\n"
                f"Allowed: {FEWEST} spacings or more; make it {FEWEST * spacing:.3g} m, or take a "
                f"spacing up to {max(length, 0.0) / FEWEST:.3g} m."
            )
    exact = depth / round(depth / spacing)
    half = 0.5 * exact * np.round(np.array(size[:2]) / exact)
    middle = np.array(centre, dtype=float)
    return Basin(
        spacing=exact,
        lower=np.array([*(middle - half), level - depth]),
        upper=np.array([*(middle + half), level]),
        top=level + freeboard,
        behind=behind,
        open_sides=frozenset(open_sides),
    )


def walls_of(basin: Basin) -> dict[str, ObstacleSettings]:
    """Return floor and walls as contact solids, without the wall that a wave maker replaces."""
    low, high = basin.lower, basin.upper
    middle, size = 0.5 * (low + high), high - low
    tall = basin.top - low[2]
    out = {"basin_floor": _slab([*middle[:2], low[2] - 0.5 * SLAB], [*size[:2], SLAB])}
    for axis, name in enumerate("xy"):
        for end, edge, sign in (("low", low, -1.0), ("high", high, 1.0)):
            side = f"{name}_{end}"
            if side in basin.open_sides or (side == "x_low" and basin.behind > 0.0):
                continue
            place, edges = [*middle[:2], low[2] + 0.5 * tall], [*size[:2], tall]
            place[axis], edges[axis] = edge[axis] + sign * 0.5 * SLAB, SLAB
            out[f"basin_{side}"] = _slab(place, edges)
    return out


def _slab(place: Sequence[float], edges: Sequence[float]) -> ObstacleSettings:
    return ObstacleSettings(
        type=SolidType.box, size=[float(x) for x in edges], position=[float(x) for x in place]
    )
