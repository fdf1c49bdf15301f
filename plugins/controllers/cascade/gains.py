"""Gains of the cascade in air and in water, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, some
from seals.control.allocation import Saturation
from seals.control.protocols import ControllerOptions
from seals.field_roles import roles
from seals.schema import setting, vector

_RANGE = (0.0, 1e4)


class Gains(NamedTuple):
    """Gains in one medium, or between the two.

    Args:
        position: see ``position_gain`` of the cascade, as all the others.
        speed: likewise.
        sum: likewise.
        rate: likewise.
        sum_limit: of the sum itself [m].
        turn: roll, pitch and yaw, shape (3,).
        spin: roll, pitch and yaw, shape (3,).
        turn_sum: likewise.
        shape: share of ``turn_sum`` for roll, pitch and yaw, shape (3,).
        turn_sum_limit: of the sum itself [rad s].
        least: likewise.
        tilt: likewise.
    """

    position: float
    speed: float
    sum: float
    rate: float
    sum_limit: float
    turn: Floats
    spin: Floats
    turn_sum: float
    shape: Floats
    turn_sum_limit: float
    least: float
    tilt: float

    @staticmethod
    def between(air: Gains, water: Gains, wet: Array) -> Gains:
        """Return the gains interpolated at submersions, all of the shape (1 or B, 1 or 3)."""
        if not some(wet > 0.0):
            return air
        pairs: Any = zip(air, water, strict=True)
        return Gains(*(a + wet * (w - a) for a, w in pairs))


@roles(data="sense cog_compensation")
@dataclass(kw_only=True)
class CascadeSettings(ControllerOptions):
    """Tunable parameters of the cascade controller.

    Gains are divided by mass and inertia; two numbers are for air and for water, with submersion
    between them.

    Args:
        rate: calls a second [Hz].
        sense: sensor of pose and velocity, or ``truth``.
        cog_compensation: whether allocation and feed-forward follow the live centre of gravity;
            otherwise it is taken where it lies with the arms stowed.
        saturation: what gives way when the rotors cannot do all: ``paper`` or ``priority``.
        position_gain: of the error of a position that the aim gives [1/s].
        speed_gain: k_p of the velocity error [1/s].
        sum_gain: k_i of its sum [1/s^2].
        rate_gain: k_d of the acceleration's error [1].
        sum_limit: largest acceleration by that sum [m/s^2].
        turn_gain: k_R of roll and pitch [1/s^2].
        spin_gain: k_w of roll and pitch [1/s].
        yaw_gain: k_R of yaw [1/s^2].
        yaw_spin_gain: k_w of yaw [1/s].
        turn_sum_gain: k_I of the sum of the attitude's error [1/s^3].
        turn_sum_limit: largest angular acceleration by that sum [rad/s^2].
        tilt: largest lean [rad].
        acceleration: largest that is asked for [m/s^2].
        least: smallest upward force that counts for the lean, share of the weight [1].
        quicker: how many times faster than by their own lag the rotors are made to follow [1].
        smoothing: time constant of the rates that are fed forward [s].
        joint_speed: largest rate of a joint that is reckoned with [rad/s or m/s].
        lean_lead: how far ahead the acceleration of the centre of gravity is taken [s].
        torque_lead: how far ahead the rate of the joints' momentum is taken [s].
    """

    rate: float = setting(250.0, "Hz", bounds=(1.0, 1e4), source="chosen: every step")
    sense: str = "truth"
    cog_compensation: bool = True
    saturation: Saturation = Saturation.priority
    position_gain: list[float] = vector(
        (1.5, 0.8), "1/s", bounds=_RANGE, source="chosen: a third of the speed gain"
    )
    speed_gain: list[float] = vector(
        (4.5, 2.5), "1/s", bounds=_RANGE, source="chosen: a third of the bandwidth of the tilt"
    )
    sum_gain: list[float] = vector(
        (3.0, 1.5), "1/s^2", bounds=_RANGE, source="chosen: seven tenths of a second to settle"
    )
    rate_gain: list[float] = vector(
        (0.0, 0.0), "1", bounds=_RANGE, source="zero: the rate of a measured velocity is noise"
    )
    sum_limit: list[float] = vector(
        (3.0, 3.0), "m/s^2", bounds=_RANGE, source="chosen: a load of a third of the weight"
    )
    turn_gain: list[float] = vector(
        (140.0, 100.0), "1/s^2", bounds=_RANGE, source="chosen: 12 rad/s, above it rotors lag"
    )
    spin_gain: list[float] = vector(
        (20.0, 18.0), "1/s", bounds=_RANGE, source="chosen: damping ratio 0.85 and 0.9"
    )
    yaw_gain: list[float] = vector(
        (12.0, 6.0), "1/s^2", bounds=_RANGE, source="chosen: rotors have little torque in yaw"
    )
    yaw_spin_gain: list[float] = vector(
        (6.0, 4.0), "1/s", bounds=_RANGE, source="chosen: damping ratio 0.85"
    )
    turn_sum_gain: list[float] = vector(
        (80.0, 20.0),
        "1/s^3",
        bounds=_RANGE,
        source="chosen: slower than the tilt by a factor of 20",
    )
    turn_sum_limit: list[float] = vector(
        (10.0, 10.0), "rad/s^2", bounds=_RANGE, source="chosen: unknown lever arm of 3 cm"
    )
    tilt: list[float] = vector(
        (0.6, 0.9), "rad", bounds=(0.01, 1.5), source="chosen: 35 degrees; more if drag dominates"
    )
    acceleration: float = setting(6.0, "m/s^2", bounds=(0.1, 100.0), source="chosen: half of g")
    least: list[float] = vector(
        (0.3, 0.04), "1", bounds=_RANGE, source="chosen: below it the tilt would oscillate"
    )
    quicker: float = setting(3.0, "1", bounds=(1.0, 20.0), source="chosen: noise grows with it")
    smoothing: float = setting(0.015, "s", bounds=(0.0, 1.0), source="chosen: four steps")
    joint_speed: float = setting(6.0, "rad/s", bounds=(0.0, 100.0), source="hobby servos")
    lean_lead: float = setting(0.0, "s", bounds=(0.0, 0.5), source="zero: servos lag like the tilt")
    torque_lead: float = setting(0.02, "s", bounds=(0.0, 0.5), source="chosen: lag left to rotors")

    def gains(self, medium: int) -> Gains:
        """Return the gains in air (0) or in water (1)."""
        k = medium
        turn = (self.turn_gain[k], self.turn_gain[k], self.yaw_gain[k])
        spin = (self.spin_gain[k], self.spin_gain[k], self.yaw_spin_gain[k])
        return Gains(
            position=self.position_gain[k],
            speed=self.speed_gain[k],
            sum=self.sum_gain[k],
            rate=self.rate_gain[k],
            sum_limit=self.sum_limit[k] / max(self.sum_gain[k], 1e-9),
            turn=np.array(turn),
            spin=np.array(spin),
            turn_sum=self.turn_sum_gain[k],
            # yaw is slower, and its sum as well: k_I < k_R k_w or it grows
            shape=np.array((1.0, 1.0, self.yaw_gain[k] / max(self.turn_gain[k], 1e-9))),
            turn_sum_limit=self.turn_sum_limit[k] / max(self.turn_sum_gain[k], 1e-9),
            least=self.least[k],
            tilt=self.tilt[k],
        )
