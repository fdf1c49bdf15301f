"""Ground effect: rise of rotor thrust near the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from seals.arrays import namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Freed, Identification, Stage, Subject
from seals.motion import Drives, Inputs, Medium, Motion
from seals.schema import param


@dataclass(kw_only=True)
class GroundEffect(Effect):
    """Ground effect: rise of every rotor's thrust near flat ground.

    Equation:
        T = T_free / (1 - k (R / (4 h))^2) with h the height of the hub above the ground, not taken
        below R/2; the reaction torque stays.

    Args:
        coefficient: k, 1 in the textbook [1].
        ground_level: world z of the ground [m].
        links: the link of the rotors it changes, the root by default.

    Assumptions:
        Each rotor by itself over flat level ground, at constant speed of the rotor.

    Valid range:
        Heights from R/2 to where it fades, about 4 R; slow flight.

    Limitations:
        No fountain between rotors, no change with tilt or forward speed; drives without a disc
        (radius zero) are left alone.

    References:
        Cheeseman and Bennett 1955, ARC R&M 3021.

    Example:
        >>> GroundEffect(coefficient=1.0).coefficient
        1.0
    """

    coefficient: float = param(
        0.0, "1", bounds=(-3.0, 3.0), tolerance=0.2, source="zero unless the vehicle states it"
    )
    ground_level: float = param(
        0.0, "m", bounds=(-1e4, 1e4), tolerance=0.0, source="chosen: world zero", fit=False
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("ground effect",)
    identification: ClassVar[Identification] = Identification(
        confounders=("thrust_coefficient",),
        compared=None,
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate, where the height of the ground is known."""
        ground = subject.environment.ground_level
        if not len(subject.lag) or not subject.rotors or ground is None:
            return []
        return [
            Addition(
                instance=name,
                effect=cls(ground_level=ground),
                parameters={"coefficient": Freed(scale=1.0, bounds=(0.0, math.inf))},
                order=(Stage.actuators, 0, 7),
            )
        ]

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Thrusts in ground effect [N]."""
        xp = namespace(motion.position)
        hub = motion.position[:, 2:3] + motion.up @ drives.position.T
        # the small height keeps drives without a disc finite on the ground
        height = xp.clip(hub - params["ground_level"], 1e-6, None)
        ratio = xp.clip(drives.radius[None, :] / (4.0 * height), None, 0.5)
        gain = 1.0 / (1.0 - params["coefficient"] * ratio * ratio)
        return drives._replace(thrust=drives.thrust * gain)
