"""Contact points of one robot as PyBullet reports them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Floats


class PybulletContacts:
    """Contacts of one step, see `seals.coupling.ContactPoints`.

    Args:
        points: as the engine gives them.
        row: link of the robot model by the engine's number.
    """

    def __init__(self, points: Any, row: Mapping[int, int]) -> None:
        """Find the touched links."""
        self._points = points
        self.links = [row[point[3]] for point in points]

    def forces(self) -> tuple[Floats, Floats, Floats]:
        """Return points, forces and normal forces."""
        # positions, normal, its force, and two directions of friction with theirs
        table = np.array([(*q[5], *q[7], q[9], *q[11], q[10], *q[13], q[12]) for q in self._points])
        parts = table[:, 3:].reshape(-1, 3, 4)
        force: Floats = np.matmul(parts[:, None, :, 3], parts[:, :, :3])[:, 0]
        return table[:, :3], force, table[:, 6]
