"""Hull of several primitives, with stated totals that override their sum."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from seals.errors import RobotError
from seals.hydrostatics.placed import checked_triple
from seals.hydrostatics.wetted import DRY, GRAIN, ZERO, Hull, Vector, Wetted, frozen

PLAN_LEVELS = 129
"""Levels searched for the largest horizontal section."""


class HullCompound:
    """Hull made of several hulls; stated totals scale its volume and shift its centroid.

    Equation: V = k sum V_i, k = displaced_volume / sum of whole volumes; waterplane area k sum A_i;
        centroid = centroid of the sum + (centre_of_buoyancy - centroid of the whole sum).

    Assumptions: parts do not overlap, or the stated volume accounts for it.

    Limitations: a shifted centroid with an unshifted waterline is not exactly conservative while
        the hull is partly wet and turning: the work over a closed cycle is of the order of the
        shift. With ``shift_geometry`` the parts are moved instead: exactly conservative, but the
        draught moves too.

    Args:
        parts: the primitives.
        displaced_volume: stated whole volume [m^3]; None keeps the sum.
        centre_of_buoyancy: stated centroid of the whole hull [m]; None keeps that of the sum.
        plan_area: stated plan area [m^2]; None takes the largest horizontal section of the sum.
        shift_geometry: move the parts, not only the centroid, to the stated centre of buoyancy.

    Raises:
        RobotError: no parts, or a stated value is not positive and finite.

    Example:
        >>> from seals.hydrostatics import HullSphere
        >>> pair = [HullSphere(radius=0.1, position=(x, 0, 0)) for x in (-0.2, 0.2)]
        >>> HullCompound(parts=pair, displaced_volume=0.01).volume
        0.01
    """

    grain = GRAIN

    def __init__(
        self,
        *,
        parts: Sequence[Hull],
        displaced_volume: float | None = None,
        centre_of_buoyancy: Sequence[float] | None = None,
        plan_area: float | None = None,
        shift_geometry: bool = False,
    ) -> None:
        if not parts:
            raise RobotError("a compound hull has no parts.\nGive at least one primitive.")
        for name, value in (("displaced_volume", displaced_volume), ("plan_area", plan_area)):
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise RobotError(
                    f"hull {name}={value} is not allowed.\nAllowed: a positive number, or none."
                )
        self.parts = tuple(parts)
        raw = sum(part.volume for part in self.parts)
        middle = sum((part.volume * part.centroid for part in self.parts), np.zeros(3)) / raw
        stated = middle if centre_of_buoyancy is None else centre_of_buoyancy
        self.centroid: Vector = frozen(*checked_triple("centre_of_buoyancy", list(stated)))
        self.volume = raw if displaced_volume is None else float(displaced_volume)
        self.scale = self.volume / raw
        shift = np.asarray(self.centroid - middle)
        self.lift: Vector = frozen(*shift) if shift_geometry else ZERO
        self.shift: Vector = ZERO if shift_geometry else frozen(*shift)
        self.reach = max(part.reach for part in self.parts) + float(np.sqrt(self.lift @ self.lift))
        self.stated_plan_area = plan_area
        self._full = Wetted(self.volume, self.centroid, 0.0, ZERO)

    @property
    def plan_area(self) -> float:
        """Stated plan area [m^2], else the largest horizontal section of the sum."""
        if self.stated_plan_area is not None:
            return self.stated_plan_area
        levels = set(np.linspace(-self.reach, self.reach, PLAN_LEVELS).tolist())
        levels |= {float(part.centroid[2] + self.lift[2]) for part in self.parts}
        return max(self.wetted((0.0, 0.0, 1.0), level).waterplane_area for level in levels)

    def wetted(self, up: Sequence[float] | Vector, level: float) -> Wetted:
        """Return the part below the surface, see `Hull`."""
        if level <= -self.reach:
            return DRY
        if level >= self.reach:
            return self._full
        ux, uy, uz = up
        lx, ly, lz = self.lift.tolist()
        # parts moved by `lift` see the surface lower by its share along the normal
        below = float(level - (ux * lx + uy * ly + uz * lz))
        volume = area = 0.0
        moment, area_moment = np.zeros(3), np.zeros(3)
        for part in self.parts:
            wet = part.wetted(up, below)
            volume += wet.volume
            moment += wet.volume * wet.centroid
            area += wet.waterplane_area
            area_moment += wet.waterplane_area * wet.waterplane_centroid
        if volume <= 0.0:
            return DRY
        # `shift` moves the centroid alone, not the waterline: see the limitations
        centroid = moment / volume + self.shift + self.lift
        flat = area_moment / area + self.lift if area > 0.0 else ZERO
        return Wetted(volume * self.scale, centroid, area * self.scale, flat)
