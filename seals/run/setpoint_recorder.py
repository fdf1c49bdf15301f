"""Recorder of the references of the guide, the actions of a demonstration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.control import Reference
from seals.run.recorded_rows import refill
from seals.world.pilot import Pilot


class Aims:
    """Recorder of the references of one robot, each held until the next row.

    Args:
        pilot: guide and controller of the robot, or None.
        steps: expected steps; there is one row more, that of the start.
    """

    def __init__(self, pilot: Pilot | None, *, steps: int) -> None:
        """Reserve the rows."""
        self._pilot = pilot
        self._grippers = () if pilot is None else tuple(pilot.plant.robot.grippers)
        self._names = [*(f"aim_velocity_{axis}" for axis in "xyz"), "aim_yaw", "aim_yaw_rate"]
        self._names += [f"aim_grip_{k + 1}" for k in range(len(self._grippers))]
        self._table = np.full((0 if pilot is None else steps + 1, len(self._names)), np.nan)
        self._grip: Floats = np.zeros(len(self._grippers))

    def take(self, row: int) -> None:
        """Record the reference in force from the preceding row to ``row``."""
        aim = None if self._pilot is None else self._pilot.aim
        if aim is not None:
            self._table[max(row - 1, 0) : row + 1] = self._values(aim)

    def snapshot(self, rows: int) -> dict[str, Floats]:
        """Return the first ``rows`` rows, and the last grip references."""
        return {"rows": self._table[:rows], "grip": self._grip}

    def restore(self, kept: Mapping[str, Any], rows: int) -> None:
        """Continue after the rows of a snapshot.

        Raises:
            ValueError: it is of another run.
        """
        refill(self._table, kept["rows"], rows)
        refill(self._grip, kept["grip"], len(self._grip))

    def columns(self, rows: int) -> dict[str, Floats]:
        """Return the first ``rows`` rows as columns of a log; empty without a guide."""
        if self._pilot is None:
            return {}
        table = self._table[:rows]
        return {name: np.ascontiguousarray(table[:, k]) for k, name in enumerate(self._names)}

    def _values(self, aim: Reference) -> Floats:
        # a gripper that the aim leaves out keeps its last grip
        pairs = zip(self._grippers, self._grip, strict=True)
        self._grip = np.array([float(aim.grip.get(name, last)) for name, last in pairs])
        return np.array([*aim.velocity, aim.yaw, aim.yaw_rate, *self._grip])
