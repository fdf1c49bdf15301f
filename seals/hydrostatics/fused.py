"""Hull of several rigidly connected links."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from seals.errors import RobotError
from seals.hydrostatics.table import HullTable
from seals.hydrostatics.wetted import DRY, Hull, Sums, Vector, Wetted, frozen, wetted_of

HALVINGS = 48
"""Halvings of an interval that find where a hull begins: to the last digit of a metre."""


class Part(NamedTuple):
    """Hull with its pose in another link.

    Args:
        hull: in its own axes.
        origin: of those axes in the link [m], shape (3,).
        rotation: of those axes in the link, shape (3, 3).
    """

    hull: Hull
    origin: Vector
    rotation: Vector


class HullFused:
    """Hull made of the hulls of rigidly connected links, with one common table for batches.

    Equation:
        V(up, level) = sum V_i(R_i^T up, level - up . p_i), moments likewise, turned back.

    Assumptions: parts do not overlap, or their stated volumes account for it.

    Limitations: the table of a compact body with booms is within 0.1 % of its volume; parts far
        from each other make it worse, up to 1.2 % at single poses for a whole robot with an arm.

    Args:
        parts: hulls and their places.

    Raises:
        RobotError: there are no parts.

    Example:
        >>> from seals.hydrostatics import HullSphere
        >>> ball = HullSphere(radius=0.1)
        >>> pair = [Part(ball, np.array([x, 0.0, 0.0]), np.eye(3)) for x in (-0.2, 0.2)]
        >>> round(HullFused(pair).volume / ball.volume, 12)
        2.0
    """

    resolution = (64, 64)
    """Cells along an octahedron edge and depths of the table: small parts need fine ones."""

    def __init__(self, parts: Sequence[Part]) -> None:
        if not parts:
            raise RobotError("a fused hull has no parts.\nGive at least one hull.")
        self.parts = tuple(parts)
        self.volume = float(sum(part.hull.volume for part in parts))
        middles = [p.origin + p.rotation @ p.hull.centroid for p in parts]
        shares = [p.hull.volume / self.volume for p in parts]
        middle = sum((s * m for s, m in zip(shares, middles, strict=True)), np.zeros(3))
        self.centroid: Vector = frozen(*middle.tolist())
        self._arms = [m - middle for m in middles]
        self._shares = shares
        self.reach = max(float(np.linalg.norm(p.origin)) + p.hull.reach for p in parts)

    @property
    def plan_area(self) -> float:
        """Largest horizontal section with the body upright [m^2], of the levels of a fine grid."""
        levels = np.linspace(-self.reach, self.reach, 129)[None]
        return float(self.cut(np.array([[0.0, 0.0, 1.0]]), levels)[0, :, 4].max())

    @property
    def grain(self) -> int:
        """Cost of one cut, in faces of a mesh."""
        return sum(part.hull.grain for part in self.parts)

    def wetted(self, up: Sequence[float] | Vector, level: float) -> Wetted:
        """Return the part below the surface, see `Hull`."""
        if level <= -self.reach:
            return DRY
        row = self.cut(np.asarray(up, dtype=float)[None], np.array([[float(level)]]))[0, 0]
        return wetted_of(Sums(*row.tolist()), self.volume)

    def spread(self) -> Vector:
        """Return second moments about the centroid per volume [m^2], each part as a sphere."""
        total = np.zeros((3, 3))
        for part, share, arm in zip(self.parts, self._shares, self._arms, strict=True):
            radius = (0.75 * part.hull.volume / math.pi) ** (1.0 / 3.0)
            # Steiner, with a ball of the part's volume: r^2 / 5 along every axis
            total += share * (np.outer(arm, arm) + 0.2 * radius**2 * np.eye(3))
        return total

    def extents(self, ups: Vector) -> tuple[Vector, Vector]:
        """Return lowest and highest level of the hull along each normal [m], shape (N,) each."""
        low = self._edge(ups, 1e-12 * self.volume)
        high = self._edge(-ups, 1e-12 * self.volume)
        return low, -high

    def _edge(self, ups: Vector, least: float) -> Vector:
        """Highest level below which nothing of the hull lies."""
        dry, wet = np.full(len(ups), -self.reach), np.full(len(ups), self.reach)
        for _ in range(HALVINGS):
            middle = 0.5 * (dry + wet)
            # the volume below a level never falls with the level: bisection
            empty = self.cut(ups, middle[:, None])[:, 0, 0] <= least
            dry, wet = np.where(empty, middle, dry), np.where(empty, wet, middle)
        return dry

    def cut(self, ups: Vector, levels: Vector) -> Vector:
        """Return volume, moments, area and area moments, shape (normals, levels, 8)."""
        count, depth = levels.shape
        flat, normals = levels.ravel(), np.repeat(ups, depth, axis=0)
        total = np.zeros((count * depth, 8))
        for part in self.parts:
            law = HullTable.build(part.hull).law
            own = normals @ part.rotation
            below = flat - normals @ part.origin
            sums = law(np, own[:, 0], own[:, 1], own[:, 2], below)
            for first, size in ((0, sums.volume), (4, sums.area)):
                moment = np.stack(sums[first + 1 : first + 4], axis=-1)
                total[:, first] += size
                total[:, first + 1 : first + 4] += (
                    # int x dV = R int x' dV + p V, x = R x' + p
                    moment @ part.rotation.T + np.asarray(size)[:, None] * part.origin
                )
        return total.reshape(count, depth, 8)
