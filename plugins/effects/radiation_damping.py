"""Radiation damping: loss by the waves that a moving hull generates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from seals.arrays import Array
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.effects.identification import Comparison, Identification, Stage
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.schema import param

_LIMITS: dict[str, Any] = {
    "bounds": (0.0, 1e6),
    "tolerance": 0.2,
    "relative": True,
    "source": "zero unless stated for the vehicle",
}


@dataclass(kw_only=True)
class DampingRadiation(Effect):
    """Radiation damping of a surface-piercing hull, linear in its velocity.

    Equation:
        F_i = -b_i v_r,i w, T_i = -d_i w_i w with the weight w = 4 s (1 - s), one for a hull half
        submerged and zero for one in air or deep under water.

    Args:
        coefficient_x: b along body x [N s/m].
        coefficient_y: b along body y [N s/m].
        coefficient_z: b along body z [N s/m].
        angular_x: d about body x [N m s/rad].
        angular_y: d about body y [N m s/rad].
        angular_z: d about body z [N m s/rad].
        medium: water.

    Assumptions:
        One frequency: coefficients are those at the frequency of the motion, without memory. A hull
        that floats with 54 % of its volume submerged has the weight 0.99, so that coefficients may
        be read from a decay test of it.

    Valid range:
        Motion near one frequency, amplitudes small against the hull.

    Limitations:
        No dependence on frequency, no added mass of radiation; the weight is chosen, not derived.

    References:
        Newman 1977, Marine Hydrodynamics, ch. 6; Faltinsen 1990, Sea Loads on Ships and Offshore
        Structures, ch. 3.

    Example:
        >>> DampingRadiation(coefficient_z=12.0).coefficient_z
        12.0
    """

    coefficient_x: float = param(0.0, "N s/m", **_LIMITS)
    coefficient_y: float = param(0.0, "N s/m", **_LIMITS)
    coefficient_z: float = param(0.0, "N s/m", **_LIMITS)
    angular_x: float = param(0.0, "N m s/rad", **_LIMITS)
    angular_y: float = param(0.0, "N m s/rad", **_LIMITS)
    angular_z: float = param(0.0, "N m s/rad", **_LIMITS)
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("radiation damping",)
    # told from drag only by several runs
    identification: ClassVar[Identification] = Identification(
        confounders=("linear_drag", "angular_drag"),
        searched=False,
        compared=Comparison(
            order=(Stage.water, 4),
            media=("water",),
            scales={
                "coefficient": lambda s: s.weight / s.speed,
                "angular": lambda s: s.weight * s.reach / s.speed,
            },
        ),
    )

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Force and torque against the motion relative to the water [N, N m]."""
        relative = motion.velocity - medium.velocity
        weight = -4.0 * medium.submersion * (1.0 - medium.submersion)
        force = params["coefficient"] * relative * weight
        return Wrench(force, params["angular"] * motion.angular_velocity * weight), memory
