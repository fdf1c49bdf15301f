"""Contacts of one robot in the last step; forces are summed on demand."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.backend import LinksAt
from seals.coupling.engine import ContactPoints
from seals.frames import cross


class Contacts:
    """Contacts on the links of a robot in the last step.

    Args:
        links: number of links.

    Attributes:
        any: whether there are any.
    """

    def __init__(self, links: int) -> None:
        self._none = np.zeros((links, 6)), np.zeros(links)
        for zeros in self._none:
            zeros.setflags(write=False)
        self.forget()

    def forget(self) -> None:
        """Clear all contacts."""
        self._points: ContactPoints | None = None
        self._began: LinksAt | None = None
        self._sums: tuple[Floats, Floats] | None = self._none
        self.any = False
        self._touched: frozenset[int] | None = frozenset()

    def note(self, points: ContactPoints | None, began: LinksAt | None) -> None:
        """Store the engine's contact points of a step.

        Args:
            points: as the engine gives them; None for nothing.
            began: the links where the step began: there the engine found the contacts.
        """
        if points is None:
            if self.any:
                self.forget()
            return
        self._points, self._began, self._sums, self.any = points, began, None, True
        self._touched = None

    @property
    def links(self) -> frozenset[int]:
        """The links that were touched."""
        if self._touched is None:
            assert self._points is not None
            self._touched = frozenset(self._points.links)
        return self._touched

    def wrenches(self) -> Floats:
        """Return the wrenches about the link origins, link axes [N, N m], shape (L, 6)."""
        return self._summed()[0]

    def normals(self) -> Floats:
        """Return the sum of the normal forces on every link [N], shape (L,)."""
        return self._summed()[1]

    def snapshot(self) -> Any:
        """Return the complete state."""
        return self._summed(), self.any, self.links

    def restore(self, kept: Any) -> None:
        """Restore a snapshot."""
        self._sums, self.any, self._touched = kept

    def _summed(self) -> tuple[Floats, Floats]:
        """Sum normal and friction forces per link, and the normal forces alone."""
        if self._sums is not None:
            return self._sums
        assert self._began is not None
        assert self._points is not None
        origins, rotations = self._began.kinematics.origins[0], self._began.kinematics.rotations[0]
        links = self._points.links
        points, force, normal = self._points.forces()
        parts = np.empty((len(links), 2, 3))
        parts[:, 0], parts[:, 1] = force, cross(points - origins.take(links, axis=0), force)
        own = np.matmul(parts, rotations.take(links, axis=0)).reshape(-1, 6).tolist()
        out, pressing = [[0.0] * 6 for _ in self._none[1]], [0.0] * len(self._none[1])
        # a few contacts, some on one link: faster one by one than as arrays
        for link, wrench, push in zip(links, own, normal.tolist(), strict=True):
            out[link] = [a + b for a, b in zip(out[link], wrench, strict=True)]
            pressing[link] += push
        self._sums = np.array(out), np.array(pressing)
        return self._sums
