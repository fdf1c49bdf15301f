"""Ground effect: rise of rotor thrust near the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

import numpy as np

from seals.arrays import Floats, namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Freed, Identification, Stage, Subject
from seals.motion import Drives, Inputs, Medium, Motion
from seals.schema import param


class GroundForm(Enum):
    """Height above the ground that counts: of each hub, or of the middle of all of them."""

    each_rotor = "each_rotor"
    vehicle = "vehicle"


@dataclass(kw_only=True)
class GroundEffect(Effect):
    """Ground effect: rise of every rotor's thrust near flat ground.

    Equation:
        T = T_free / (1 - k (R / (4 h))^2) with h the height of the hub above the ground, not taken
        below R/2; the reaction torque stays. ``form=vehicle``: h of the middle of all hubs, so that
        a tilted vehicle has no righting moment.

    Args:
        coefficient: k, 1 in the textbook [1].
        ground_level: world z of the ground [m].
        form: height that counts.
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
        0.0, "1", bounds=(-3.0, 3.0), tolerance=0.2, source="zero unless stated for the vehicle"
    )
    ground_level: float = param(
        0.0, "m", bounds=(-1e4, 1e4), tolerance=0.0, source="chosen: world zero", fit=False
    )
    form: GroundForm = GroundForm.each_rotor
    accounts_for: ClassVar[tuple[str, ...]] = ("ground effect",)
    identification: ClassVar[Identification] = Identification(
        confounders=("thrust_coefficient",),
        compared=None,
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidates: both forms, where the height of the ground is known."""
        ground = subject.environment.ground_level
        if not len(subject.lag) or not subject.rotors or ground is None:
            return []
        return [
            Addition(
                instance=name if form is GroundForm.each_rotor else f"{name}_{form.value}",
                effect=cls(ground_level=ground, form=form),
                parameters={"coefficient": Freed(scale=1.0, bounds=(0.0, math.inf))},
                law="" if form is GroundForm.each_rotor else form.value,
                order=(Stage.actuators, 0, 7),
            )
            for form in GroundForm
        ]

    def constants(self) -> dict[str, Floats]:
        """Return 1 where the height of the vehicle counts, 0 where that of each hub does."""
        return {"level": np.full((1, 1), float(self.form is GroundForm.vehicle))}

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Thrusts in ground effect [N]."""
        xp = namespace(motion.position)
        places = drives.position
        above = motion.up @ places.T
        middle = xp.sum(above, axis=1)[:, None] / places.shape[0]
        hub = motion.position[:, 2:3] + above + params["level"] * (middle - above)
        # the small height keeps drives without a disc finite on the ground
        height = xp.clip(hub - params["ground_level"], 1e-6, None)
        ratio = xp.clip(drives.radius[None, :] / (4.0 * height), None, 0.5)
        gain = 1.0 / (1.0 - params["coefficient"] * ratio * ratio)
        return drives._replace(thrust=drives.thrust * gain)
