"""Delay between a command and the actuator."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Comparison, Freed, Identification, Stage, Subject
from seals.motion import Timing
from seals.schema import param


@dataclass(kw_only=True)
class CommandDelay(Effect):
    """Additional delay between a command and the actuator.

    Equation:
        The actuator follows command(t - d); each command is held until the next.

    Args:
        delay: d [s].
        links: not used; the delay is that of every command.

    Assumptions:
        Constant, the same for all actuators and joints.

    Valid range:
        Delays below the length of the log; a sum below zero is held at zero by the caller.

    Limitations:
        No jitter, no lost commands.

    References:
        None needed: a shift in time.

    Example:
        >>> CommandDelay(delay=0.02).delay
        0.02
    """

    delay: float = param(
        0.0, "s", bounds=(-0.5, 0.5), tolerance=0.0005, source="zero: the stated delay applies"
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("command delay",)
    identification: ClassVar[Identification] = Identification(
        confounders=("rotor_lag",),
        may_begin=True,
        may_end=True,
        adds_only=("delay",),
        starts=((0.0,), (0.02,)),
        words={"delay": "delay of the commands"},
        compared=Comparison(order=(Stage.joints, 3), scales={"delay": lambda _: 0.02}),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a delay of all commands."""
        if not len(subject.lag):
            return []
        delay = Freed(tolerance=subject.spread(name), scale=0.02, bounds=(-1e-3, math.inf))
        return [
            Addition(
                instance=name,
                effect=cls(),
                parameters={"delay": delay},
                starts=cls.identification.starts,
                order=(Stage.actuators, 0, 4),
            )
        ]

    @staticmethod
    def timing(params: Parameters) -> Timing:
        """Additional delay of the commands [s]."""
        return Timing(command_delay=params["delay"])
