"""Lift of a body or a wing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from seals.arrays import Array, columns, namespace
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.effects.identification import Comparison, Identification, Stage
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.schema import param


@dataclass(kw_only=True)
class Lift(Effect):
    """Lift in the body's xz plane, perpendicular to the relative velocity.

    Equation:
        L = rho A_L sin(a) cos(a) V^2 / 2 across v_r, with V and the angle of attack a from the x
        and z components of v_r = v - u: sin(a) = -v_r,z / V, cos(a) = v_r,x / V. F = L (-v_r,z, 0,
        v_r,x) / V. Where A_L is not zero, drag of the angle of attack goes with it, D = rho A_D
        sin(a)^2 V^2 / 2 against v_r. Both times the share of the medium.

    Args:
        coefficient: A_L, slope of the lift coefficient times the area it refers to [m^2].
        attack_drag: A_D, growth of the drag coefficient with the square of the angle of attack
            times the same area [m^2].
        medium: water, air or any.

    Assumptions:
        The plane of the wing is the body's xy plane; the force acts on the link origin. sin(a)
        cos(a) is the angle itself for small ones and keeps the law smooth when the flow turns.

    Valid range:
        Angles of attack below stall, about 0.2 rad, where it is within 3 % of a.

    Limitations:
        No stall, no side force, no pitching moment.

    References:
        Merckelbach et al. 2019, Journal of Atmospheric and Oceanic Technology 36(2) (gliders);
        Hoerner and Borst 1975, Fluid-Dynamic Lift.

    Example:
        >>> Lift(coefficient=0.7).coefficient
        0.7
    """

    coefficient: float = param(
        0.0,
        "m^2",
        bounds=(-1e4, 1e4),
        tolerance=0.1,
        relative=True,
        source="zero unless stated for the vehicle",
    )
    attack_drag: float = param(
        0.0,
        "m^2",
        bounds=(0.0, 1e4),
        tolerance=0.2,
        relative=True,
        source="zero unless stated for the vehicle",
        fit=False,
    )
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("lift",)
    # told from added mass only by several runs
    identification: ClassVar[Identification] = Identification(
        confounders=("added_mass",),
        searched=False,
        compared=Comparison(
            order=(Stage.water, 6),
            media=(
                "water",
                "air",
            ),
            scales={"coefficient": lambda s: max(s.reach**2, 1e-3)},
        ),
    )

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Force perpendicular to the relative velocity [N]."""
        relative = motion.velocity - medium.velocity
        ahead, up = relative[:, 0:1], relative[:, 2:3]
        # a nanometre a second keeps the quotient finite at rest, where the force is zero
        xp = namespace(ahead)
        speed = xp.sqrt(ahead * ahead + up * up + 1e-18)
        size = 0.5 * medium.density * params["coefficient"] * medium.medium_fraction
        push = size * (-up * ahead) / speed
        winged = xp.astype(params["coefficient"] != 0.0, ahead.dtype)
        slow = winged * (-0.5 * medium.density * medium.medium_fraction) * params["attack_drag"]
        slow = slow * (up * up / speed)
        force_x = (-up * push + ahead * slow)[:, 0]
        force_z = (ahead * push + up * slow)[:, 0]
        return Wrench(columns(force_x, force_x * 0.0, force_z), None), memory
