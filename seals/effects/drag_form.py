"""Forms of quadratic drag: where it acts on the body, and the speed in each component."""

from __future__ import annotations

from enum import Enum
from functools import cache
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.hydrostatics import HullBox, HullCapsule, HullCylinder, HullSphere
from seals.hydrostatics.wetted import Hull

STRIPS = 16
"""Strips along a slender hull: force and moment within 2e-4 of the integral over it."""
_ROWS = 4
"""Rows of points across a face."""
_ALIGNED = 1e-3
"""Largest direction cosine between axes that count as perpendicular [1]."""


class DragForm(Enum):
    """Form of quadratic drag: where it acts on the body, and the speed |v| in -c |v| v_i."""

    per_axis = "per_axis"
    isotropic = "isotropic"
    cross_flow = "cross_flow"
    faces = "faces"


class HullAxis(Enum):
    """Body axis along which a slender hull lies."""

    x = "x"
    y = "y"
    z = "z"


def speed_squares(form: DragForm, axis: HullAxis) -> Floats:
    """Return S, shape (3, 3): (v_x^2, v_y^2, v_z^2) S is the squared speed for each axis.

    Example:
        >>> speed_squares(DragForm.cross_flow, HullAxis.x)
        array([[1., 0., 0.],
               [0., 1., 1.],
               [0., 1., 1.]])
    """
    if form is DragForm.per_axis:
        return np.eye(3)
    if form is not DragForm.cross_flow:
        return np.ones((3, 3))
    across = 1.0 - np.eye(3)[_INDEX[axis]]
    return np.outer(across, across) + np.diag(1.0 - across)


@cache
def drag_points(form: DragForm, axis: HullAxis) -> tuple[Floats, Floats]:
    """Return points of application and their weights along each axis, shape (K, 3) each.

    Points are in units of the body's size from its centre; weights sum to one along each axis.

    Example:
        >>> points, weights = drag_points(DragForm.isotropic, HullAxis.x)
        >>> points, weights
        (array([[0., 0., 0.]]), array([[1., 1., 1.]]))
    """
    if form is DragForm.cross_flow:
        place, share = _gauss(STRIPS)
        points = np.outer(place, np.eye(3)[_INDEX[axis]])
        return points, np.repeat(share[:, None], 3, axis=1)
    if form is not DragForm.faces:
        return np.zeros((1, 3)), np.ones((1, 3))
    place, share = _gauss(_ROWS)
    first, second = (grid.ravel() for grid in np.meshgrid(place, place))
    area = np.outer(share, share).ravel()
    pair = np.stack((np.zeros_like(first), first, second), axis=1)
    # opposite faces share their normal velocity: one plate through the centre for each axis
    points = np.concatenate([np.roll(pair, k, axis=1) for k in range(3)])
    return points, np.concatenate([np.outer(area, np.eye(3)[k]) for k in range(3)])


def form_of_hull(hull: Hull | None) -> dict[str, Any]:
    """Return the options of quadratic drag for a hull of one shape aligned with the link axes.

    Spheres are isotropic, cylinders and capsules in cross-flow, boxes have faces; empty for
    everything else.

    Example:
        >>> form_of_hull(HullSphere(radius=0.05))["form"]
        <DragForm.isotropic: 'isotropic'>
        >>> form_of_hull(HullCapsule(radius=0.1, length=1.0))["size_z"]
        1.2
    """
    if isinstance(hull, HullSphere):
        return {"form": DragForm.isotropic, **_along("position", hull.position)}
    if isinstance(hull, HullBox):
        form, own = DragForm.faces, np.asarray(hull.size, dtype=float)
    elif isinstance(hull, HullCylinder | HullCapsule):
        caps = 2.0 * hull.radius if isinstance(hull, HullCapsule) else 0.0
        form, own = DragForm.cross_flow, np.array([0.0, 0.0, hull.length + caps])
    else:
        return {}
    turn = np.abs(np.asarray(hull.axes))
    if np.abs(turn - np.round(turn)).max() > _ALIGNED:
        return {}
    size = own @ np.round(turn)
    longest = list(HullAxis)[int(np.argmax(size))]
    lies = {"axis": longest} if form is DragForm.cross_flow else {}
    return {"form": form, **lies, **_along("size", size), **_along("position", hull.position)}


_INDEX = {axis: k for k, axis in enumerate(HullAxis)}


def _along(stem: str, values: Any) -> dict[str, float]:
    return {f"{stem}_{a.value}": float(x) for a, x in zip(HullAxis, values, strict=True)}


def _gauss(count: int) -> tuple[Floats, Floats]:
    """Gauss-Legendre nodes within -1/2 ... 1/2 and their weights, one rule for each half.

    Squares of a speed that changes its sign in the middle, as in turning, are integrated exactly.
    """
    place, weight = np.polynomial.legendre.leggauss(count // 2)
    ahead, share = 0.25 * (1.0 + place), 0.25 * weight
    return np.concatenate((-ahead[::-1], ahead)), np.concatenate((share[::-1], share))
