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
        self._data, self._touched, self._of = data, touched, link
        self._found: tuple[Any, Any, list[int]] | None = None

    @property
    def links(self) -> list[int]:
        """Row of the touched link at every contact."""
        return self._rows()[2]

    def _rows(self) -> tuple[Any, Any, list[int]]:
        """Contacts of the robot, which of their shapes is its, and the links."""
        if self._found is None:
            contact, side = np.nonzero(self._touched)
            links = self._of[self._data.contact.geom[contact, side]].tolist()
            self._found = contact, side, links
        return self._found

    def forces(self) -> tuple[Floats, Floats, Floats]:
        """Return points, forces and normal forces."""
        contact, (rows, side, _) = self._data.contact, self._rows()
        start, size = contact.efc_address[rows], contact.dim[rows]
        found = self._data.efc_force
        # normal force and two of friction, where there are any
        parts = np.zeros((len(rows), 3))
        for k in range(3):
            held = (start >= 0) & (size > k)
            parts[held, k] = found[start[held] + k]
        force = np.matmul(parts[:, None, :], contact.frame[rows].reshape(-1, 3, 3))[:, 0]
        # a contact pushes its second shape along the normal, and the first one back
        force[side == 0] *= -1.0
        return contact.pos[rows].copy(), force, parts[:, 0]
