"""Hull of a closed triangle mesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from seals.errors import RobotError
from seals.hydrostatics.clipping import Faces, clip_mesh
from seals.hydrostatics.placed import axes_of, checked_triple
from seals.hydrostatics.wetted import DRY, ZERO, Sums, Vector, Wetted, frozen, wetted_of

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
        self.faces = Faces(points[np.asarray(faces, dtype=np.int64)])
        self.vertices = np.unique(self.faces.corners.reshape(-1, 3), axis=0)
        self.reach = float(np.sqrt((self.vertices**2).sum(axis=1).max()))
        above = np.array([[2.0 * self.reach + 1.0]])
        whole = clip_mesh(self.faces, np.array([[0.0, 0.0, 1.0]]), above)
        self.volume = float(whole.volume[0, 0])
        if self.volume <= 0.0:
            raise RobotError(
                f"the mesh encloses {self.volume:.3g} m^3.\n"
                "Wind its faces counter-clockwise from outside, or use hull_from_mesh."
            )
        self.centroid: Vector = frozen(*(whole.moment[0, 0] / self.volume).tolist())
        self._full = Wetted(self.volume, self.centroid, 0.0, ZERO)

    @property
    def plan_area(self) -> float:
        """Largest horizontal section with the body upright [m^2], the greatest of 129 levels."""
        z = self.vertices[:, 2]
        inset = (np.arange(PLAN_LEVELS) + 0.5) / PLAN_LEVELS
        levels = z.min() + (z.max() - z.min()) * inset
        return float(clip_mesh(self.faces, np.array([[0.0, 0.0, 1.0]]), levels[None]).area.max())

    def wetted(self, up: Sequence[float] | Vector, level: float) -> Wetted:
        """Return the part below the surface, see `Hull`."""
        if level <= -self.reach:
            return DRY
        if level >= self.reach:
            return self._full
        normal = np.asarray(up, dtype=np.float64)
        cut = clip_mesh(self.faces, normal[None], np.array([[level]], dtype=np.float64))
        sums = np.concatenate((cut.volume[0], cut.moment[0, 0], cut.area[0], cut.area_moment[0, 0]))
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
        c = clip_mesh(self.faces, ups, levels)
        return np.concatenate(
            (c.volume[..., None], c.moment, c.area[..., None], c.area_moment), axis=-1
        )
