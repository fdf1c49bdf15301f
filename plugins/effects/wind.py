"""Mean wind: the velocity of the air over ground."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from seals.effects import (
    Addition,
    Comparison,
    Identification,
    Stage,
    Subject,
    addition_along_axes,
)
from seals.effects.effect import MediumKind
from seals.effects.flow_profile import MeanFlow
from seals.field_roles import roles


@roles(data="links")
@dataclass(kw_only=True)
class Wind(MeanFlow):
    """Mean wind: the velocity of the air over ground, by height, jet or tide.

    Equation:
        u = (velocity_x, velocity_y, velocity_z) f (1 - A + A cos(2 pi t / T + phi)) in the world;
        laws use v_r = v - R^T u. f = 1 (uniform), (y / reference)^exponent (power),
        ln(y / y_0) / ln(reference / y_0) (log), y the height above the datum;
        exp(-d^2 / (2 width^2)), d the height from the middle of a layer, or the distance from the
        axis of a jet, which runs along the velocity.

    Args:
        velocity_x: toward east [m/s].
        velocity_y: toward north [m/s].
        velocity_z: upward [m/s].
        profile: course in space: uniform, power, log, layer or jet, see `FlowProfile`.
        datum: height in the world of the ground, from which heights count [m].
        reference: height at which the velocity holds; of the middle of a layer or jet [m].
        exponent: of the power law [1].
        roughness: y_0 of the log law [m].
        width: 1-sigma half width of a layer or jet [m].
        centre_x: a point on the axis of a jet, toward east [m].
        centre_y: the same, toward north [m].
        tide: A, share of the flow that turns with the tide [1].
        tide_period: T [s].
        tide_phase: phi [rad].
        medium: air.
        links: links it acts on, all by default.

    Assumptions:
        The velocity at the link origin is that of the whole link; enters through every air drag.

    Valid range:
        Speeds far below that of sound.

    Limitations:
        A given profile, whatever the terrain does to it; no veer with height. Fluctuations are
        the effect ``gusts``.

    References:
        Peterson and Hennessey 1978, J. Appl. Meteorol. 17 (power law); Stull 1988, An Introduction
        to Boundary Layer Meteorology, ch. 9 (log law); Pope 2000, Turbulent Flows, ch. 5 (jets).

    Example:
        >>> Wind(velocity_x=0.5).velocity_x
        0.5
    """

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
