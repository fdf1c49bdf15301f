"""Recorder of the references of the guide, the actions of a demonstration."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.control import Reference
from seals.run.recorded_rows import Rows, refill
from seals.run.recorder import Moment, Recorder
from seals.world.pilot import Pilot


class Aims(Recorder):
    """Recorder of the references of one robot, each held until the next row.

    Args:
        pilot: guide and controller of the robot, or None.
        steps: expected steps; there is one row more, that of the start.
    """

    def __init__(self, pilot: Pilot | None, *, steps: int) -> None:
        """Reserve the rows."""
        self._pilot = pilot
        self._grippers = () if pilot is None else tuple(pilot.plant.robot.grippers)
        names = [*(f"aim_velocity_{axis}" for axis in "xyz"), "aim_yaw", "aim_yaw_rate"]
        names += [f"aim_grip_{k + 1}" for k in range(len(self._grippers))]
        self._rows = Rows(names, 0 if pilot is None else steps + 1)
        self._grip: Floats = np.zeros(len(self._grippers))

    def record(self, moment: Moment) -> None:
        """Record the reference in force from the preceding row to the present one."""
        row = moment.row
        self._rows.count = row + 1
        aim = None if self._pilot is None else self._pilot.aim
        if aim is not None:
            self._rows.values[max(row - 1, 0) : row + 1] = self._values(aim)

    def snapshot(self) -> dict[str, Floats]:
        """Return the rows so far, and the last grip references."""
        return {"rows": self._rows.snapshot(), "grip": self._grip}

    def restore(self, kept: Mapping[str, Any], rows: int, folder: Path) -> None:
        """Continue after the rows of a snapshot."""
        self._rows.restore(kept["rows"], rows)
        refill(self._grip, kept["grip"], len(self._grip))

    def columns(self, rows: int) -> dict[str, Floats]:
        """Return the first ``rows`` rows as columns of a log; empty without a guide."""
        return self._rows.columns(rows)

    def _values(self, aim: Reference) -> Floats:
        # a gripper that the aim leaves out keeps its last grip
        pairs = zip(self._grippers, self._grip, strict=True)
        self._grip = np.array([float(aim.grip.get(name, last)) for name, last in pairs])
        return np.array([*aim.velocity, aim.yaw, aim.yaw_rate, *self._grip])
