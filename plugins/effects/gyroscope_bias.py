"""Constant error of the gyroscope."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from seals.effects import (
    Addition,
    Comparison,
    Identification,
    Stage,
    Subject,
    addition_along_axes,
)
from seals.effects.effect import Effect, Parameters
from seals.motion import Reading
from seals.schema import param

_LIMITS: dict[str, Any] = {
    "bounds": (-5.0, 5.0),
    "tolerance": 0.003,
    "source": "zero: a calibrated sensor",
}


@dataclass(kw_only=True)
class GyroscopeBias(Effect):
    """Constant bias of the gyroscope.

    Equation:
        w = w_true + b, after misalignment.

    Args:
        bias_x: b about sensor x [rad/s].
        bias_y: b about sensor y [rad/s].
        bias_z: b about sensor z [rad/s].
        links: not used; it acts on the gyroscope.

    Assumptions:
        Constant over the log.

    Valid range:
        Biases inside the range of the sensor.

    Limitations:
        No drift with time or temperature, no sensitivity to acceleration.

    References:
        IEEE Std 952-1997 (single-axis interferometric gyroscopes).

    Example:
        >>> GyroscopeBias(bias_x=0.02).bias_x
        0.02
    """

    bias_x: float = param(0.0, "rad/s", **_LIMITS)
    bias_y: float = param(0.0, "rad/s", **_LIMITS)
    bias_z: float = param(0.0, "rad/s", **_LIMITS)
    order: ClassVar[int] = 3
    accounts_for: ClassVar[tuple[str, ...]] = ("gyroscope bias",)
    identification: ClassVar[Identification] = Identification(
        may_begin=True,
        words={"bias": "offset of the gyroscope"},
        compared=Comparison(order=(Stage.sensors, 3)),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a bias on each of three axes."""
        sizes = subject.spread(name), 0.05
        return addition_along_axes(cls, name, "bias", sizes, (Stage.sensors, 0, 2))

    @staticmethod
    def measure(reading: Reading, params: Parameters) -> Reading:
        """Angular velocity with its bias [rad/s]."""
        return reading._replace(angular_velocity=reading.angular_velocity + params["bias"])
