"""Mounting of a sensor: motion at the sensor from that of its link; base of mounted sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from seals.errors import ConfigError
from seals.field_roles import roles
from seals.frames import cross3, matrix_of, quaternion_of_rpy
from seals.schema import setting
from seals.sensors.options import SensorOptions
from seals.sensors.protocol import SensorInput


class Mount:
    """Position and axes of a sensor on its link.

    Equation:
        p_S = p + R r; v_S = R_SL (v + w x r); w_S = R_SL w;
        f_S = R_SL (f + w' x r + w x (w x r)).

    Args:
        name: of the sensor, for messages.
        position: r, in link axes [m].
        rpy: turn of the sensor's axes against those of the link [rad].

    Raises:
        ConfigError: not three finite numbers.

    Attributes:
        arm: r [m], shape (3,).
        turn: R_LS, shape (3, 3).
        centred: whether r is zero.
        aligned: whether the axes are those of the link.
        plain: whether the sensor sits at the origin of its link, in its axes.
    """

    def __init__(self, name: str, position: Sequence[float], rpy: Sequence[float]) -> None:
        for key, values in (("position", position), ("rpy", rpy)):
            if len(values) != 3 or not np.all(np.isfinite(values)):
                raise ConfigError(
                    f"{name}.{key}={values} is not allowed.\nAllowed: three finite numbers."
                )
        self.arm = np.asarray(position, dtype=float)
        self.turn = matrix_of(quaternion_of_rpy(np.asarray([rpy], dtype=float)))[0]
        self.centred, self.aligned = not np.any(self.arm), not np.any(rpy)
        self.plain = self.centred and self.aligned

    def felt(self, felt: SensorInput) -> SensorInput:
        """Return the inputs at the sensor, in its axes; contacts stay those of the link."""
        if self.plain and felt.axis_misalignment is None:
            return felt
        position, velocity, force = felt.position, felt.velocity, felt.specific_force
        spin, rate, r = felt.angular_velocity, felt.angular_acceleration, self.arm
        if not self.centred:
            position = position + felt.rotation @ r
            velocity = velocity + cross3(spin, r)
            # the force is that of the step's start: so is what the arm adds to it
            then = spin if felt.turning is None else felt.turning
            force = force + cross3(rate, r) + cross3(then, cross3(then, r))
        turn = self.turn if felt.axis_misalignment is None else self.turn @ felt.axis_misalignment
        if self.aligned and felt.axis_misalignment is None:
            return felt._replace(position=position, velocity=velocity, specific_force=force)
        return felt._replace(
            position=position,
            rotation=felt.rotation @ turn,
            velocity=velocity @ turn,
            angular_velocity=spin @ turn,
            specific_force=force @ turn,
            angular_acceleration=rate @ turn,
        )


@roles(data="link")
@dataclass(kw_only=True)
class MountedSensor(SensorOptions):
    """Base of sensors: mounting link, latency and dropouts.

    The world acts on these fields, see `seals.sensors.delivery`; a sensor itself never looks at
    them. A reading stands in the log at the time at which it was taken.

    Args:
        link: link that carries the sensor; ``root`` is the base.
        latency: time from the taking of a reading to its arrival at guide and controller [s].
        dropout: share of the readings that are lost [1].
        outage: mean length of a loss, at least one reading; 0 loses each by itself [s].
    """

    link: str = "root"
    latency: float = setting(0.0, "s", bounds=(0.0, 60.0), source="chosen: none")
    dropout: float = setting(0.0, "1", bounds=(0.0, 1.0), source="chosen: none")
    outage: float = setting(0.0, "s", bounds=(0.0, 1e4), source="chosen: none")

    inertial: ClassVar[bool] = False
    """Whether it reads ``specific_force`` or ``angular_acceleration``; else these are zero."""


@dataclass(kw_only=True)
class PlacedSensor(MountedSensor):
    """Base of sensors with a place and axes of their own on their link.

    Args:
        position: mounting point in link axes [m].
        rpy: turn of the sensor's axes against those of the link [rad].
    """

    position: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    rpy: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])


@dataclass(kw_only=True)
class PicturingSensor(PlacedSensor):
    """Base of sensors whose readings are numbers of images."""

    idles: ClassVar[bool] = True

    def start(self, rng: np.random.Generator) -> Any:
        """Return the initial state: the number of the next image."""
        return 0
