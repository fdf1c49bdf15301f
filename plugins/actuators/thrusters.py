"""Underwater thrusters commanded by force."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects.effect import ActuatorOptions, Effect, Parameters
from seals.motion import Drives, Inputs
from seals.plugins.actuators.layout import check_first, numbers, unit_axes, vectors


@dataclass(kw_only=True)
class Thrusters(ActuatorOptions, Effect):
    """Thrusters fixed to a link whose electronics turn a commanded force into speed.

    Equation:
        T = f along the axis, no reaction torque. The caller makes f from the command: delay, then
        f' = (command - f) / time_constant. Electrical power c abs(f)^1.5.

    Args:
        position: of the thrusters in link axes [m], one row of three numbers a thruster.
        axis: of positive thrust [1], one row a thruster, or one for all; empty for link z.
        time_constant: of the force [s], one number a thruster, or one for all.
        max_force: largest force that may be commanded [N], likewise.
        power_coefficient: c [W/N^1.5], likewise; 1 / (eta sqrt(2 rho A)) by momentum theory.
        first: column of the first of these thrusters among the drives of all actuators.
        links: the link that carries them, the root by default.

    Assumptions:
        The static map from force to speed is known and inverted; counter-rotating or ducted blades
        leave no reaction torque.

    Valid range:
        Slow vehicles: flow through the thruster far below that of its own jet.

    Limitations:
        Forces are those under water, at rest, for every command: add ``thruster_medium`` where
        thrusters may come out of it, ``thruster_inflow`` and ``thruster_dead_zone`` for what is
        lost at speed and about zero. No loss by ventilation or the hull.

    References:
        Fossen 2011, Handbook of Marine Craft Hydrodynamics, ch. 12.

    Example:
        >>> Thrusters(position=[[0.0, 0.2, 0.0], [0.0, -0.2, 0.0]], axis=[[1.0, 0.0, 0.0]]).count
        2
    """

    position: list[list[float]] = field(default_factory=lambda: [[0.0, 0.0, 0.0]])
    axis: list[list[float]] = field(default_factory=list)
    time_constant: list[float] = field(default_factory=lambda: [0.1])
    max_force: list[float] = field(default_factory=lambda: [50.0])
    power_coefficient: list[float] = field(default_factory=lambda: [0.7])
    first: int = 0
    accounts_for: ClassVar[tuple[str, ...]] = ("thruster force",)
    voltage_power: ClassVar[float] = 2.0
    """Power of the battery voltage to which the largest command is proportional."""

    def __post_init__(self) -> None:
        """Turn the lists into arrays, or refuse them."""
        self._position = vectors("thrusters.position", self.position, len(self.position))
        self._axis = unit_axes("thrusters.axis", self.axis, self.count)
        self._lag = numbers(
            "thrusters.time_constant", self.time_constant, self.count, sign="not negative"
        )
        self._limit = numbers("thrusters.max_force", self.max_force, self.count, sign="positive")
        self._cost = numbers(
            "thrusters.power_coefficient", self.power_coefficient, self.count, sign="not negative"
        )
        check_first("thrusters.first", self.first)

    @property
    def count(self) -> int:
        """Number of thrusters."""
        return len(self.position)

    @property
    def lag(self) -> Floats:
        """Time constants [s], shape (n,)."""
        return self._lag

    @property
    def limit(self) -> Floats:
        """Largest forces [N], shape (n,)."""
        return self._limit

    def constants(self) -> dict[str, Floats]:
        """Return the parameters; the length of ``before`` is the column of the first thruster."""
        return {
            "position": self._position,
            "axis": self._axis,
            "radius": np.zeros(self.count),
            "power_coefficient": self._cost[None],
            "before": np.zeros(self.first),
        }

    @staticmethod
    def drives(inputs: Inputs, params: Parameters) -> Drives:
        """Thrusts [N] of the thrusters."""
        first, count = params["before"].shape[0], params["position"].shape[0]
        force = inputs.drive[:, first : first + count]  # type: ignore[index]
        return Drives(
            position=params["position"],
            axis=params["axis"],
            radius=params["radius"],
            thrust=force,
            torque=force * 0.0,
        )

    @staticmethod
    def power(drives: Drives, params: Parameters) -> Array:
        """Electrical power of the thrusters [W]."""
        force = namespace(drives.thrust).abs(drives.thrust)
        return params["power_coefficient"] * force**1.5
