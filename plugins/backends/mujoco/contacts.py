"""Contact points of one robot as MuJoCo reports them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats


class MujocoContacts:
    """Contacts of one step, see `seals.coupling.ContactPoints`.

    Args:
        data: of the engine after a step.
        touched: whether the first and the second shape of every contact is the robot's, shape
            (C, 2).
        link: row of the link of every shape.
    """

    def __init__(self, data: Any, touched: NDArray[np.bool_], link: NDArray[np.int64]) -> None:
        """Find the touched links."""
        self._data = data
        self._contact, self._side = np.nonzero(touched)
        self.links = link[data.contact.geom[self._contact, self._side]].tolist()

    def forces(self) -> tuple[Floats, Floats, Floats]:
        """Return points, forces and normal forces."""
        contact, rows = self._data.contact, self._contact
        start, size = contact.efc_address[rows], contact.dim[rows]
        found = self._data.efc_force
        # normal force and two of friction, where there are any
        parts = np.zeros((len(rows), 3))
        for k in range(3):
            held = (start >= 0) & (size > k)
            parts[held, k] = found[start[held] + k]
        force = np.matmul(parts[:, None, :], contact.frame[rows].reshape(-1, 3, 3))[:, 0]
        # a contact pushes its second shape along the normal, and the first one back
        force[self._side == 0] *= -1.0
        return contact.pos[rows].copy(), force, parts[:, 0]
