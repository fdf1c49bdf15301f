"""Level control of the moving domain: particles are added or removed to keep the volume."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.plugins.fluids.moving_domain.box import Box

MOST = 0.1
"""Share of the ring's columns that lose or gain a particle in one step, at most."""


LEAST = 0.005
"""Share of them that loses or gains one at once, at least: what is owed adds up until then."""


class Change(NamedTuple):
    """Particles to remove and to add.

    Args:
        gone: rows of those to remove among those of the ring, shape (m,).
        come: places of rest of those to add [m], shape (m, 3).
    """

    gone: Any
    come: Floats


class LevelController:
    """Integral controller of the number of particles.

    A body that dives into the window lifts its surface, which an open sea would not do; a body that
    leaves it lowers the surface; a body under way leaves a trough behind, and less water goes at
    the rear than comes in front. So particles and the volume that bodies take below the surface
    have to make up the box together. Excess is removed at the highest places of the ring, a deficit
    is added at its lowest.

    Args:
        lag: time constant of the correction [s].
    """

    def __init__(self, lag: float) -> None:
        self.lag, self.owed = lag, 0.0

    def change(self, box: Box, rest: Floats, over: float, step: float) -> Change:
        """Return the particles to add and remove after a step.

        Args:
            box: the window.
            rest: places of rest of the particles in the ring [m], shape (n, 3).
            over: particles, and those that would fill the bodies below the surface, over those of
                the box.
            step: [s].
        """
        self.owed += -math.expm1(-step / self.lag) * over
        (length, width, _), ring = box.counts, 2 * box.ring
        columns = length * width - max(length - ring, 0) * max(width - ring, 0)
        if abs(self.owed) < max(1.0, LEAST * columns):
            return Change(np.zeros(0, dtype=int), np.zeros((0, 3)))
        rows, columns, tops = _tops(box, rest)
        count = min(int(abs(self.owed)), max(1, round(MOST * len(rows))))
        self.owed -= math.copysign(count, self.owed)
        order = np.argsort(tops)
        if over > 0:
            return Change(rows[order[-count:]], np.zeros((0, 3)))
        low = order[:count]
        plan = box.lower[:2] + (columns[low] + 0.5) * box.spacing
        return Change(np.zeros(0, dtype=int), np.column_stack([plan, tops[low] + box.spacing]))


def _tops(box: Box, ring: Floats) -> tuple[Any, Any, Floats]:
    """Highest particle of every column of the ring, columns a spacing wide.

    Returns:
        Its row, shape (m,), its column, shape (m, 2), and its height at rest [m], shape (m,).
    """
    most = np.array(box.counts[:2]) - 1
    column = np.floor((ring[:, :2] - box.lower[:2]) / box.spacing).astype(int)
    column = np.clip(column, 0, most)
    order = np.lexsort((-ring[:, 2], column[:, 0] * box.counts[1] + column[:, 1]))
    ordered = column[order]
    first = np.ones(len(order), dtype=bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    rows = order[first]
    return rows, column[rows], ring[rows, 2]
