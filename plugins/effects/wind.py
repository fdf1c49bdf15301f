"""Steady wind: the velocity of the air over ground."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

from seals.arrays import Array
from seals.effects import (
    Addition,
    Comparison,
    Identification,
    Stage,
    Subject,
    addition_along_axes,
)
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.field_roles import roles
from seals.motion import Inputs, Medium, Motion
from seals.schema import param


@roles(data="links")
@dataclass(kw_only=True)
class Wind(Effect):
    """Steady wind: the velocity of the air over ground.

    Equation:
        u = (velocity_x, velocity_y, velocity_z) in the world; laws use v_r = v - R^T u.

    Args:
        velocity_x: toward east [m/s].
        velocity_y: toward north [m/s].
        velocity_z: upward [m/s].
        medium: air.
        links: links it acts on, all by default.

    Assumptions:
        Constant in time and space; enters through every air drag.

    Valid range:
        Speeds far below that of sound.

    Limitations:
        No gusts, no shear with height.

    References:
        None needed: a frame change of the relative velocity.

    Example:
        >>> Wind(velocity_x=0.5).velocity_x
        0.5
    """

    velocity_x: float = param(
        0.0, "m/s", bounds=(-100.0, 100.0), tolerance=0.05, source="still by default"
    )
    velocity_y: float = param(
        0.0, "m/s", bounds=(-100.0, 100.0), tolerance=0.05, source="still by default"
    )
    velocity_z: float = param(
        0.0, "m/s", bounds=(-100.0, 100.0), tolerance=0.05, source="still by default"
    )
    medium: MediumKind = MediumKind.air
    links: list[str] = field(default_factory=lambda: ["*"])
    accounts_for: ClassVar[tuple[str, ...]] = ("steady wind",)
    identification: ClassVar[Identification] = Identification(
        confounders=("tether", "accelerometer_bias", "payload"),
        may_begin=True,
        may_end=True,
        gusty=True,
        compared=Comparison(
            order=(Stage.water, 10), media=("air",), scales={"velocity": lambda _: 1.0}
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate, where the vehicle moves in air."""
        if MediumKind.air not in subject.media:
            return []
        order = (Stage.flow, subject.media.index(MediumKind.air), 3)
        return addition_along_axes(cls, name, "velocity", (0.0, 2.0), order)

    def ambient(self) -> Effect | None:
        """Return the effect for every link of another robot or object in the scene."""
        return None if self.correction else replace(self, links=["*"])

    @staticmethod
    def flow(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Array, Array]:
        """Velocity of the air, world axes [m/s]."""
        return params["velocity"], memory
