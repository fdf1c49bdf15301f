"""Coulomb friction in MuJoCo: correction of its convex contact problem for sliding contacts.

The engine's contact problem is convex because it lets a sliding contact open: the normal
acceleration exceeds its reference by friction times that of the slip. Lowering the reference by
that much, and solving again, gives Coulomb's law.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

LOW, HIGH = 0.7, 2.0
"""Least and largest share of a correction that is made, by the secant of the last two [1]."""
ENOUGH = 1e-3
"""Normal velocity that may be left over [m/s]: it lifts a body by micrometres in a step."""


class Sliding:
    """Correction of the reference normal accelerations of all contacts, step by step.

    Equation:
        a_n >= r_n + |mu (a_t - r_t)| is what the engine solves (r: references, t: tangential,
        rolling and spinning). With r_n lowered by the last solution's |mu (a_t - r_t)| the fixed
        point has a_n >= r_n, and friction opposite to the slip at mu times the normal force.

    Args:
        engine: the mujoco module.
        model: of the engine.
        data: of the engine.

    References:
        de Saxce and Feng 1998, doi:10.1016/S0895-7177(98)00119-8; Acary, Cadoux, Lemarechal and
        Malick 2011, doi:10.1002/zamm.201000073.
    """

    def __init__(self, engine: Any, model: Any, data: Any) -> None:
        self._engine, self._model, self._data = engine, model, data

    def begin(self) -> None:
        """Find the rows of the contacts with friction, after `mj_fwdVelocity`."""
        # a few contacts: faster one by one than as arrays
        contact, aref = self._data.contact, self._data.efc_aref.tolist()
        table = zip(
            contact.efc_address.tolist(),
            contact.dim.tolist(),
            contact.friction.tolist(),
            strict=True,
        )
        self._rows = [(k, size, mu) for k, size, mu in table if k >= 0 and size > 1]
        self._base = [aref[k] for k, _, _ in self._rows]
        self._lowered = [0.0] * len(self._rows)
        self._last: tuple[list[float], list[float]] | None = None

    def correct(self, step: float) -> bool:
        """Lower the references by the slip of the last solution; return whether to solve again."""
        if not self._rows:
            return False
        slip = self._slip()
        off = [s - x for s, x in zip(slip, self._lowered, strict=True)]
        if not max(abs(x) for x in off) * step > ENOUGH:
            return False
        lowered = slip
        if self._last is not None:
            columns = zip(self._lowered, off, *self._last, strict=True)
            lowered = [
                max(x + _share(x - before, then - d) * d, 0.0) for x, d, before, then in columns
            ]
        self._last, self._lowered = (self._lowered, off), lowered
        aref = self._data.efc_aref
        for (k, _, _), base, x in zip(self._rows, self._base, lowered, strict=True):
            aref[k] = base - x
        return True

    def _slip(self) -> list[float]:
        """Friction times the slip that friction cannot hold, of every contact [m/s^2]."""
        d = self._data
        found = np.zeros(d.nefc)
        self._engine.mj_mulJacVec(self._model, d, found, d.qacc)
        found -= d.efc_aref
        gap = found.tolist()
        return [
            math.sqrt(sum((mu[j] * gap[k + 1 + j]) ** 2 for j in range(size - 1)))
            for k, size, mu in self._rows
        ]


def _share(moved: float, less: float) -> float:
    """Share of a correction to make: by the secant, where it is not far from one."""
    return min(max(moved / less, LOW), HIGH) if less else 1.0
