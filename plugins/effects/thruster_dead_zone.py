"""Commands around zero at which a thruster stands still."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Freed, Identification, Stage, Subject
from seals.motion import Drives, Inputs, Medium, Motion
from seals.schema import param

_SHARE = 0.04
"""Plausible dead zone, as a share of the largest force; chosen."""
_SOFT = 0.2
"""Width over which a thruster starts where none is stated, as a share of the dead zone."""
_SHARP = 0.005
"""Least width that a fit takes: commands are seldom so close to each other."""


class DeadZoneForm(Enum):
    """What a thruster does beyond its dead zone."""

    shifted = "shifted"
    """All forces are smaller by it: signal and force were taken as proportional."""
    jump = "jump"
    """The force is as commanded: the electronics know it, but the motor needs it to start."""


class DeadZonePlace(Enum):
    """Where in the drivetrain a dead zone acts."""

    force = "force"
    """On the force, behind the lag: blades that stick."""
    command = "command"
    """On the command, before the lag: electronics that take a small signal for none."""


@dataclass(kw_only=True)
class ThrusterDeadZone(Effect):
    """Dead zone of thrusters: small commanded forces give none.

    Equation:
        ``shifted``: T = T_0 - clip(T_0, -d, d).
        ``jump``: T = T_0 s((|T_0| - d) / (w d)), with s(u) rising from 0 at u = -1/2 to 1 at
        u = 1/2 as a cubic.
        T_0 is the force behind the lag, or the command before it, as ``place`` says.

    Args:
        force: d, largest commanded force at which a thruster stands still [N].
        width: w, over which a force that jumps rises, as a share of d [1]; ``jump`` alone.
        form: what it does beyond.
        place: where it acts.
        links: the link of the thrusters it changes, the root by default.

    Assumptions:
        The same for both directions and for all thrusters.

    Valid range:
        Thrusters that turn slowly or stand still now and then.

    Limitations:
        No hysteresis between starting and stopping. Drives with a disc of their own, rotors, are
        left alone.

    References:
        Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control (thrusters).

    Example:
        >>> ThrusterDeadZone(force=1.5).form.value
        'shifted'
    """

    force: float = param(
        0.0, "N", bounds=(0.0, 1e4), tolerance=0.0, source="zero: every command turns the blades"
    )
    width: float = param(
        _SOFT, "1", bounds=(0.0, 1.0), tolerance=0.0, source="chosen: steps of an engine see a ramp"
    )
    form: DeadZoneForm = DeadZoneForm.shifted
    place: DeadZonePlace = DeadZonePlace.force
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
        """Return the candidates: a dead zone of each form in each place, where thrusters push."""
        sizes = [
            np.asarray(e.max_force) for e in subject.effects.values() if hasattr(e, "max_force")
        ]
        if subject.rotors or not len(subject.lag) or not sizes:
            return []
        scale = _SHARE * float(np.mean(np.concatenate(sizes)))
        force = Freed(scale=scale, bounds=(0.0, np.inf), nudge=0.05 * scale)
        # a wide ramp shows which way the dead zone moves, a narrow one is what electronics do
        width = Freed(scale=0.5 * _SOFT, bounds=(_SHARP - _SOFT, 1.0 - _SOFT))
        freed = {
            DeadZoneForm.shifted: {"force": force},
            DeadZoneForm.jump: {"force": force, "width": width},
        }
        return [
            Addition(
                instance="_".join([name, *words]),
                effect=cls(form=form, place=place),
                parameters=freed[form],
                nuisance=tuple(n for n in freed[form] if n != "force"),
                law=" of the ".join(words),
                starts=tuple(
                    (size * scale, *[0.0] * (len(freed[form]) - 1)) for size in (0.5, 2.0)
                ),
                order=(Stage.actuators, 0, 4),
            )
            for place in DeadZonePlace
            for form in DeadZoneForm
            for words in [_words(form, place)]
        ]

    def constants(self) -> dict[str, Floats]:
        """Return 1 for a jump, 0 for a shifted force, and 1 for the place where it acts."""
        chosen = {
            "jump": self.form is DeadZoneForm.jump,
            "on_force": self.place is DeadZonePlace.force,
            "on_command": self.place is DeadZonePlace.command,
        }
        return {name: np.full((1, 1), float(yes)) for name, yes in chosen.items()}

    @staticmethod
    def command(command: Array, radius: Array, params: Parameters) -> Array:
        """Commands [N] beyond the dead zone."""
        return _beyond(command, radius, params["force"] * params["on_command"], params)

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Forces [N] beyond the dead zone."""
        dead = params["force"] * params["on_force"]
        return drives._replace(thrust=_beyond(drives.thrust, drives.radius, dead, params))


def _beyond(wanted: Array, radius: Array, dead: Array, params: Parameters) -> Array:
    """Return what a dead zone leaves of forces [N], shape (1 or N, n); all of those of discs."""
    xp = namespace(wanted)
    size = abs(wanted)
    beyond = xp.where(size > dead, size - dead, 0.0 * size)
    # a dead zone of nothing has no width: the smallest one keeps the ratio finite
    ramp = xp.clip((size - dead) / (params["width"] * dead + 1e-12) + 0.5, 0.0, 1.0)
    jumped = size * ramp * ramp * (3.0 - 2.0 * ramp)
    left = params["jump"] * jumped + (1.0 - params["jump"]) * beyond
    return xp.where(radius > 0.0, wanted, xp.where(wanted < 0.0, -left, left))


def _words(form: DeadZoneForm, place: DeadZonePlace) -> list[str]:
    """Return the options of a dead zone that are not the default ones."""
    plain = {DeadZoneForm.shifted, DeadZonePlace.force}
    return [str(option.value) for option in (form, place) if option not in plain]
