"""Speed of rotors that differs from the stated curve of the motors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seals.arrays import namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Freed, Identification, Stage, Subject
from seals.motion import Drives, Inputs, Medium, Motion
from seals.schema import param

_OFFSET, _SLOPE = 0.2, 0.2
"""Plausible errors of a curve: offset as a share of the speed in hover, and slope."""
_MOST = 0.4
"""Largest such errors: beyond them another law rules, such as the sag of a battery."""
_SLOW = 1.0
"""Speed below which a rotor counts as standing still [rad/s]."""


@dataclass(kw_only=True)
class MotorCurve(Effect):
    """Straight line from the stated speed of all rotors to their true one.

    Equation:
        w = a sign(w_0) + (1 + b) w_0, and T = T_0 (w / w_0)^2, Q = Q_0 (w / w_0)^2, with the speed
        w_0, thrust T_0 and torque Q_0 of the stated model. A rotor that stands still stays so.

    Args:
        offset: a [rad/s].
        slope_change: b [1].
        links: the link of the actuators it changes, the root by default.

    Assumptions:
        The same line for all rotors; the lag is that of the stated speed.

    Valid range:
        Rotors driven by an open-loop signal, whose map to the speed was guessed or measured at
        another voltage: w_0 is ``motors.points`` of that signal.

    Limitations:
        A slope alone acts as ``thrust_coefficient``. No bend of the curve; drives that know their
        force alone are left as they are.

    References:
        Bangura and Mahony 2017, Thrust Control for Multirotor Aerial Vehicles, IEEE T-RO 33(2):
        speed over duty cycle of small motors.

    Example:
        >>> MotorCurve(offset=80.0, slope_change=-0.07).offset
        80.0
    """

    offset: float = param(
        0.0, "rad/s", bounds=(-1e3, 1e3), tolerance=0.0, source="zero: the stated curve applies"
    )
    slope_change: float = param(
        0.0, "1", bounds=(-0.9, 2.0), tolerance=0.0, source="zero: the stated curve applies"
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("motor curve",)
    identification: ClassVar[Identification] = Identification(
        confounders=("thrust_coefficient", "payload", "battery_sag"),
        answers=True,
        measurement="A thrust stand, or a measured speed of the rotors, would distinguish them.",
        words={
            "offset": "offset of the motors' curve",
            "slope_change": "slope of the motors' curve",
        },
        compared=None,
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate, where rotors are driven by a signal and not by a speed.

        Where the voltage is known, the sag of the battery tells how the speed departs from it.
        """
        if not subject.open_loop or subject.full_voltage is not None:
            return []
        found = [e for e in subject.effects.values() if hasattr(e, "thrust_coefficient")]
        if not subject.rotors or len(found) != 1 or not len(subject.lag):
            return []
        gain = float(np.mean(np.asarray(found[0].thrust_coefficient))) * len(subject.lag)
        hover = float(np.sqrt(subject.weight / gain)) if gain > 0.0 else 0.0
        if not hover:
            return []
        return [
            Addition(
                instance=name,
                effect=cls(),
                parameters={
                    "offset": Freed(scale=_OFFSET * hover, bounds=(-_MOST * hover, _MOST * hover)),
                    "slope_change": Freed(scale=_SLOPE, bounds=(-_MOST, _MOST)),
                },
                order=(Stage.actuators, 0, 2),
            )
        ]

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Thrusts [N], torques [N m] and speeds [rad/s] of rotors after the change."""
        if drives.speed is None:
            return drives
        xp, speed = namespace(drives.speed), drives.speed
        turning = abs(speed) > _SLOW
        size = xp.where(turning, abs(speed), xp.ones_like(speed))
        ratio = xp.where(
            turning, 1.0 + params["slope_change"] + params["offset"] / size, xp.ones_like(speed)
        )
        # a line that crosses zero does not turn a rotor back
        ratio = xp.where(ratio > 0.0, ratio, xp.zeros_like(ratio))
        return drives._replace(
            thrust=drives.thrust * ratio * ratio,
            torque=drives.torque * ratio * ratio,
            speed=speed * ratio,
        )
