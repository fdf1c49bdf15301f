"""Slamming: impact force while a hull enters the water."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from seals.arrays import Array
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.effects.identification import Addition, Comparison, Freed, Identification, Stage, Subject
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.schema import param


@dataclass(kw_only=True)
class Slamming(Effect):
    """Slamming force with one coefficient, while a hull sinks through the surface.

    Equation:
        F = rho C_s A w_n^2 / 2 * 4 s (1 - s) along the water normal, only while w_n > 0; w_n is
        the sinking speed of the link origin and A the plan area of the hull.

    Args:
        coefficient: C_s [1].
        medium: water.

    Assumptions:
        The force acts on the link origin; its course over the entry follows 4 s (1 - s), whose
        mean over s is 2/3.

    Valid range:
        Entry at moderate deadrise; impulse good to a few per cent, the peak only in size.

    Limitations:
        No air cushion, no spray, no oblique entry; nothing when the body leaves the water. A is
        that of the upright hull whatever its attitude: one that falls on a smaller face gets too
        much.

    References:
        von Karman 1929, NACA TN 321; Faltinsen 1990, Sea Loads on Ships and Offshore Structures,
        ch. 9.

    Example:
        >>> Slamming(coefficient=1.2).coefficient
        1.2
    """

    coefficient: float = param(
        0.0,
        "1",
        bounds=(0.0, 20.0),
        tolerance=0.2,
        relative=True,
        source="zero unless stated for the vehicle",
    )
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("slamming",)
    identification: ClassVar[Identification] = Identification(
        confounders=("added_mass",),
        compared=Comparison(
            order=(Stage.water, 3), media=("water",), scales={"coefficient": lambda _: 1.0}
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate, for a hull where there is water."""
        if not subject.has_water:
            return []
        size = Freed(scale=1.0, bounds=(0.0, math.inf))
        return [
            Addition(
                instance=f"{name}_change",
                effect=cls(),
                parameters={"coefficient": size},
                order=(Stage.water, 0, 4),
            )
        ]

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Force along the normal of the water surface during entry [N]."""
        s = medium.submersion
        entering = 0.5 * (medium.sinking_speed + abs(medium.sinking_speed))
        scale = medium.density * motion.body.plan_area * params["coefficient"]
        pressure = entering * entering * (2.0 * s * (1.0 - s))
        return Wrench(medium.normal * (scale * pressure), None), memory
