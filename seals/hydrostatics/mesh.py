"""Hull of a closed triangle mesh, cut by many planes: the divergence theorem over its faces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from seals.errors import RobotError
from seals.hydrostatics.placed import axes_of, checked_triple
from seals.hydrostatics.wetted import DRY, ZERO, Sums, Vector, Wetted, frozen, wetted_of

SUMS = 9
"""Columns of the face sums: <1>, <g>, <g^2>, <x> (3), <x g> (3)."""


class _Faces:
    """The faces of a closed, outward-wound mesh, prepared for cutting.

    Args:
        corners: of the faces [m], shape (faces, 3, 3).
    """

    def __init__(self, corners: Vector) -> None:
        self.corners = np.ascontiguousarray(corners, dtype=np.float64)
        self.flat = np.ascontiguousarray(self.corners.transpose(2, 1, 0).reshape(3, -1))
        self.total = self.corners.sum(axis=1)
        # area vectors, of half the length of the cross product of two edges
        edges = self.corners[:, 1:] - self.corners[:, :1]
        self.vectors = np.ascontiguousarray(0.5 * np.cross(edges[:, 0], edges[:, 1]).T)


def _clip_mesh(faces: _Faces, ups: Vector, levels: Vector) -> Vector:
    """Cut a mesh by the planes up . x = level.

    Equation: with N = (area vector of a face) . up and g = up . x - level, summed over the faces,
        V = sum N <g>, M = sum N (<x g> - up <g^2> / 2), A = -sum N <1>, M_A = up V - sum N <x>,
        <.> being the integral over the wet part divided by the area of the face. The fields vanish
        on the surface plane, so the waterplane itself adds nothing to V and M. A face that crosses
        the surface is wet in one small triangle at its lowest corner, or dry in one at its highest.

    Args:
        faces: the mesh.
        ups: unit normals of the surface, shape (normals, 3).
        levels: heights of the surface above the link origin [m], shape (normals, levels).

    Returns:
        V [m^3], M about the link origin [m^4], A [m^2] and M_A [m^3], shape (normals, levels, 8).
    """
    heights = (ups @ faces.flat).reshape(len(ups), 3, -1)
    lean = ups @ faces.vectors
    level = levels[:, :, None]
    low, middle, high = (ranked[:, None] for ranked in _ranked(heights))
    # with two corners under water a face counts as wet, and its dry tip is taken off below
    above = middle < level
    sums = _whole(faces, heights, lean, levels, above)
    crossing = tuple(np.nonzero((low < level) & (level < high)))
    if len(crossing[0]):
        sums += _cut(faces, heights, lean, levels, crossing)
    up, volume = ups[:, None, :], sums[..., 1:2]
    moment = sums[..., 6:9] - (0.5 * sums[..., 2])[..., None] * up
    flat = up * volume - sums[..., 3:6]
    return np.concatenate((volume, moment, -sums[..., :1], flat), axis=-1)


def _ranked(heights: Vector) -> tuple[Vector, Vector, Vector]:
    """Return lowest, middle and highest corner of each face, faster than a sort of three."""
    a, b, c = heights[:, 0], heights[:, 1], heights[:, 2]
    low, high = np.minimum(a, b), np.maximum(a, b)
    return np.minimum(low, c), np.maximum(low, np.minimum(high, c)), np.maximum(high, c)


def _whole(
    faces: _Faces, heights: Vector, lean: Vector, levels: Vector, above: NDArray[np.bool_]
) -> Vector:
    """Return the sums over the faces that are submerged, all of them or all but one corner."""
    a, b, c = heights[:, 0], heights[:, 1], heights[:, 2]
    # over a triangle <g> = sum g / 3, <g^2> = ((sum g)^2 + sum g^2) / 12 and
    # <x g> = (sum x sum g + sum x g) / 12, over its corners
    h = a + b + c
    squares = a * a + b * b + c * c
    products = np.einsum("fci,ncf->nfi", faces.corners, heights)
    columns = np.empty((*lean.shape, SUMS))
    columns[..., 0] = lean
    columns[..., 1] = lean * h * (1.0 / 3.0)
    columns[..., 2] = lean * (h * h + squares) * (1.0 / 12.0)
    columns[..., 3:6] = faces.total * (lean * (1.0 / 3.0))[..., None]
    columns[..., 6:9] = (faces.total * h[..., None] + products) * (lean * (1.0 / 12.0))[..., None]
    sums = above.astype(np.float64) @ columns
    # move the origin of g from the link origin to the surface
    p = levels
    sums[..., 6:9] -= p[..., None] * sums[..., 3:6]
    sums[..., 2] += p * (p * sums[..., 0] - 2.0 * sums[..., 1])
    sums[..., 1] -= p * sums[..., 0]
    return np.asarray(sums)


def _cut(
    faces: _Faces,
    heights: Vector,
    lean: Vector,
    levels: Vector,
    crossing: tuple[NDArray[np.int64], ...],
) -> Vector:
    """Return the triangles at cut corners: added at a lowest corner, subtracted at a highest."""
    n, j, f = crossing
    h = heights[n, :, f]
    p = levels[n, j]
    order = np.argsort(h, axis=1)
    rows = np.arange(len(p))
    top = h[rows, order[:, 1]] < p
    apex, mid = np.where(top, order[:, 2], order[:, 0]), order[:, 1]
    far = 3 - apex - mid
    g = h[rows, apex] - p
    # shares of the two edges at the apex that lie on its side of the surface; the tip has
    # alpha beta of the face's area, and g vanishes at its other two corners
    alpha = g / (h[rows, apex] - h[rows, mid])
    beta = g / (h[rows, apex] - h[rows, far])
    weight = np.where(top, -lean[n, f], lean[n, f]) * alpha * beta
    a = faces.corners[f, apex]
    spread = (faces.corners[f, mid] - a) * alpha[:, None] + (faces.corners[f, far] - a) * beta[
        :, None
    ]
    terms = np.empty((SUMS, len(p)))
    terms[0] = weight
    terms[1] = weight * g * (1.0 / 3.0)
    terms[2] = weight * g * g * (1.0 / 6.0)
    terms[3:6] = (a + spread * (1.0 / 3.0)).T * weight
    terms[6:9] = (4.0 * a + spread).T * (weight * g * (1.0 / 12.0))
    if levels.size == 1:
        return np.asarray(terms.sum(axis=1)[None, None, :])
    cell = n * levels.shape[1] + j
    sums = [np.bincount(cell, weights=term, minlength=levels.size) for term in terms]
    return np.asarray(np.stack(sums, axis=-1).reshape(*levels.shape, SUMS), dtype=np.float64)


PLAN_LEVELS = 129
"""Levels searched for the largest horizontal section."""


def placed_points(points: Vector, position: Sequence[float], rpy: Sequence[float]) -> Vector:
    """Return points (N, 3) rotated by ``rpy`` and shifted by ``position`` into link axes."""
    axes = np.array(axes_of(rpy))
    moved = np.asarray(points, dtype=np.float64) @ axes
    return np.asarray(moved + np.array(checked_triple("position", position)))


class HullMesh:
    """A closed, outward-wound triangle mesh, cut exactly by the surface plane.

    It trusts its input: :func:`seals.hydrostatics.hull_from_mesh` is the door that checks.

    Args:
        vertices: [m], shape (V, 3).
        faces: vertex numbers of each triangle, shape (F, 3), counter-clockwise seen from outside.
        position: origin of the mesh in link axes [m].
        rpy: roll, pitch, yaw of the mesh in the link [rad].

    Raises:
        RobotError: the mesh encloses no volume, or is wound inwards.

    Example:
        >>> corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        >>> wedge = HullMesh(vertices=corners, faces=[(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
        >>> round(wedge.wetted((0, 0, 1), 0.5).volume * 48, 12)
        7.0
    """

    def __init__(
        self,
        *,
        vertices: Vector | Sequence[Sequence[float]],
        faces: NDArray[np.int64] | Sequence[Sequence[int]],
        position: Sequence[float] = (0.0, 0.0, 0.0),
        rpy: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        points = placed_points(np.asarray(vertices, dtype=np.float64), position, rpy)
        self.faces = _Faces(points[np.asarray(faces, dtype=np.int64)])
        self.vertices = np.unique(self.faces.corners.reshape(-1, 3), axis=0)
        self.reach = float(np.sqrt((self.vertices**2).sum(axis=1).max()))
        above = np.array([[2.0 * self.reach + 1.0]])
        whole = self.cut(np.array([[0.0, 0.0, 1.0]]), above)[0, 0]
        self.volume = float(whole[0])
        if self.volume <= 0.0:
            raise RobotError(
                f"the mesh encloses {self.volume:.3g} m^3.\n"
                "Orient its faces counter-clockwise as seen from outside, or use hull_from_mesh."
            )
        self.centroid: Vector = frozen(*(whole[1:4] / self.volume).tolist())
        self._full = Wetted(self.volume, self.centroid, 0.0, ZERO)

    @property
    def plan_area(self) -> float:
        """Largest horizontal section with the body upright [m^2], the greatest of 129 levels."""
        z = self.vertices[:, 2]
        inset = (np.arange(PLAN_LEVELS) + 0.5) / PLAN_LEVELS
        levels = z.min() + (z.max() - z.min()) * inset
        return float(self.cut(np.array([[0.0, 0.0, 1.0]]), levels[None])[..., 4].max())

    def wetted(self, up: Sequence[float] | Vector, level: float) -> Wetted:
        """Return the part below the surface, see `Hull`."""
        if level <= -self.reach:
            return DRY
        if level >= self.reach:
            return self._full
        normal = np.asarray(up, dtype=np.float64)
        sums = self.cut(normal[None], np.array([[level]], dtype=np.float64))[0, 0]
        return wetted_of(Sums(*sums.tolist()), self.volume)

    resolution = None

    @property
    def grain(self) -> int:
        """Number of faces, the cost of one cut."""
        return len(self.faces.corners)

    def spread(self) -> Vector:
        """Return the second moments of the volume about its centroid, per volume [m^2], (3, 3)."""
        corners = self.faces.corners - self.centroid
        total = corners.sum(axis=1)
        # a face and the centroid make a tetrahedron of volume (N . corner) / 3, N the area vector
        volumes = np.einsum("if,fi->f", self.faces.vectors, corners[:, 0]) / 3.0
        squares = np.einsum("f,fci,fcj->ij", volumes, corners, corners)
        squares += np.einsum("f,fi,fj->ij", volumes, total, total)
        return np.asarray(squares / (20.0 * self.volume))

    def extents(self, ups: Vector) -> tuple[Vector, Vector]:
        """Return lowest and highest point of the hull along each normal [m], shape (N,) each."""
        along = np.asarray(ups) @ self.vertices.T
        return along.min(axis=1), along.max(axis=1)

    def cut(self, ups: Vector, levels: Vector) -> Vector:
        """Return volume, moments, area and area moments, shape (normals, levels, 8)."""
        return _clip_mesh(self.faces, ups, levels)
