"""Base of controllers of vehicles with thrusters: allocation, thruster lag and integrators."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from seals.arrays import Array, Floats, as_like
from seals.control import Plant, Reference, RobotState
from seals.control.added import added_inertia
from seals.control.allocation import Allocation, Saturation
from seals.control.axes import (
    HEAVE,
    PITCH,
    ROLL,
    SURGE,
    SWAY,
    YAW,
    commanded_axes,
    mean_arm,
    named_axes,
    priority_weights,
    wrench_matrix,
)
from seals.control.filters import Lag, summed
from seals.control.limbs import stowed
from seals.control.mass_properties import MassPropertyEstimator
from seals.control.plant import Layout
from seals.control.protocols import ControllerOptions
from seals.errors import ConfigError


class VehicleController(ControllerOptions, ABC):
    """Base of a controller that allocates a wrench to thrusters, by the axes that they command."""

    saturation: Saturation
    priority: list[str]
    position_gain: float
    turn_sum_gain: float
    turn_sum_limit: float
    quicker: float

    def _allocate(
        self,
        plant: Plant,
        layout: Layout,
        order: Sequence[int],
        needed: Sequence[int],
        *,
        like: Array | None = None,
        joints: Floats | None = None,
    ) -> list[int]:
        """Find commanded axes and allocation at held joints or the rest pose; return the axes.

        Raises:
            ConfigError: one of the needed axes is not commanded; the lines are those of ``_unfit``.
        """
        self._plant, self._g = plant, plant.gravity
        self._rest = stowed(plant.robot) if joints is None else joints
        centre = MassPropertyEstimator(plant.robot).at(self._rest).centre
        axes = commanded_axes(wrench_matrix(layout, centre), mean_arm(layout, centre), order)
        missing = [k for k in needed if k not in axes]
        if missing:
            raise ConfigError(self._unfit(layout, named_axes(missing)))
        self._rows = list(axes)
        like = np.zeros(1) if like is None else like
        self._pushed = as_like([float(k in axes) for k in (SURGE, SWAY, HEAVE)], like)
        self._turned = as_like([float(k in axes) for k in (ROLL, PITCH, YAW)], like)
        self._allocation = Allocation(
            layout,
            rows=axes,
            saturation=self.saturation,
            weights=priority_weights(self.priority, axes),
            centre=centre,
            like=like,
        )
        self._lag = Lag(plant.layout.lag, plant.layout.fall, like)
        self._added = as_like(added_inertia(plant), like)
        return self._rows

    @abstractmethod
    def _unfit(self, layout: Layout, missing: str) -> str:
        """Return the refusal of a robot whose drives do not command some axes."""

    def _wanted_velocity(self, s: RobotState, aim: Reference) -> Array:
        """Return the velocity of the reference, with that towards its position [m/s]."""
        if aim.position is None:
            return aim.velocity
        return aim.velocity + self.position_gain * (aim.position - s.position)

    def _quickened(self, s: RobotState, wanted: Array, drive: Array | None) -> tuple[Array, Array]:
        """Return the commands to the thrusters and their states after them."""
        before = wanted if drive is None else drive
        order = self._lag.quickened(wanted, before, self.quicker, (s.low, s.limit))
        return order, self._lag.followed(before, order, s.step)

    def _turn_summed(self, before: Array, error: Array, step: float) -> Array:
        """Return the bounded integral of the attitude error [rad s]."""
        return summed(before, error, step, self.turn_sum_limit / max(self.turn_sum_gain, 1e-9))
