"""Limits of joints in the accelerations that loads are made from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats

_NEAR = 1e-6
"""Distance to a limit at which a joint stands at it [rad or m]."""


class NearStops(NamedTuple):
    """Joints that stand at a limit or reach it in the next step.

    Args:
        low: least acceleration that keeps every joint inside [rad/s^2 or m/s^2], shape (J,); minus
            infinity for joints that are far from their lower limit.
        high: greatest, likewise.
    """

    low: Floats
    high: Floats

    def held(self, matrix: Floats, acceleration: Floats) -> Floats:
        """Return the generalised acceleration with the reactions of the limits, shape (n,).

        Equation:
            M a' = M a + e_j r_j over the joints j at a limit, with a'_j at its bound and the
            reaction r_j pushing inwards; limits that would pull let go (active set).

        Args:
            matrix: M, with the inertia of drives, shape (n, n).
            acceleration: a, without limits, shape (n,).
        """
        joints = len(self.low)
        lead = len(acceleration) - joints
        free = acceleration[lead:]
        bound = np.clip(free, self.low, self.high)
        active = bound != free
        if not active.any():
            return acceleration
        inverse = np.linalg.inv(matrix)
        # every pass adds or drops limits; more passes than sets of one joint each are not needed
        for _ in range(2 * joints + 2):
            rows = lead + np.flatnonzero(active)
            target = np.where(free > self.high, self.high, self.low)[active]
            reaction = np.linalg.solve(inverse[np.ix_(rows, rows)], target - acceleration[rows])
            out: Floats = acceleration + inverse[:, rows] @ reaction
            inwards = np.where(free > self.high, -1.0, 1.0)[active]
            pulling, wrong = reaction * inwards < 0.0, np.zeros(joints, dtype=bool)
            wrong[np.flatnonzero(active)] = pulling
            now = out[lead:]
            beyond = ~active & ((now < self.low - 1e-9) | (now > self.high + 1e-9))
            if not wrong.any() and not beyond.any():
                return out
            free = np.where(beyond, now, free)
            active = (active & ~wrong) | beyond
            if not active.any():
                return acceleration
        return out


class JointStops:
    """Limits of the joints of a robot.

    Args:
        lower: [rad or m], minus infinity for none, shape (J,).
        upper: likewise.
    """

    def __init__(self, lower: Floats, upper: Floats) -> None:
        self._lower, self._upper = lower, upper
        self._any = bool(np.isfinite(lower).any() or np.isfinite(upper).any())

    def near(self, joints: Floats, rates: Floats, step: float) -> NearStops | None:
        """Return the limits that matter in the next step; None for none.

        Args:
            joints: positions [rad or m], shape (J,).
            rates: [rad/s or m/s], shape (J,).
            step: h [s].
        """
        if not self._any:
            return None
        low, high = np.full(len(joints), -np.inf), np.full(len(joints), np.inf)
        ahead = joints + step * rates
        below, above = ahead <= self._lower + _NEAR, ahead >= self._upper - _NEAR
        if not (below.any() or above.any()):
            return None
        # the rate that just reaches the limit, none beyond it
        room = np.minimum(self._lower - joints, 0.0), np.maximum(self._upper - joints, 0.0)
        low[below] = ((room[0] / step - rates) / step)[below]
        high[above] = ((room[1] / step - rates) / step)[above]
        return NearStops(low, high)
