"""Rotors: thrust and reaction torque from the square of their speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects.effect import ActuatorOptions, Effect, Parameters
from seals.errors import ConfigError
from seals.motion import Drives, Inputs
from seals.plugins.actuators.layout import check_first, numbers, unit_axes, vectors
from seals.schema import param

_SIGNS = {
    "thrust_coefficient": "positive",
    "torque_coefficient": "not negative",
    "time_constant": "not negative",
    "spin_down": "not negative",
    "friction_torque": "not negative",
    "copper_loss": "not negative",
    "radius": "not negative",
    "max_speed": "positive",
}


@dataclass(kw_only=True)
class Rotors(ActuatorOptions, Effect):
    """Rotors or propellers fixed to a link, driven by their speed.

    Equation:
        T = k_T w^2 (1 + thrust_change) along the axis, -reverse times that for w < 0;
        Q = -direction k_Q w^2 (1 + torque_change) about the axis. The
        caller makes w from the command: delay, then w' = (command - w) / time_constant, with
        spin_down in its place while w falls. Electrical power (Q + Q_0) w + c Q^2 with Q_0 the
        friction torque and c the copper loss.

    Args:
        position: of the hubs in link axes [m], one row of three numbers a rotor.
        axis: of positive thrust [1], one row a rotor, or one for all; empty for link z.
        direction: +1 for anticlockwise seen from the tip of the axis, -1 for clockwise [1].
        thrust_coefficient: k_T [N/(rad/s)^2].
        torque_coefficient: k_Q [N m/(rad/s)^2].
        time_constant: of the speed [s].
        spin_down: time constant while the speed falls [s]; empty for that of rising speed.
        friction_torque: of bearings, iron and windage, Q_0 [N m].
        copper_loss: c = R / K_t^2 of the motor with its controller [W/(N m)^2].
        radius: of the discs [m].
        max_speed: largest speed that may be commanded [rad/s].
        reverse: thrust backwards against that forwards at equal speed [1]; zero, or empty, for a
            rotor that turns one way: the sign of its speed then means nothing.
        thrust_change: relative change of all thrust coefficients [1].
        torque_change: relative change of all torque coefficients [1].
        first: column of the first of these rotors among the drives of all actuators.
        links: the link that carries them, the root by default.

    Lists of coefficients hold one number a rotor, or one number for all.

    Assumptions:
        Thrust does not depend on the inflow; blades are stiff; the rotor has no angular momentum.

    Valid range:
        Hover and slow flight: advance ratios below about 0.1.

    Limitations:
        No inflow, no flapping, no stall; add ``rotor_drag``, ``ground_effect`` or ``battery``. The
        map is that of one density: add ``rotor_medium`` for rotors that may get under water.

    References:
        Mahony, Kumar, Corke 2012, IEEE Robotics and Automation Magazine 19(3).

    Example:
        >>> Rotors(position=[[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]], direction=[1.0, -1.0]).count
        2
    """

    position: list[list[float]] = field(default_factory=lambda: [[0.0, 0.0, 0.0]])
    axis: list[list[float]] = field(default_factory=list)
    direction: list[float] = field(default_factory=lambda: [1.0])
    thrust_coefficient: list[float] = field(default_factory=lambda: [1e-5])
    torque_coefficient: list[float] = field(default_factory=lambda: [1.5e-7])
    time_constant: list[float] = field(default_factory=lambda: [0.04])
    spin_down: list[float] = field(default_factory=list)
    friction_torque: list[float] = field(default_factory=lambda: [0.0])
    copper_loss: list[float] = field(default_factory=lambda: [0.0])
    radius: list[float] = field(default_factory=lambda: [0.12])
    max_speed: list[float] = field(default_factory=lambda: [1000.0])
    reverse: list[float] = field(default_factory=list)
    thrust_change: float = param(
        0.0,
        "1",
        bounds=(-0.9, 9.0),
        tolerance=0.0,
        source="zero: the coefficients rule",
        later=True,
    )
    torque_change: float = param(
        0.0, "1", bounds=(-0.9, 5.0), tolerance=0.05, source="zero: the coefficients rule"
    )
    first: int = 0
    accounts_for: ClassVar[tuple[str, ...]] = ("rotor thrust",)
    voltage_power: ClassVar[float] = 1.0
    """Power of the battery voltage to which the largest command is proportional."""
    scaled_by: ClassVar[Mapping[str, tuple[str, str]]] = {
        "thrust_coefficient": ("thrust_change", "N/(rad/s)^2"),
        "torque_coefficient": ("torque_change", "N m/(rad/s)^2"),
    }
    """Relative change, and unit, by the list of coefficients that it scales."""
    turned_by: ClassVar[Mapping[str, str]] = {"torque_coefficient": "direction"}
    """Directions by the list whose effect changes its sign with them."""

    def __post_init__(self) -> None:
        """Turn the lists into arrays, or refuse them."""
        self._position = vectors("rotors.position", self.position, len(self.position))
        self._axis = unit_axes("rotors.axis", self.axis, self.count)
        self._direction = numbers("rotors.direction", self.direction, self.count)
        if np.any(np.abs(self._direction) != 1.0):
            raise ConfigError(
                f"rotors.direction={self.direction} is not allowed.\nAllowed: 1 or -1 for each "
                "drive."
            )
        given = {name: getattr(self, name) for name in _SIGNS}
        given["spin_down"] = self.spin_down or self.time_constant
        self._lists = {
            name: numbers(f"rotors.{name}", given[name], self.count, sign=sign)
            for name, sign in _SIGNS.items()
        }
        self._reverse = numbers(
            "rotors.reverse", self.reverse or [0.0], self.count, sign="not negative"
        )
        check_first("rotors.first", self.first)

    @property
    def count(self) -> int:
        """Number of rotors."""
        return len(self.position)

    @property
    def lag(self) -> Floats:
        """Time constants [s], shape (n,)."""
        return self._lists["time_constant"]

    @property
    def fall(self) -> Floats:
        """Spin-down time constants [s], shape (n,)."""
        return self._lists["spin_down"]

    @property
    def limit(self) -> Floats:
        """Largest speeds [rad/s], shape (n,)."""
        return self._lists["max_speed"]

    @property
    def low(self) -> Floats:
        """Lowest speeds, zero for rotors that turn one way [rad/s], shape (n,)."""
        return np.where(self._reverse > 0.0, -self.limit, 0.0)

    def constants(self) -> dict[str, Floats]:
        """Return hubs, axes, coefficients; ``before``: one entry per preceding command column."""
        return {
            "position": self._position,
            "axis": self._axis,
            "radius": self._lists["radius"],
            "thrust_coefficient": self._lists["thrust_coefficient"][None],
            "reaction_coefficient": -(self._direction * self._lists["torque_coefficient"])[None],
            "backward": np.where(self._reverse > 0.0, -self._reverse, 1.0)[None],
            "back_torque": np.where(self._reverse > 0.0, -1.0, 1.0)[None],
            "friction_torque": self._lists["friction_torque"][None],
            "copper_loss": self._lists["copper_loss"][None],
            "before": np.zeros(self.first),
        }

    @staticmethod
    def drives(inputs: Inputs, params: Parameters) -> Drives:
        """Thrusts [N] and reaction torques [N m] of the rotors."""
        first, count = params["before"].shape[0], params["position"].shape[0]
        speed = inputs.drive[:, first : first + count]  # type: ignore[index]
        push = turn = square = speed * speed
        if type(speed) is not np.ndarray or np.count_nonzero(speed < 0.0):
            xp, ahead = namespace(speed), speed >= 0.0
            push = xp.where(ahead, square, params["backward"] * square)
            turn = xp.where(ahead, square, params["back_torque"] * square)
        return Drives(
            position=params["position"],
            axis=params["axis"],
            radius=params["radius"],
            thrust=params["thrust_coefficient"] * (1.0 + params["thrust_change"]) * push,
            torque=params["reaction_coefficient"] * (1.0 + params["torque_change"]) * turn,
            speed=speed,
        )

    @staticmethod
    def power(drives: Drives, params: Parameters) -> Array:
        """Electrical power of the rotors at their actual speed [W]."""
        xp = namespace(drives.torque)
        torque, speed = xp.abs(drives.torque), xp.abs(drives.speed)
        return (torque + params["friction_torque"]) * speed + params[
            "copper_loss"
        ] * torque * torque
