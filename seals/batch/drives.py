"""Lag and limits of the drives over a batch."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Array, as_like, namespace
from seals.errors import ConfigError
from seals.world.drivetrain import Response

SHORT = 1e-9
"""Shortest time constant [s]."""


class BatchDrives:
    """Drives that follow their commands by x' = (u - x) / tau, solved exactly for held commands.

    Args:
        response: lags and limits of all drives.
        like: array whose library, type and device to use.

    Raises:
        ConfigError: commands arrive late: what is on the way has no form over a batch.
    """

    def __init__(self, response: Response, like: Array) -> None:
        if response.delay > 0.0:
            raise ConfigError(
                f"commands arrive {response.delay:g} s late; a batch has no command delay.\n"
                "Leave the effect command_delay out, or use backend=pybullet."
            )
        self.count = len(response.lag)
        self._rise = as_like(np.maximum(response.lag, SHORT)[None], like)
        self._fall = as_like(np.maximum(response.fall, SHORT)[None], like)
        self._limit = as_like(response.limit[None], like)
        self._power = as_like(response.power[None], like)

    def limited(self, command: Array, share: Array | None) -> Array:
        """Return commands limited by the battery voltage.

        Args:
            command: in the unit of the drives, shape (B, n).
            share: voltage of the battery by its full voltage [1], shape (B, 1); None for full.
        """
        xp = namespace(command)
        most = self._limit
        if share is not None:
            left = xp.minimum(xp.maximum(share, share * 0.0), share * 0.0 + 1.0)
            most = most * left**self._power
        return xp.minimum(xp.maximum(command, -most), most)

    def follow(self, state: Array, goal: Array, span: float) -> Array:
        """Return drive states after ``span`` [s] under held commands, shape (B, n)."""
        xp = namespace(state)
        lag = xp.where(xp.abs(goal) < xp.abs(state), self._fall, self._rise)
        return goal + (state - goal) * xp.exp(-span / lag)

    def zero(self, batch: int, like: Array) -> Any:
        """Return drives at standstill, shape (B, n)."""
        return as_like(np.zeros((batch, self.count)), like)
