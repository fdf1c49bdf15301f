"""Change of all thrusts and reaction torques."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seals.effects import Addition, Comparison, Freed, Identification, Property, Stage, Subject
from seals.effects.effect import Effect, Parameters
from seals.motion import Drives, Inputs, Medium, Motion
from seals.schema import param


@dataclass(kw_only=True)
class ThrustCoefficient(Effect):
    """Relative change of thrust and reaction torque, common to all actuators.

    Equation:
        T = T_free (1 + f), Q = Q_free (1 + f).

    Args:
        relative_change: f [1].
        links: the link of the actuators it changes, the root by default.

    Assumptions:
        The same change for all, at every speed.

    Valid range:
        Other propellers, other air density, worn blades.

    Limitations:
        No change between actuators, see ``weak_rotor``.

    References:
        Leishman 2006, Principles of Helicopter Aerodynamics, ch. 2.

    Example:
        >>> ThrustCoefficient(relative_change=-0.1).relative_change
        -0.1
    """

    relative_change: float = param(
        0.0,
        "1",
        bounds=(-0.9, 5.0),
        tolerance=0.006,
        source="zero: the map of the actuator applies",
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("thrust coefficient",)
    identification: ClassVar[Identification] = Identification(
        may_begin=True,
        may_end=True,
        confounders=("payload", "battery_sag", "wind", "ground_effect"),
        data_sheet="thrust and mass",
        answers=True,
        measurement="A thrust stand would distinguish them.",
        words={"relative_change": "thrust of all actuators"},
        compared=Comparison(order=(Stage.joints, 1)),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a common change of all thrusts."""
        if not len(subject.lag):
            return []
        change = Freed(
            tolerance=subject.spread(name), scale=0.1, changes=cls._stated(name, subject)
        )
        order = (Stage.actuators, 0, 0)
        return [
            Addition(
                instance=name, effect=cls(), parameters={"relative_change": change}, order=order
            )
        ]

    @staticmethod
    def _stated(name: str, subject: Subject) -> Property | None:
        """Coefficient of the actuator that states one; its mean where drives differ."""
        found = [getattr(e, name) for e in subject.effects.values() if hasattr(e, name)]
        if len(found) != 1:
            return None
        value = float(np.mean(found[0]))
        return Property(
            name=name, value=value, unit="N/(rad/s)^2", section="actuators", slope=value
        )

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Thrusts [N] and reaction torques [N m] after the change."""
        gain = 1.0 + params["relative_change"]
        return drives._replace(thrust=drives.thrust * gain, torque=drives.torque * gain)
