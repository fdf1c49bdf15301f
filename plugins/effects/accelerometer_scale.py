"""Scale error of the accelerometer."""

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
    "bounds": (-0.9, 5.0),
    "tolerance": 0.003,
    "source": "zero: a calibrated sensor",
}


@dataclass(kw_only=True)
class AccelerometerScale(Effect):
    """Relative scale error of the accelerometer, per axis.

    Equation:
        f_i = (1 + k_i) f_true,i, after misalignment and before bias.

    Args:
        scale_x: k along sensor x [1].
        scale_y: k along sensor y [1].
        scale_z: k along sensor z [1].
        links: not used; it acts on the accelerometer.

    Assumptions:
        Constant over the log and over the range.

    Valid range:
        Inside the range of the sensor.

    Limitations:
        No cross-axis sensitivity, no curvature of the scale.

    References:
        IEEE Std 1293-2018 (linear accelerometers).

    Example:
        >>> AccelerometerScale(scale_x=0.02).scale_x
        0.02
    """

    scale_x: float = param(0.0, "1", **_LIMITS)
    scale_y: float = param(0.0, "1", **_LIMITS)
    scale_z: float = param(0.0, "1", **_LIMITS)
    order: ClassVar[int] = 2
    accounts_for: ClassVar[tuple[str, ...]] = ("accelerometer scale",)
    identification: ClassVar[Identification] = Identification(
        confounders=("accelerometer_bias", "added_mass", "buoyancy"),
        may_begin=True,
        measurement="Turning the sensor over at rest would distinguish them.",
        words={"scale": "scale of the accelerometer"},
        compared=Comparison(order=(Stage.sensors, 1)),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a scale error on each of three axes."""
        if "specific_force" not in subject.sigma:
            return []
        sizes = subject.spread(name), 0.05
        return addition_along_axes(cls, name, "scale", sizes, (Stage.sensors, 0, 1))

    @staticmethod
    def measure(reading: Reading, params: Parameters) -> Reading:
        """Specific force with the scale error [m/s^2]."""
        return reading._replace(specific_force=reading.specific_force * (1.0 + params["scale"]))
