"""Misalignment of the measured attitude."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from seals.arrays import Array
from seals.effects import (
    Addition,
    Comparison,
    Identification,
    Stage,
    Subject,
    addition_along_axes,
)
from seals.effects.effect import Effect, Parameters
from seals.schema import param

_LIMITS: dict[str, Any] = {
    "bounds": (-0.3, 0.3),
    "tolerance": 0.02,
    "source": "zero: markers are aligned with the body axes",
}


@dataclass(kw_only=True)
class PoseMisalignment(Effect):
    """Misalignment of the axes whose attitude a pose states, as of the markers of motion capture.

    Equation:
        q_measured = q Exp(r), with the rotation vector r in body axes.

    Args:
        rotation_x: r about body x [rad].
        rotation_y: r about body y [rad].
        rotation_z: r about body z [rad].
        links: not used; it acts on the measured attitude.

    Assumptions:
        Constant over the log: the rigid body of the markers was defined with the vehicle level by
        eye. Inertial sensors and rotors have the axes of the body.

    Valid range:
        Small turns, up to about 0.3 rad.

    Limitations:
        Part of a fit wherever the data sheet states a tolerance for it, and never named: it is a
        fault of the measurement. The log of a simulation holds the true attitude.

    References:
        Sola 2017, Quaternion kinematics for the error-state Kalman filter, arXiv:1711.02508.

    Example:
        >>> PoseMisalignment(rotation_x=0.02).rotation_x
        0.02
    """

    rotation_x: float = param(0.0, "rad", **_LIMITS)
    rotation_y: float = param(0.0, "rad", **_LIMITS)
    rotation_z: float = param(0.0, "rad", **_LIMITS)
    accounts_for: ClassVar[tuple[str, ...]] = ("pose misalignment",)
    identification: ClassVar[Identification] = Identification(
        words={"rotation": "turn of the measured attitude"},
        compared=Comparison(order=(Stage.sensors, 9)),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return a parameter of every model where the data sheet states its tolerance."""
        if not subject.spread(name):
            return []
        sizes = subject.spread(name), 0.05
        return addition_along_axes(cls, name, "rotation", sizes, (Stage.sensors, 0, 9), named=())

    @staticmethod
    def pose_turn(params: Parameters) -> Array:
        """Return the rotation vector of the measured against the true attitude, shape (N, 3)."""
        return params["rotation"]
