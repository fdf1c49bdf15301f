"""Limits of joints in the accelerations that loads are made from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats


class NearStops(NamedTuple):
    """Joints whose limits act in the next step of the engine.

    Args:
        low: least acceleration that the lower limits allow [rad/s^2 or m/s^2], shape (J,); minus
            infinity for joints that have not passed theirs.
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
    """Limits of the joints of a robot, as the engine keeps them.

    Equation:
        A limit acts in a step at whose start the joint has passed it by d >= 0, and leaves the rate
        c d / h inwards at least: v' <= -c d / h at an upper limit. A limit that is reached within
        the step does not act yet: a load that counted on its reaction would push the joint through.

    Args:
        lower: [rad or m], minus infinity for none, shape (J,).
        upper: likewise.
        taken_back: c, share of d that the engine takes back in a step [1].
    """

    def __init__(self, lower: Floats, upper: Floats, taken_back: float) -> None:
        self._lower, self._upper, self._taken_back = lower, upper, taken_back
        self._any = bool(np.isfinite(lower).any() or np.isfinite(upper).any())

    def near(self, joints: Floats, rates: Floats, step: float) -> NearStops | None:
        """Return the limits that act in the next step; None for none.

        Args:
            joints: positions [rad or m], shape (J,).
            rates: [rad/s or m/s], shape (J,).
            step: h [s].
        """
        if not self._any:
            return None
        below, above = joints <= self._lower, joints >= self._upper
        if not (below.any() or above.any()):
            return None
        low, high = np.full(len(joints), -np.inf), np.full(len(joints), np.inf)
        back = self._taken_back / step
        low[below] = ((back * (self._lower - joints) - rates) / step)[below]
        high[above] = ((back * (self._upper - joints) - rates) / step)[above]
        return NearStops(low, high)
