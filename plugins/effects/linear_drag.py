"""Drag proportional to speed, per body axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from seals.arrays import Array, Floats
from seals.effects.drag_form import DRAWING, OTHERS, is_spread, power_law_additions, turning_slope
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.effects.identification import Addition, Comparison, Identification, Stage, Subject
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.schema import param

_LIMITS: dict[str, Any] = {
    "bounds": (0.0, 1e7),
    "tolerance": 0.08,
    "relative": True,
    "source": "zero unless stated for the vehicle",
}


@dataclass(kw_only=True)
class DragLinear(Effect):
    """Linear drag along the body axes, as used for slow multirotors and laminar skin friction.

    Equation:
        F_i = -c_i v_r,i with v_r the velocity of the link origin relative to the medium; times the
        share of the medium. Where the drag acts spread about the origin, at places whose mean
        squares are s, it brakes the rotation, too: T_i = -w_i (c_j s_k + c_k s_j), j and k the
        other two axes.

    Args:
        coefficient_x: c along body x [N s/m].
        coefficient_y: c along body y [N s/m].
        coefficient_z: c along body z [N s/m].
        spread_x: s along body x [m^2].
        spread_y: along y [m^2].
        spread_z: along z [m^2].
        medium: water, air or any.

    Assumptions:
        Axes are uncoupled; the force acts on the link origin.

    Valid range:
        Reynolds numbers below about 1, or rotor-induced drag of slow multirotors.

    Limitations:
        Underestimates drag at speed; add ``quadratic_drag``.

    References:
        Fossen 2011, ch. 6; Jacinto et al. 2023 (Pegasus simulator) for multirotors.

    Example:
        >>> DragLinear(coefficient_x=0.3).coefficient_x
        0.3
    """

    coefficient_x: float = param(0.0, "N s/m", **_LIMITS)
    coefficient_y: float = param(0.0, "N s/m", **_LIMITS)
    coefficient_z: float = param(0.0, "N s/m", **_LIMITS)
    spread_x: float = param(0.0, "m^2", **DRAWING)
    spread_y: float = param(0.0, "m^2", **DRAWING)
    spread_z: float = param(0.0, "m^2", **DRAWING)
    medium: MediumKind = MediumKind.air
    accounts_for: ClassVar[tuple[str, ...]] = ("linear drag",)
    identification: ClassVar[Identification] = Identification(
        confounders=("rotor_drag", "quadratic_drag"),
        resists=True,
        may_begin=True,
        may_end=True,
        needs_motion=0,
        family="drag",
        power=1,
        compared=Comparison(
            order=(Stage.water, 7),
            media=(
                "water",
                "air",
            ),
            scales={"coefficient": lambda s: 0.2 * s.weight / s.speed},
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidates: drag in each medium; its exponent has a tolerance."""
        return power_law_additions(
            cls, name, subject, power=1, share={MediumKind.water: 2.0, MediumKind.air: 0.03}
        )

    def constants(self) -> dict[str, Floats]:
        """Return the sum over other axes, if the drag acts spread or may."""
        return {"others": OTHERS} if is_spread(self) else {}

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Force against the relative velocity [N]."""
        relative = motion.velocity - medium.velocity
        force = relative * params["coefficient"] * -medium.medium_fraction
        if "others" not in params:
            return Wrench(force, None), memory
        slope = params["coefficient"] * -medium.medium_fraction
        return Wrench(force, turning_slope(slope, params) * motion.angular_velocity), memory
