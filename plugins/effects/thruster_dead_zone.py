"""Commands around zero at which a thruster stands still."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

import numpy as np

from seals.arrays import Floats, namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Freed, Identification, Stage, Subject
from seals.motion import Drives, Inputs, Medium, Motion
from seals.schema import param

_SHARE = 0.04
"""Plausible dead zone, as a share of the largest force; chosen."""
_SOFT = 0.2
"""Width over which a thruster starts, as a share of the dead zone."""


class DeadZoneForm(Enum):
    """What a thruster does beyond its dead zone."""

    shifted = "shifted"
    """All forces are smaller by it: signal and force were taken as proportional."""
    jump = "jump"
    """The force is as commanded: the electronics know it, but the motor needs it to start."""


@dataclass(kw_only=True)
class ThrusterDeadZone(Effect):
    """Dead zone of thrusters: small commanded forces give none.

    Equation:
        ``shifted``: T = T_0 - clip(T_0, -d, d).
        ``jump``: T = T_0 s((|T_0| - d) / (w d)), with s(u) rising from 0 at u = -1/2 to 1 at
        u = 1/2 as a cubic, and w = 0.2.

    Args:
        force: d, largest commanded force at which a thruster stands still [N].
        form: what it does beyond.
        links: the link of the thrusters it changes, the root by default.

    Assumptions:
        The same for both directions and for all thrusters. It acts on the force after the lag.

    Valid range:
        Thrusters that turn slowly or stand still now and then.

    Limitations:
        No hysteresis between starting and stopping. One that acts on the command, before the lag,
        is another law, which a diagnosis does not find as this one. Drives with a disc of their
        own, rotors, are left alone.

    References:
        Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control (thrusters).

    Example:
        >>> ThrusterDeadZone(force=1.5).form.value
        'shifted'
    """

    force: float = param(
        0.0, "N", bounds=(0.0, 1e4), tolerance=0.0, source="zero: every command turns the blades"
    )
    form: DeadZoneForm = DeadZoneForm.shifted
    accounts_for: ClassVar[tuple[str, ...]] = ("thruster dead zone",)
    actuator: ClassVar[str] = "thrusters"
    identification: ClassVar[Identification] = Identification(
        confounders=("thrust_coefficient", "thruster_inflow"),
        answers=True,
        measurement="A thrust stand with small commands would show it.",
        words={"force": "dead zone of the thrusters"},
        compared=None,
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidates: a dead zone in each of its forms, where thrusters push."""
        sizes = [
            np.asarray(e.max_force) for e in subject.effects.values() if hasattr(e, "max_force")
        ]
        if subject.rotors or not len(subject.lag) or not sizes:
            return []
        scale = _SHARE * float(np.mean(np.concatenate(sizes)))
        force = Freed(scale=scale, bounds=(0.0, np.inf), nudge=0.05 * scale)
        return [
            Addition(
                instance=name if form is DeadZoneForm.shifted else f"{name}_{form.value}",
                effect=cls(form=form),
                parameters={"force": force},
                law="" if form is DeadZoneForm.shifted else form.value,
                starts=((0.5 * scale,), (2.0 * scale,)),
                order=(Stage.actuators, 0, 4),
            )
            for form in DeadZoneForm
        ]

    def constants(self) -> dict[str, Floats]:
        """Return 1 for a jump, 0 for a shifted force."""
        return {"jump": np.full((1, 1), float(self.form is DeadZoneForm.jump))}

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Forces [N] beyond the dead zone."""
        wanted, dead = drives.thrust, params["force"]
        xp = namespace(wanted)
        size = abs(wanted)
        beyond = xp.where(size > dead, size - dead, 0.0 * size)
        # a dead zone of nothing has no width: the smallest one keeps the ratio finite
        ramp = xp.clip((size - dead) / (_SOFT * dead + 1e-12) + 0.5, 0.0, 1.0)
        jumped = size * ramp * ramp * (3.0 - 2.0 * ramp)
        left = params["jump"] * jumped + (1.0 - params["jump"]) * beyond
        thrust = xp.where(wanted < 0.0, -left, left)
        return drives._replace(thrust=xp.where(drives.radius > 0.0, wanted, thrust))
