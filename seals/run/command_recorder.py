"""Recorder of the commands of a controller to drives and servos."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seals.arrays import Floats
from seals.control.plant import ROTOR, THRUSTER
from seals.run.recorded_rows import Rows
from seals.run.recorder import Moment, Recorder
from seals.world.actor import Actor

NAMES = {ROTOR: "rotor_speed_cmd", THRUSTER: "thruster_cmd"}
JOINTS = "joint_position_cmd"


class Commands(Recorder):
    """Recorder of the commands of one robot, each held from its row to the next.

    Args:
        actor: the robot in its world.
        steps: expected steps; there is one row more, that of the start.
    """

    def __init__(self, actor: Actor, *, steps: int) -> None:
        """Reserve the rows."""
        self._actor, pilot = actor, actor.pilot
        kinds = () if pilot is None else pilot.plant.layout.kind
        joints = 0 if pilot is None else actor.robot.tree.joints
        numbers = dict.fromkeys(NAMES, 0)
        names = []
        for kind in kinds:
            numbers[kind] += 1
            names.append(f"{NAMES[kind]}_{numbers[kind]}")
        names += [f"{JOINTS}_{k + 1}" for k in range(joints)]
        self._drives = len(kinds)
        self._rows = Rows(names, steps + 1)

    def record(self, moment: Moment) -> None:
        """Record the commands in force from the preceding row to the present one."""
        row = moment.row
        self._rows.count = row + 1
        if not self._rows.names or row == 0:
            return
        command, joints = self._actor.command, self._actor.joint_command
        rows = slice(row - 1, row + 1)
        if command is not None:
            self._rows.values[rows, : self._drives] = command[0]
        if joints is not None:
            self._rows.values[rows, self._drives :] = joints[0]

    def snapshot(self) -> Floats:
        """Return the rows so far."""
        return self._rows.snapshot()

    def restore(self, kept: Any, rows: int, folder: Path) -> None:
        """Continue after the rows of a snapshot."""
        self._rows.restore(kept, rows)

    def columns(self, rows: int) -> dict[str, Floats]:
        """Return the first ``rows`` rows as columns of a log; empty without a controller."""
        return self._rows.columns(rows)
