"""Constant error of the accelerometer."""

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
    "bounds": (-20.0, 20.0),
    "tolerance": 0.03,
    "source": "zero: a calibrated sensor",
}


@dataclass(kw_only=True)
class AccelerometerBias(Effect):
    """Constant bias of the accelerometer.

    Equation:
        f = f_true + b, after misalignment and scale.

    Args:
        bias_x: b along sensor x [m/s^2].
        bias_y: b along sensor y [m/s^2].
        bias_z: b along sensor z [m/s^2].
        links: not used; it acts on the accelerometer.

    Assumptions:
        Constant over the log.

    Valid range:
        Biases inside the range of the sensor.

    Limitations:
        No drift with time or temperature.

    References:
        IEEE Std 1293-2018 (linear accelerometers).

    Example:
        >>> AccelerometerBias(bias_x=0.02).bias_x
        0.02
    """

    bias_x: float = param(0.0, "m/s^2", **_LIMITS)
    bias_y: float = param(0.0, "m/s^2", **_LIMITS)
    bias_z: float = param(0.0, "m/s^2", **_LIMITS)
    order: ClassVar[int] = 3
    accounts_for: ClassVar[tuple[str, ...]] = ("accelerometer bias",)
    identification: ClassVar[Identification] = Identification(
        confounders=("accelerometer_scale", "wind", "tether"),
        may_begin=True,
        measurement="Turning the sensor over at rest would distinguish them.",
        words={"bias": "offset of the accelerometer"},
        compared=Comparison(order=(Stage.sensors, 0), scales={"bias": lambda _: 0.3}),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a bias on each of three axes."""
        if "specific_force" not in subject.sigma:
            return []
        sizes = subject.spread(name), 0.3
        return addition_along_axes(cls, name, "bias", sizes, (Stage.sensors, 0, 0))

    @staticmethod
    def measure(reading: Reading, params: Parameters) -> Reading:
        """Specific force with its bias [m/s^2]."""
        return reading._replace(specific_force=reading.specific_force + params["bias"])
