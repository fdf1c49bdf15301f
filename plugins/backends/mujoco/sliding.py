"""Coulomb friction in MuJoCo: correction of its convex contact problem for sliding contacts.

The engine's contact problem is convex because it lets a sliding contact open: the normal
acceleration exceeds its reference by friction times that of the slip. Lowering the reference by
that much, and solving again, gives Coulomb's law.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats

_TANGENTS = np.array([[1, 2]])
LOW, HIGH = 0.7, 2.0
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
        """Keep the engine."""
        self._engine, self._model, self._data = engine, model, data

    def begin(self) -> None:
        """Find the rows of the contacts with friction."""
        contact, data = self._data.contact, self._data
        start, size = contact.efc_address, contact.dim
        picked = np.flatnonzero((start >= 0) & (size > 1))
        self._first, self._size = start[picked], size[picked]
        self._friction = contact.friction[picked]
        self._base = data.efc_aref[self._first]
        self._most = int(self._size.max(initial=0))
        self._same = self._most == 3 and bool((self._size == 3).all())
        self._lowered = np.zeros(len(picked))
        self._last: tuple[Floats, Floats] | None = None

    def correct(self, step: float) -> bool:
        """Lower the references by the slip of the last solution; return whether to solve again."""
        if not len(self._first):
            return False
        slip = self._slip()
        off = slip - self._lowered
        if not np.count_nonzero(np.abs(off) * step > ENOUGH):
            return False
        lowered = slip
        if self._last is not None:
            before, then = self._last
            change = then - off
            with np.errstate(divide="ignore", invalid="ignore"):
                pace = np.where(change == 0.0, 1.0, (self._lowered - before) / change)
            lowered = self._lowered + np.clip(pace, LOW, HIGH) * off
            lowered = np.maximum(lowered, 0.0)
        self._last = self._lowered, off
        self._lowered = lowered
        self._data.efc_aref[self._first] = self._base - lowered
        return True

    def _slip(self) -> Floats:
        """Friction times the slip that friction cannot hold, of every contact [m/s^2]."""
        d = self._data
        found = np.zeros(d.nefc)
        self._engine.mj_mulJacVec(self._model, d, found, d.qacc)
        found -= d.efc_aref
        if self._same:
            # rows of two tangents, as a rule
            both = self._friction[:, :2] * found[self._first[:, None] + _TANGENTS]
            slip: Floats = np.sqrt(np.einsum("ij,ij->i", both, both))
            return slip
        squares = np.zeros(len(self._first))
        for k in range(1, self._most):
            held = self._size > k
            squares[held] += (self._friction[held, k - 1] * found[self._first[held] + k]) ** 2
        slip = np.sqrt(squares)
        return slip
