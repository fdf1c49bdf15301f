"""Loss of thrust with the voltage of the battery."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seals.arrays import Array, namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Freed, Identification, Stage, Subject
from seals.motion import Drives, Inputs, Medium, Motion
from seals.schema import param

_EXPONENT = 0.05
"""Plausible error of the exponent of a battery's sag."""
_LEAST = 0.02
"""Share of the typical shortfall below which the exponent is not felt."""


@dataclass(kw_only=True)
class BatterySag(Effect):
    """Loss of thrust and reaction torque with the terminal voltage.

    Equation:
        T = T_free (1 - k x (x / x_0)^(e - 1)) with x = 1 - V / V_full, the reaction torque
        likewise; nothing changes while the voltage is not known.

    Args:
        sensitivity: k [1].
        full_voltage: V_full [V].
        exponent: e [1]; with 1 the loss is proportional to the missing voltage.
        typical: x_0, missing share of the voltage at which the exponent changes nothing [1].
        links: the link of the actuators it changes, the root by default.

    Assumptions:
        Speed controllers fall short of the commanded speed in proportion to the missing voltage,
        or nearly so.

    Valid range:
        Voltages within some 30 % of the full one.

    Limitations:
        No dependence on the load of the single drive; the lag stays.

    References:
        None needed: a first-order expansion about the full voltage.

    Example:
        >>> BatterySag(sensitivity=1.0, full_voltage=16.4).full_voltage
        16.4
    """

    sensitivity: float = param(
        0.0, "1", bounds=(-5.0, 5.0), tolerance=0.05, source="zero unless stated for the vehicle"
    )
    full_voltage: float = param(
        16.8,
        "V",
        bounds=(0.1, 1e4),
        tolerance=0.0,
        source="four lithium-polymer cells at 4.2 V",
        fit=False,
    )
    exponent: float = param(
        1.0, "1", bounds=(0.5, 2.0), tolerance=0.1, source="first order of a nonlinear curve"
    )
    typical: float = param(
        0.1,
        "1",
        bounds=(1e-4, 1.0),
        tolerance=0.0,
        source="lithium-polymer cells at 3.8 V",
        fit=False,
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("battery sag",)
    identification: ClassVar[Identification] = Identification(
        confounders=("thrust_coefficient",),
        compared=None,
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate, where the full voltage of the battery is known."""
        if not len(subject.lag) or not subject.full_voltage:
            return []
        return [
            Addition(
                instance=name,
                effect=cls(full_voltage=float(subject.full_voltage), typical=subject.shortfall),
                parameters={
                    "sensitivity": Freed(scale=1.0, bounds=(0.0, np.inf)),
                    "exponent": Freed(scale=_EXPONENT, bounds=(-0.4, 0.4)),
                },
                nuisance=("exponent",),
                order=(Stage.actuators, 0, 5),
            )
        ]

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Thrusts [N] and reaction torques [N m] at the voltage."""
        if inputs.voltage is None:
            return drives
        share, exponent = inputs.voltage / params["full_voltage"], params["exponent"]
        if type(exponent) is not np.ndarray or np.any(exponent != 1.0):
            short = 1.0 - share
            xp = namespace(short)
            share = 1.0 - (
                short * xp.clip(abs(short) / params["typical"], _LEAST, None) ** (exponent - 1.0)
            )
        return sagged(drives, share, params["sensitivity"])


def sagged(drives: Drives, share: Array, sensitivity: Array) -> Drives:
    """Return thrusts and torques at a fraction of the full voltage.

    Args:
        drives: at the full voltage.
        share: terminal voltage by full voltage [1], shape (1 or N, 1).
        sensitivity: loss of thrust for a loss of voltage [1], likewise.
    """
    if type(sensitivity) is np.ndarray and not np.count_nonzero(sensitivity):
        return drives
    gain = 1.0 - sensitivity * (1.0 - share)
    speed = drives.speed
    if speed is not None:
        xp = namespace(gain)
        speed = speed * xp.sqrt(xp.clip(gain, 0.0, None))
    return drives._replace(thrust=drives.thrust * gain, torque=drives.torque * gain, speed=speed)
