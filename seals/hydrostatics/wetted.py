"""Result of a hull query: wetted volume below a plane, centroid, waterplane."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Column = Any
"""A Python float, or one array of shape (N,) of any array library: the laws take either."""


class Wetted(NamedTuple):
    """The part of a hull below the water surface, in link axes about the link origin.

    Args:
        volume: wetted volume [m^3].
        centroid: its centroid [m], shape (3,); zeros when dry.
        waterplane_area: area of the hull's section at the surface [m^2]; equals d(volume)/d(level).
        waterplane_centroid: centroid of that section [m], shape (3,); zeros when there is none.
    """

    volume: float
    centroid: Vector
    waterplane_area: float
    waterplane_centroid: Vector


class Sums(NamedTuple):
    """Volume, area and their first moments about the link origin, as floats or columns (N,)."""

    volume: Column
    moment_x: Column
    moment_y: Column
    moment_z: Column
    area: Column
    area_x: Column
    area_y: Column
    area_z: Column


GRAIN = 8
"""Cost of one cut of a primitive, in faces of a mesh."""


class Hull(Protocol):
    """Interface of a hull: a body that displaces water.

    The water is the half space ``{x : up . x <= level}``: ``up`` is the unit normal of the surface
    in link axes, ``level`` [m] the signed height of the surface above the link origin along ``up``.

    ``plan_area`` [m^2] is the largest horizontal section with the body upright (``up`` = body z),
    the face that meets the water when the body falls level; for bodies whose widest level is one
    flat outline it is the projection along body z. ``reach`` [m] bounds the distance of any point
    of the hull from the link origin.
    """

    @property
    def volume(self) -> float:
        """Displaced volume when fully submerged [m^3]."""

    @property
    def centroid(self) -> Vector:
        """Centre of buoyancy when fully submerged [m], shape (3,)."""

    @property
    def grain(self) -> int:
        """Cost of one cut, in faces of a mesh."""

    @property
    def plan_area(self) -> float:
        """Largest horizontal section with the body upright [m^2]."""

    @property
    def reach(self) -> float:
        """Radius of a sphere about the link origin that holds the hull [m]."""

    def wetted(self, up: Sequence[float] | Vector, level: float) -> Wetted:
        """Return the part below the surface.

        Args:
            up: unit normal of the water surface, link axes, shape (3,).
            level: height of the surface above the link origin along ``up`` [m].
        """


def frozen(x: float, y: float, z: float) -> Vector:
    """Return a read-only vector (3,), safe to share."""
    vector = np.array((x, y, z), dtype=np.float64)
    vector.setflags(write=False)
    return vector


ZERO = frozen(0.0, 0.0, 0.0)
DRY = Wetted(0.0, ZERO, 0.0, ZERO)
EMPTY_SHARE = 1e-13
"""Wetted share of the volume below which a centroid is only rounding, and zeros are returned."""


def wetted_of(sums: Sums, whole: float) -> Wetted:
    """Convert scalar sums to a :class:`Wetted`.

    Args:
        sums: volume, area and moments as floats.
        whole: volume of the whole hull [m^3], the scale below which a result counts as dry.
    """
    volume, mx, my, mz, area, ax, ay, az = sums
    if volume <= EMPTY_SHARE * whole:
        return DRY
    centroid = np.array((mx / volume, my / volume, mz / volume))
    if area <= EMPTY_SHARE * whole ** (2.0 / 3.0):
        return Wetted(volume, centroid, 0.0, ZERO)
    return Wetted(volume, centroid, area, np.array((ax / area, ay / area, az / area)))


class _FloatSpace:
    """The few array functions that the closed forms use, for Python floats.

    A closed form is written once against this vocabulary; it then runs on one float (fast, in the
    simulator's step) and on columns of any array library (in the twin).
    """

    sqrt = staticmethod(math.sqrt)
    asin = staticmethod(math.asin)
    atan2 = staticmethod(math.atan2)
    abs = staticmethod(abs)
    maximum = staticmethod(max)
    minimum = staticmethod(min)

    @staticmethod
    def where(condition: bool, this: float, other: float) -> float:
        """Return ``this`` where the condition holds, else ``other``."""
        return this if condition else other


FLOATS = _FloatSpace()


def unit_up(up: Sequence[float] | Vector) -> tuple[float, float, float]:
    """Return the surface normal as three Python floats, which are faster than array scalars."""
    # Python's own arithmetic on NumPy scalars would take several times as long
    x, y, z = up.tolist() if isinstance(up, np.ndarray) else up
    return x, y, z
