"""Contacts of one robot in the last step; their forces are summed only when somebody asks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.frames import cross


class Touches:
    """What touched the links of a robot in the last step.

    Args:
        index: the engine's number of every link.

    Attributes:
        any: whether anything did.
        links: the links that were touched.
    """

    def __init__(self, index: Sequence[int]) -> None:
        """Start untouched."""
        self._row = {number: k for k, number in enumerate(index)}
        self._none = np.zeros((len(index), 6)), np.zeros(len(index))
        for zeros in self._none:
            zeros.setflags(write=False)
        self.forget()

    def forget(self) -> None:
        """Nothing touches."""
        self._points: Any = ()
        self._began: tuple[Floats, Floats] | None = None
        self._sums: tuple[Floats, Floats] | None = self._none
        self.any, self.links = False, frozenset[int]()

    def note(self, points: Any, began: tuple[Floats, Floats]) -> None:
        """Keep the engine's contact points of a step.

        Args:
            points: as the engine gives them.
            began: origins (L, 3) and rotations (L, 3, 3) of the links where the step began: there
                the engine found the contacts.
        """
        if not points:
            if self.any:
                self.forget()
            return
        self._points, self._began, self._sums, self.any = points, began, None, True
        self.links = frozenset(self._row[point[3]] for point in points)

    def wrenches(self) -> Floats:
        """Return the wrenches about the link origins, link axes [N, N m], shape (L, 6)."""
        return self._summed()[0]

    def normals(self) -> Floats:
        """Return the sum of the normal forces on every link [N], shape (L,)."""
        return self._summed()[1]

    def snapshot(self) -> Any:
        """Return all of it."""
        return self._summed(), self.any, self.links

    def restore(self, kept: Any) -> None:
        """Put a snapshot back."""
        self._sums, self.any, self.links = kept

    def _summed(self) -> tuple[Floats, Floats]:
        """Sum normal and friction forces per link, and the normal forces alone."""
        if self._sums is not None:
            return self._sums
        assert self._began is not None
        origins, rotations = self._began
        out, pressing = np.zeros_like(self._none[0]), np.zeros_like(self._none[1])
        # positions, normal, its force, and two directions of friction with theirs
        table = np.array([(*q[5], *q[7], q[9], *q[11], q[10], *q[13], q[12]) for q in self._points])
        force = sum(table[:, [c + 3]] * table[:, c : c + 3] for c in (3, 7, 11))
        links = [self._row[q[3]] for q in self._points]
        torque = cross(table[:, :3] - origins[links], force)
        for row, k in enumerate(links):
            turn = rotations[k]
            out[k, :3] += force[row] @ turn
            out[k, 3:] += torque[row] @ turn
            pressing[k] += table[row, 6]
        self._sums = out, pressing
        return self._sums
