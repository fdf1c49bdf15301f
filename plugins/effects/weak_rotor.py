"""Loss of thrust of one rotor or thruster."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seals.arrays import Floats, namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Comparison, Freed, Identification, Stage, Subject
from seals.motion import Drives, Inputs, Medium, Motion
from seals.schema import check_fields, count, param


@dataclass(kw_only=True)
class WeakRotor(Effect):
    """Relative loss of thrust of one drive, and of its reaction torque.

    Equation:
        T_i = T_i,free (1 - f) and Q_i = Q_i,free (1 - s f) for i = rotor; all others stay.

    Args:
        relative_loss: f [1].
        torque_share: s [1].
        rotor: 1-based index of the drive on its actuator.
        links: the link of the actuator it changes, the root by default.

    Assumptions:
        A damaged or fouled blade loses lift and keeps its drag, s = 0; a propeller that slips on
        its shaft loses both alike, s = 1.

    Valid range:
        Any speed of the drive.

    Limitations:
        The index counts in every actuator on the link; a link with two of them loses one of each.

    References:
        None needed: the definition of a relative loss.

    Example:
        >>> WeakRotor(rotor=3, relative_loss=0.1).rotor
        3
    """

    relative_loss: float = param(
        0.0, "1", bounds=(-1.0, 1.0), tolerance=0.004, source="zero: all drives are equal"
    )
    torque_share: float = param(
        0.0, "1", bounds=(0.0, 1.0), tolerance=0.0, source="zero: the blade keeps its drag"
    )
    rotor: int = count(1, bounds=(1, 10_000))
    accounts_for: ClassVar[tuple[str, ...]] = ("weak rotor",)
    identification: ClassVar[Identification] = Identification(
        confounders=("centre_of_gravity",),
        may_begin=True,
        may_end=True,
        answers=True,
        measurement="A thrust stand would distinguish them.",
        words={"relative_loss": "thrust loss of actuator {}"},
        compared=Comparison(order=(Stage.joints, 4)),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidates: a loss of thrust of each actuator, or a slip of each propeller."""
        loss = Freed(tolerance=subject.spread("thrust_coefficient_each"), scale=0.1)
        drives = range(1, len(subject.lag) + 1)
        found = [
            Addition(
                instance=f"{name}_{k}",
                effect=cls(rotor=k),
                parameters={"relative_loss": loss},
                variant={"rotor": k},
                order=(Stage.actuators, 0, 1),
            )
            for k in drives
        ]
        slips = [
            Addition(
                instance=f"{name}_{k}_slipping",
                effect=cls(rotor=k, torque_share=1.0),
                parameters={"relative_loss": Freed(scale=0.1)},
                variant={"rotor": k},
                law="slipping",
                order=(Stage.actuators, 0, 3),
            )
            for k in drives
        ]
        return [*found, *(slips if subject.rotors else [])]

    def __post_init__(self) -> None:
        """Refuse what the fields do not allow, as the reading of a configuration does."""
        check_fields(type(self), {"rotor": self.rotor}, where="weak_rotor")

    def constants(self) -> dict[str, Floats]:
        """Return the drive's index."""
        return {"rotor": np.full((1, 1), float(self.rotor))}

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Thrusts [N] and reaction torques [N m] with those of one drive reduced."""
        xp = namespace(drives.thrust)
        index = xp.cumulative_sum(xp.ones_like(drives.thrust[:1, :]), axis=1)
        weak = xp.astype(index == params["rotor"], drives.thrust.dtype)
        loss = params["relative_loss"] * weak
        return drives._replace(
            thrust=drives.thrust * (1.0 - loss),
            torque=drives.torque * (1.0 - params["torque_share"] * loss),
        )
