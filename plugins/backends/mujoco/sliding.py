"""Coulomb friction in MuJoCo: correction of its convex contact problem for sliding contacts.

The engine's contact problem is convex because it lets a sliding contact open: the normal
acceleration exceeds its reference by friction times that of the slip. Lowering the reference by
that much, and solving again, gives Coulomb's law.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats

ENOUGH = 1e-3
"""Normal velocity that may be left over [m/s]: it lifts a body by micrometres in a step."""


class Sliding:
    """Correction of the reference normal accelerations of all contacts in one step.

    Equation:
        a_n >= r_n + |mu (a_t - r_t)| is what the engine solves (r: references, t: tangential,
        rolling and spinning). With r_n lowered by the last solution's |mu (a_t - r_t)| the fixed
        point has a_n >= r_n, and friction opposite to the slip at mu times the normal force.

    Args:
        engine: the mujoco module.
        model: of the engine.
        data: after `mj_fwdVelocity`.

    References:
        de Saxce and Feng 1998, doi:10.1016/S0895-7177(98)00119-8; Acary, Cadoux, Lemarechal and
        Malick 2011, doi:10.1002/zamm.201000073.
    """

    def __init__(self, engine: Any, model: Any, data: Any) -> None:
        """Find the rows of the contacts with friction."""
        self._engine, self._model, self._data = engine, model, data
        contact = data.contact
        picked = (contact.efc_address >= 0) & (contact.dim > 1)
        self._first = contact.efc_address[picked]
        self._size, self._friction = contact.dim[picked], contact.friction[picked]
        self._base = data.efc_aref[self._first].copy()
        self._lowered = np.zeros(len(self._first))

    def correct(self, step: float) -> bool:
        """Lower the references by the slip of the last solution; return whether to solve again."""
        if not len(self._first):
            return False
        slip = self._slip()
        moved = np.abs(slip - self._lowered) * step > ENOUGH
        self._lowered = slip
        if not moved.any():
            return False
        self._data.efc_aref[self._first] = self._base - slip
        return True

    def _slip(self) -> Floats:
        """Friction times the slip that friction cannot hold, of every contact [m/s^2]."""
        d = self._data
        found = np.zeros(d.nefc)
        self._engine.mj_mulJacVec(self._model, d, found, d.qacc)
        found -= d.efc_aref
        squares = np.zeros(len(self._first))
        for k in range(1, int(self._size.max())):
            held = self._size > k
            squares[held] += (self._friction[held, k - 1] * found[self._first[held] + k]) ** 2
        slip: Floats = np.sqrt(squares)
        return slip
