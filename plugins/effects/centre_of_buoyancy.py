"""Shift of the centre of buoyancy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from seals.arrays import Array
from seals.effects import (
    Addition,
    Comparison,
    Identification,
    Stage,
    Subject,
    addition_along_axes,
)
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.frames import cross
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.schema import param

_LIMITS: dict[str, Any] = {
    "bounds": (-1.0, 1.0),
    "tolerance": 0.001,
    "source": "zero: the centroid of the hull applies",
}


@dataclass(kw_only=True)
class CentreOfBuoyancy(Effect):
    """Shift of the centroid of the displaced volume, fixed to the body.

    Equation:
        T = d x B with B = rho V s (g up + a_water), the lift of the hull as in ``buoyancy``.

    Args:
        offset_x: d along body x [m].
        offset_y: d along body y [m].
        offset_z: d along body z [m].
        medium: the fluid that lifts, water by default.

    Assumptions:
        The same shift for every submerged share; the volume is that of the hull.

    Valid range:
        Shifts small against the hull.

    Limitations:
        Near the surface a real shift also changes the restoring stiffness.

    References:
        Fossen 2011, Handbook of Marine Craft Hydrodynamics, ch. 4.

    Example:
        >>> CentreOfBuoyancy(offset_z=0.01).offset_z
        0.01
    """

    offset_x: float = param(0.0, "m", **_LIMITS)
    offset_y: float = param(0.0, "m", **_LIMITS)
    offset_z: float = param(0.0, "m", **_LIMITS)
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("centre of buoyancy",)
    identification: ClassVar[Identification] = Identification(
        confounders=("centre_of_gravity",),
        words={"offset": "centre of buoyancy"},
        compared=Comparison(
            order=(Stage.water, 1), media=("water",), scales={"offset": lambda s: 0.05 * s.reach}
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a shift of the hull's centre of buoyancy."""
        if not subject.has_water:
            return []
        sizes = subject.spread(name), 0.01
        return addition_along_axes(cls, name, "offset", sizes, (Stage.water, 0, 1))

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Torque of the buoyancy force by the shift [N m]."""
        displaced = medium.density * motion.body.volume * medium.submersion
        lift = (motion.up * medium.gravity + medium.acceleration) * displaced
        return Wrench(None, cross(params["offset"], lift)), memory
