"""Leapfrog integration: half-step velocities that make positions second order."""

from __future__ import annotations

from typing import NamedTuple

from seals.arrays import Floats
from seals.state_records import state_record


@state_record
class HalfStep(NamedTuple):
    """Generalised velocity at two instants of the leapfrog method.

    Equation:
        v(t + h/2) = v(t - h/2) + h a(t), x(t + h) = x(t) + h v(t + h/2), and
        v(t + h) = v(t + h/2) + h a(t) / 2 where forces need it.

    Args:
        now: at the current time, shape (n,).
        middle: half a step earlier, shape (n,); None after a start, a stop or a contact, where the
            pose moves with ``now``.

    References:
        Hairer, Lubich and Wanner 2003, doi:10.1017/S0962492902000144.

    Example:
        >>> import numpy as np
        >>> HalfStep(np.array([0.0])).kicked(np.array([2.0]))
        HalfStep(now=array([2.]), middle=array([1.]))
    """

    now: Floats
    middle: Floats | None = None

    def kicked(self, kick: Floats) -> HalfStep:
        """Return the velocities one step later.

        Args:
            kick: change of velocity over the step, h a, shape (n,).
        """
        half = 0.5 * kick
        middle = self.now + half if self.middle is None else self.middle + kick
        return HalfStep(middle + half, middle)

    @property
    def way(self) -> Floats:
        """Return the velocity with which the pose moved over the last step, shape (n,)."""
        return self.now if self.middle is None else self.middle

    def acceleration(self, step: float) -> Floats | None:
        """Return the acceleration of the last step of h [s], shape (n,); None after a start."""
        return None if self.middle is None else 2.0 * (self.now - self.middle) / step
