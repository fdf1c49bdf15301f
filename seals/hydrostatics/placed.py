"""Base of the closed-form primitives, with their pose in the link."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.errors import RobotError
from seals.hydrostatics.wetted import (
    DRY,
    FLOATS,
    GRAIN,
    ZERO,
    Column,
    Sums,
    Vector,
    Wetted,
    frozen,
    unit_up,
    wetted_of,
)

Triple = tuple[float, float, float]


def checked_size(name: str, value: float) -> float:
    """Return a dimension [m] as float, or refuse it.

    Raises:
        RobotError: the dimension is not a positive finite number.
    """
    number = float(value)
    if not math.isfinite(number) or number <= 0.0:
        raise RobotError(
            f"hull {name}={value} is not allowed.\nAllowed: a positive finite length in metres."
        )
    return number


def checked_triple(name: str, values: Sequence[float]) -> Triple:
    """Return three finite floats, or refuse them.

    Raises:
        RobotError: not exactly three finite numbers.
    """
    numbers = [float(value) for value in values]
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise RobotError(f"hull {name}={list(values)} is not allowed.\nGive three finite numbers.")
    return numbers[0], numbers[1], numbers[2]


def axes_of(rpy: Sequence[float]) -> tuple[Triple, Triple, Triple]:
    """Return the primitive's x, y and z axes in link axes, R = Rz(yaw) Ry(pitch) Rx(roll).

    Args:
        rpy: roll, pitch, yaw [rad].
    """
    roll, pitch, yaw = checked_triple("rpy", rpy)
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return (
        (cy * cp, sy * cp, -sp),
        (cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr),
        (cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr),
    )


class HullPlaced(ABC):
    """Base of centrally symmetric primitives with a closed form, posed in their link.

    Args:
        volume: whole volume [m^3].
        radius: radius of the bounding sphere about the primitive's own centre [m].
        position: centre of the primitive in link axes [m].
        rpy: roll, pitch, yaw of the primitive in the link [rad].
    """

    grain = GRAIN

    def __init__(
        self, *, volume: float, radius: float, position: Sequence[float], rpy: Sequence[float]
    ) -> None:
        self.position = checked_triple("position", position)
        self.axes = axes_of(rpy)
        self.volume = volume
        self.centroid: Vector = frozen(*self.position)
        self.reach = math.hypot(*self.position) + radius
        self._full = Wetted(volume, self.centroid, 0.0, ZERO)

    @abstractmethod
    def sums(self, xp: Any, ux: Column, uy: Column, uz: Column, level: Column) -> Sums:
        """Return volume, area and first moments about the link origin.

        Args:
            xp: an array namespace, or ``FLOATS`` for Python floats.
            ux: surface normal, x component, float or (N,).
            uy: y component.
            uz: z component.
            level: height of the surface above the link origin along the normal [m], float or (N,).
        """

    @property
    def plan_area(self) -> float:
        """Largest horizontal section with the body upright [m^2]: the one through the centre."""
        # of a centrally symmetric convex body (Brunn's theorem)
        return float(self.sums(FLOATS, 0.0, 0.0, 1.0, self.position[2]).area)

    def wetted(self, up: Sequence[float] | Vector, level: float) -> Wetted:
        """Return the part below the surface, see `Hull`."""
        if level <= -self.reach:
            return DRY
        if level >= self.reach:
            return self._full
        ux, uy, uz = unit_up(up)
        return wetted_of(self.sums(FLOATS, ux, uy, uz, float(level)), self.volume)

    def __repr__(self) -> str:
        """Name the primitive, its volume and its place."""
        place = ", ".join(f"{value:g}" for value in np.asarray(self.position))
        return f"{type(self).__name__}(volume={self.volume:.6g} m^3, position=({place}) m)"
