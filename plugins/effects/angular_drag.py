"""Rotational damping, linear and quadratic, per body axis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Array
from seals.effects import Addition, Comparison, Identification, Stage, Subject, along_axes
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.schema import param

_LIMITS: dict[str, Any] = {
    "bounds": (0.0, 1e11),
    "tolerance": 0.15,
    "relative": True,
    "source": "zero unless stated for the vehicle",
}


@dataclass(kw_only=True)
class DragAngular(Effect):
    """Rotational damping about the body axes.

    Equation:
        T_i = -d_i w_i - e_i abs(w_i) w_i; times the share of the medium.

    Args:
        coefficient_x: d about body x [N m s/rad].
        coefficient_y: d about body y [N m s/rad].
        coefficient_z: d about body z [N m s/rad].
        quadratic_x: e about body x [N m s^2/rad^2].
        quadratic_y: e about body y [N m s^2/rad^2].
        quadratic_z: e about body z [N m s^2/rad^2].
        medium: water, air or any.

    Assumptions:
        The medium does not rotate; axes are uncoupled.

    Valid range:
        As the linear and quadratic drags it stands for.

    Limitations:
        No force from rotation (for example of an appendage off the origin).

    References:
        Fossen 2011, ch. 6.

    Example:
        >>> DragAngular(coefficient_z=0.02).coefficient_z
        0.02
    """

    coefficient_x: float = param(0.0, "N m s/rad", **_LIMITS)
    coefficient_y: float = param(0.0, "N m s/rad", **_LIMITS)
    coefficient_z: float = param(0.0, "N m s/rad", **_LIMITS)
    quadratic_x: float = param(0.0, "N m s^2/rad^2", **_LIMITS)
    quadratic_y: float = param(0.0, "N m s^2/rad^2", **_LIMITS)
    quadratic_z: float = param(0.0, "N m s^2/rad^2", **_LIMITS)
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("angular drag",)
    zero_when_dry: ClassVar[bool] = True
    identification: ClassVar[Identification] = Identification(
        resists=True,
        may_begin=True,
        may_end=True,
        answers=True,
        needs_motion=1,
        compared=Comparison(
            order=(Stage.water, 9),
            media=(
                "water",
                "air",
            ),
            scales={
                "coefficient": lambda s: 0.1 * s.mass * s.reach**2,
                "quadratic": lambda s: 0.1 * s.mass * s.reach**2,
            },
            laws={"coefficient": "linear", "quadratic": "quadratic"},
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidates of each medium: linear; quadratic where no such part is stated.

        A stated quadratic part has a tolerance.
        """
        return [one for medium in subject.media for one in cls._forms(name, subject, medium)]

    @classmethod
    def _forms(cls, name: str, subject: Subject, medium: MediumKind) -> list[Addition]:
        nominal = subject.nominal(name, "coefficient", medium)
        squared = subject.nominal(name, "quadratic", medium)
        spread, inertia = subject.spread(f"{name}_coefficient"), np.diag(subject.robot.inertia[0])
        size = np.maximum(0.5 * nominal, 2.0 * inertia)
        linear = along_axes("coefficient", spread * nominal, size, low=-nominal)
        # with less than none of it a rotation would feed itself
        square = along_axes(
            "quadratic", spread * squared, np.maximum(squared, inertia), low=-squared
        )
        usual = Addition(
            instance=f"{name}_{medium.value}_change",
            effect=cls(medium=medium),
            parameters={**linear, **square},
            named=tuple(linear),
            variant={"medium": int(medium is MediumKind.water)},
            order=(Stage.flow, subject.media.index(medium), 2),
        )
        if squared.any():
            return [usual]
        stem = usual.instance.removesuffix("change")
        found = [replace(usual, parameters=linear)]
        for law, freed in (("quadratic", square), ("linear and quadratic", {**linear, **square})):
            found.append(
                replace(
                    usual,
                    instance=stem + law.replace(" ", "_"),
                    effect=cls(medium=medium),
                    parameters=freed,
                    named=tuple(freed),
                    law=law,
                )
            )
        return found

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Torque against the angular velocity [N m]."""
        rate = motion.angular_velocity
        slope = params["coefficient"] + params["quadratic"] * abs(rate)
        return Wrench(None, slope * rate * -medium.medium_fraction), memory
