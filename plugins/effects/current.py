"""Mean current: the velocity of the water over ground."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from seals.effects import Addition, Comparison, Identification, Stage, Subject, along_axes
from seals.effects.effect import MediumKind
from seals.effects.flow_profile import MeanFlow
from seals.field_roles import roles
from seals.schema import param

_FAST = ((0.8, 0.0, 0.0), (-0.8, 0.0, 0.0), (0.0, 0.8, 0.0), (0.0, -0.8, 0.0))
"""Fast currents from which a fit starts, too [m/s]."""


@roles(data="links")
@dataclass(kw_only=True)
class Current(MeanFlow):
    """Mean current: the velocity of the water over ground, by height, jet or tide.

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
        datum: height in the world of the sea bed, from which heights count [m].
        reference: height at which the velocity holds; of the middle of a layer or jet [m].
        exponent: of the power law [1].
        roughness: y_0 of the log law [m].
        width: 1-sigma half width of a layer or jet [m].
        centre_x: a point on the axis of a jet, toward east [m].
        centre_y: the same, toward north [m].
        tide: A, share of the flow that turns with the tide [1].
        tide_period: T [s].
        tide_phase: phi [rad].
        medium: water.
        links: links it acts on, all by default.

    Assumptions:
        The velocity at the link origin is that of the whole link; a change of the flow in time or
        along the way is no acceleration of the medium by itself. Enters through every water drag
        and the added mass.

    Valid range:
        Speeds far below that of sound.

    Limitations:
        A given profile, whatever the terrain does to it; no veer with height. Fluctuations are
        the effect ``gusts``.

    References:
        Fossen 2011, ch. 8; Soulsby 1997, Dynamics of Marine Sands, ch. 3 (profiles above a bed);
        Pugh 1987, Tides, Surges and Mean Sea-Level (periods).

    Example:
        >>> Current(velocity_x=0.5).velocity_x
        0.5
    """

    velocity_x: float = param(
        0.0, "m/s", bounds=(-20.0, 20.0), tolerance=0.05, source="still by default"
    )
    velocity_y: float = param(
        0.0, "m/s", bounds=(-20.0, 20.0), tolerance=0.05, source="still by default"
    )
    velocity_z: float = param(
        0.0, "m/s", bounds=(-20.0, 20.0), tolerance=0.05, source="still by default"
    )
    medium: MediumKind = MediumKind.water
    links: list[str] = field(default_factory=lambda: ["*"])
    accounts_for: ClassVar[tuple[str, ...]] = ("steady current",)
    identification: ClassVar[Identification] = Identification(
        may_begin=True,
        may_end=True,
        gusty=True,
        compared=Comparison(
            order=(Stage.water, 5), media=("water",), scales={"velocity": lambda _: 0.1}
        ),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate, where the vehicle moves in water."""
        if MediumKind.water not in subject.media:
            return []
        order = (Stage.flow, subject.media.index(MediumKind.water), 3)
        parameters = along_axes("velocity", 0.0, 0.3)
        # a drag of the second power has no slope at rest that would tell of a fast current
        starts = ((0.0, 0.0, 0.0), *_FAST)
        return [
            Addition(instance=name, effect=cls(), parameters=parameters, starts=starts, order=order)
        ]
