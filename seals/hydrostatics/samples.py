"""Hull of quasi-random samples, for broken meshes and wavy surfaces."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from seals.errors import RobotError
from seals.hydrostatics.wetted import DRY, Sums, Vector, Wetted, frozen, wetted_of

LEAST_SAMPLES = 4096
MOST_DRAWS = 2**20
_PAIRS = 200_000
"""Of points and faces that are held at once."""
PLAN_LEVELS = 65
Inside = Callable[[Vector], NDArray[np.bool_]]


class HullSamples:
    """Hull of scrambled Sobol points, each a small volume smoothed over its size.

    Equation: a sample of volume v and size d = v^(1/3) is wet by
        clip((level - up . x) / d + 1/2, 0, 1); the waterplane area is the derivative of the sum,
        the sum of v / d over the samples being cut.

    Assumptions: the samples fill the body evenly.

    Limitations: the draught is good to about 0.3 %, the waterplane area to a few per cent.

    Args:
        points: samples in link axes [m], shape (S, 3).
        volume: volume of the whole body [m^3].

    Raises:
        RobotError: no samples, or no volume.
    """

    def __init__(self, *, points: Vector, volume: float) -> None:
        self.points = np.ascontiguousarray(points, dtype=np.float64)
        if self.points.ndim != 2 or self.points.shape[1] != 3 or not len(self.points):
            raise RobotError(
                f"hull samples of shape {self.points.shape} cannot be used.\nGive points (S, 3)."
            )
        if not (np.isfinite(self.points).all() and np.isfinite(volume) and volume > 0.0):
            raise RobotError(
                "hull samples or their volume are not finite and positive.\nCheck both."
            )
        self.volume = float(volume)
        self.each = self.volume / len(self.points)
        self.size = self.each ** (1.0 / 3.0)
        self.centroid: Vector = frozen(*self.points.mean(axis=0).tolist())
        self.reach = float(np.sqrt((self.points**2).sum(axis=1).max())) + 0.5 * self.size

    @classmethod
    def inside(
        cls,
        test: Inside,
        *,
        low: Sequence[float],
        high: Sequence[float],
        seed: int = 0,
        most: int = MOST_DRAWS,
    ) -> HullSamples:
        """Draw points in a bounding box until `LEAST_SAMPLES` of them lie inside.

        Args:
            test: maps points (N, 3) to a mask (N,).
            low: lowest corner of the bounding box, link axes [m].
            high: highest corner [m].
            seed: of the scrambling; the same seed gives the same samples.
            most: number of points after which it is given up.

        Raises:
            RobotError: fewer than `LEAST_SAMPLES` of ``most`` points lie inside.
        """
        # few hulls are sampled: the others need not wait for this import
        from scipy.stats import qmc

        sobol = qmc.Sobol(3, scramble=True, rng=np.random.default_rng(seed))
        box = np.asarray(high, dtype=np.float64) - np.asarray(low, dtype=np.float64)
        kept: list[Vector] = []
        found, drawn = 0, 0
        while found < LEAST_SAMPLES:
            if drawn >= most:
                raise RobotError(
                    f"only {found} of {drawn} points lie inside the hull, {LEAST_SAMPLES} are "
                    "needed.\n"
                    "Check that the mesh encloses a volume, or give primitives instead."
                )
            fresh = np.asarray(low) + box * sobol.random(max(drawn, 4096))
            drawn += len(fresh)
            kept.append(fresh[test(fresh)])
            found += len(kept[-1])
        return cls(points=np.concatenate(kept), volume=float(box.prod()) * found / drawn)

    resolution = None

    @property
    def grain(self) -> int:
        """Number of samples, the cost of one cut."""
        return len(self.points)

    @property
    def plan_area(self) -> float:
        """Largest horizontal section with the body upright [m^2], smoothed over three levels."""
        z = self.points[:, 2]
        levels = np.linspace(z.min(), z.max(), PLAN_LEVELS)[None]
        area = self.cut(np.array([[0.0, 0.0, 1.0]]), levels)[0, :, 4]
        return float(np.convolve(area, np.full(3, 1.0 / 3.0), mode="valid").max())

    def wetted(self, up: Sequence[float] | Vector, level: float) -> Wetted:
        """Return the part below a plane, see `Hull`."""
        if level <= -self.reach:
            return DRY
        depth = level - self.points @ np.asarray(up, dtype=np.float64)
        share = depth / self.size + 0.5
        wet = np.minimum(np.maximum(share, 0.0), 1.0)
        # the slope of the clip, 1 / d, where a sample is being cut
        band = ((share > 0.0) & (share < 1.0)).astype(np.float64)
        line = self.each / self.size
        mx, my, mz = (wet @ self.points * self.each).tolist()
        ax, ay, az = (band @ self.points * line).tolist()
        volume, area = float(wet.sum()) * self.each, float(band.sum()) * line
        return wetted_of(Sums(volume, mx, my, mz, area, ax, ay, az), self.volume)

    def extents(self, ups: Vector) -> tuple[Vector, Vector]:
        """Return lowest and highest level of the hull along each normal [m], shape (N,) each."""
        along = np.asarray(ups) @ self.points.T
        return along.min(axis=1) - 0.5 * self.size, along.max(axis=1) + 0.5 * self.size

    def spread(self) -> Vector:
        """Return the second moments of the volume about its centroid, per volume [m^2], (3, 3)."""
        off = self.points - self.centroid
        return np.asarray(off.T @ off / len(off))

    def cut(self, ups: Vector, levels: Vector) -> Vector:
        """Return volume, moments, area and area moments, shape (normals, levels, 8)."""
        ones = np.concatenate((np.ones((len(self.points), 1)), self.points), axis=1)
        along = ups @ self.points.T
        depth = (levels[:, :, None] - along[:, None, :]) / self.size + 0.5
        wet = np.minimum(np.maximum(depth, 0.0), 1.0)
        band = ((depth > 0.0) & (depth < 1.0)).astype(np.float64)
        flat = band @ ones * (self.each / self.size)
        return np.concatenate((wet @ ones * self.each, flat), axis=-1)


def winding_test(corners: Vector) -> Inside:
    """Return an inside test for a mesh with holes, by its generalised winding number.

    Equation: sum of the solid angles of the faces, van Oosterom & Strackee 1983, over 4 pi; more
        than one half is inside (Jacobson, Kavan & Sorkine-Hornung 2013).

    Args:
        corners: of the faces [m], shape (F, 3, 3).
    """
    middle = corners.reshape(-1, 3).mean(axis=0)
    # about the middle of the mesh, so that squares of distances lose no digits to its place
    turn = _Winding(corners - middle)
    step = max(1, _PAIRS // len(corners))

    def test(points: Vector) -> NDArray[np.bool_]:
        turns = [turn(points[k : k + step] - middle) for k in range(0, len(points), step)]
        return np.abs(np.concatenate(turns)) > 0.5

    return test


class _Winding:
    """Winding numbers by matrix products; the terms of the faces are computed once."""

    def __init__(self, corners: Vector) -> None:
        self.corners = a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        self.normal = np.cross(a, b) + np.cross(b, c) + np.cross(c, a)
        self.triple = np.einsum("fi,fi->f", a, np.cross(b, c))

    def __call__(self, points: Vector) -> Vector:
        """Return winding numbers of points (N, 3), shape (N,)."""
        square = np.einsum("ni,ni->n", points, points)[:, None]

        def dot(u: Vector, v: Vector) -> Vector:
            """Return (u - p) . (v - p) of every point and face."""
            found: Vector = points @ -(u + v).T
            found += np.einsum("fi,fi->f", u, v)
            found += square
            return found

        a, b, c = self.corners
        # rounding may leave a square a hair below zero at a corner
        la, lb, lc = (np.sqrt(np.maximum(dot(u, u), 0.0)) for u in (a, b, c))
        below = la * lb * lc
        for u, v, length in ((a, b, lc), (b, c, la), (c, a, lb)):
            below += dot(u, v) * length
        # tan(angle / 2) = a . (b x c) / (abc + (a . b) c + (b . c) a + (c . a) b), from the point
        triple = self.triple - points @ self.normal.T
        return np.asarray(np.arctan2(triple, below).sum(axis=1) / (2.0 * np.pi))
