"""Change of the time constant of rotors and thrusters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from seals.effects import Addition, Comparison, Freed, Identification, Property, Stage, Subject
from seals.effects.effect import Effect, Parameters
from seals.motion import Timing
from seals.schema import param

_PLAUSIBLE = 0.03
"""Plausible change of the time constant where none is stated [s]: that of a small rotor."""
_ASYMMETRY = 0.5
"""Plausible difference of rise and fall from their mean, as a share of the change."""

_LEAST = 0.01
"""Stated lag from which on a fit may start at it [s]."""

_NUDGE = 0.004
"""Step of the difference quotient at a stated lag below that [s]."""


@dataclass(kw_only=True)
class RotorLag(Effect):
    """Change of the first-order time constant of all rotors or thrusters.

    Equation:
        w' = (command - w) / (time_constant + d (1 - a)) with w the state of the drive while it
        speeds up, 1 + a while it slows down.

    Args:
        time_constant_change: d [s].
        asymmetry: a [-].
        links: not used; the lag is that of every actuator.

    Assumptions:
        All drives change alike.

    Valid range:
        Time constants that stay positive; the caller holds them so.

    Limitations:
        One time constant for steps of any size.

    References:
        Faessler, Falanga, Scaramuzza 2017, IEEE Robotics and Automation Letters 2(2).

    Example:
        >>> RotorLag(time_constant_change=0.02).time_constant_change
        0.02
    """

    time_constant_change: float = param(
        0.0,
        "s",
        bounds=(-0.5, 0.5),
        tolerance=0.002,
        source="zero: the lag of the actuator applies",
    )
    asymmetry: float = param(
        0.0, "1", bounds=(-1.0, 1.0), tolerance=0.1, source="zero: rise and fall change equally"
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("rotor lag",)
    identification: ClassVar[Identification] = Identification(
        confounders=("command_delay",),
        answers=True,
        words={"time_constant_change": "time constant of the actuators"},
        compared=Comparison(
            order=(Stage.joints, 2), scales={"time_constant": lambda _: _PLAUSIBLE}
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a change of the actuators' time constant, which stays positive."""
        if not len(subject.lag):
            return []
        thrusters, mean = subject.spread("thruster_time_constant"), float(subject.lag.mean())
        change = Freed(
            tolerance=float(subject.tolerance.get("rotor_time_constant", thrusters)),
            # a share of a stated lag of zero would be no size at all
            scale=mean or _PLAUSIBLE,
            bounds=(-0.9 * float(subject.lag.min()), math.inf),
            # the response to a lag far below the step of a log is flat: it needs a longer step
            nudge=_NUDGE if mean < _LEAST else 0.0,
            changes=Property(
                name="time_constant",
                value=mean,
                unit="s",
                section="actuators",
            ),
        )
        return [
            Addition(
                instance=name,
                effect=cls(),
                parameters={
                    "time_constant_change": change,
                    # a motor that slows down more than it speeds up is no second effect; a motor
                    # whose mean does not change is none at all
                    "asymmetry": Freed(scale=_ASYMMETRY, bounds=(-1.0, 1.0)),
                },
                nuisance=("asymmetry",),
                # a lag below the step of a log hardly has a slope: no fit leaves it
                starts=((0.0, 0.0), (_PLAUSIBLE, 0.0)) if mean < _LEAST else (),
                order=(Stage.actuators, 0, 3),
            )
        ]

    @staticmethod
    def timing(params: Parameters) -> Timing:
        """Change of the time constant, and by how much more it changes while slowing down [s]."""
        change = params["time_constant_change"]
        return Timing(lag=change, asymmetry=change * params["asymmetry"])
