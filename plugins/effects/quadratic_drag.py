"""Drag proportional to the square of speed, per body axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from seals.arrays import Array
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.effects.identification import Addition, Comparison, Identification, Stage, Subject
from seals.effects.power_law import power_law_additions
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.schema import param


@dataclass(kw_only=True)
class DragQuadratic(Effect):
    """Quadratic drag along the body axes: form drag of bluff bodies.

    Equation:
        F_i = -c_i abs(v_r,i) v_r,i with c_i = rho C_d A_i / 2 and v_r the velocity of the link
        origin relative to the medium; times the share of the medium.

    Args:
        coefficient_x: c along body x [N s^2/m^2].
        coefficient_y: c along body y [N s^2/m^2].
        coefficient_z: c along body z [N s^2/m^2].
        medium: water, air or any.
        links: links it acts on, the root by default.
        correction: see `seals.effects.Effect`.

    Assumptions:
        Axes are uncoupled; the force acts on the link origin; density is inside the coefficient.

    Valid range:
        Reynolds numbers from about 1e3 to the drag crisis (2e5 for a smooth sphere).

    Limitations:
        No drag crisis, no lift, no memory of the wake.

    References:
        Fossen 2011, ch. 6; Hoerner 1965, Fluid-Dynamic Drag.

    Example:
        >>> DragQuadratic(coefficient_z=20.0, medium=MediumKind.water).coefficient_z
        20.0
    """

    coefficient_x: float = param(
        0.0,
        "N s^2/m^2",
        bounds=(0.0, 1e5),
        tolerance=0.08,
        relative=True,
        source="zero unless the vehicle states it",
    )
    coefficient_y: float = param(
        0.0,
        "N s^2/m^2",
        bounds=(0.0, 1e5),
        tolerance=0.08,
        relative=True,
        source="zero unless the vehicle states it",
    )
    coefficient_z: float = param(
        0.0,
        "N s^2/m^2",
        bounds=(0.0, 1e5),
        tolerance=0.08,
        relative=True,
        source="zero unless the vehicle states it",
    )
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("quadratic drag",)
    zero_when_dry: ClassVar[bool] = True
    identification: ClassVar[Identification] = Identification(
        confounders=("linear_drag",),
        resists=True,
        may_begin=True,
        may_end=True,
        family="drag",
        compared=Comparison(
            order=(Stage.water, 8),
            media=(
                "water",
                "air",
            ),
            scales={"coefficient": lambda s: 0.2 * s.weight / s.speed**2},
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidates: drag in each medium; its exponent has a tolerance."""
        return power_law_additions(
            cls, name, subject, power=2, share={MediumKind.water: 3.0, MediumKind.air: 0.01}
        )

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Force against the relative velocity [N]."""
        relative = motion.velocity - medium.velocity
        return Wrench(
            abs(relative) * relative * params["coefficient"] * -medium.medium_fraction, None
        ), memory
