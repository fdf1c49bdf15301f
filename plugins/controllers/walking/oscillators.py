"""Central pattern generator: one coupled phase oscillator per leg."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from seals.arrays import Array, namespace
from seals.plugins.controllers.walking.pattern import lagged
from seals.plugins.controllers.walking.walker import Manner, Pace, Walker
from seals.schema import setting


@dataclass(kw_only=True)
class Oscillators(Walker):
    """Walking controller of coupled oscillators: the gait emerges from their coupling.

    Equation:
        d phi_i / dt = f + (coupling / N) sum_j sin(2 pi (phi_j - phi_i - o_j + o_i)) / (2 pi), phi
        in cycles, o_i = along rank_i + across side_i.

    Args:
        duty: share of the cycle on the ground [1].
        along: phase by which a leg lags behind the one in front [cycles].
        across: phase by which the right side lags behind the left [cycles].
        coupling: rate at which the legs find their order [1/s].

    Assumptions:
        All legs are coupled alike.

    Valid range:
        Robots with legs of three joints, four legs or more.

    Limitations:
        No feeling in the legs: a toe that finds no ground changes nothing.

    References:
        Ijspeert 2008, Neural Networks 21(4), 642-653 (central pattern generators); Kuramoto 1984,
        Chemical Oscillations, Waves, and Turbulence.

    Example:
        >>> Oscillators(along=0.4).coupling
        8.0
    """

    duty: float = setting(0.55, "1", bounds=(0.05, 0.95), source="chosen")
    along: float = setting(0.5, "cycles", bounds=(-1.0, 1.0), source="chosen: tripod")
    across: float = setting(0.5, "cycles", bounds=(-1.0, 1.0), source="chosen: tripod")
    coupling: float = setting(8.0, "1/s", bounds=(0.0, 1e3), source="chosen: some steps")

    def rhythm(self) -> dict[str, float]:
        """Return the duty factor and the phase lags."""
        return {"duty": self.duty, "along": self.along, "across": self.across}

    def order(self, manner: Manner) -> Array:
        """Return the phases that the oscillators tend to, shape (N,)."""
        return lagged(self._legs, manner.along, manner.across)

    def advanced(self, pace: Pace, manner: Manner, step: float) -> Array:
        """Return the phases one period later, shape (B, N)."""
        xp, apart = namespace(pace.phase), pace.phase - self.order(manner)
        turns = 2.0 * np.pi * (apart[:, None, :] - apart[:, :, None])
        pull = xp.sum(xp.sin(turns), axis=2) * (self.coupling / (2.0 * np.pi * apart.shape[1]))
        later = pace.phase + step * (pace.frequency + pull)
        return later - xp.floor(later)
