"""Record the commands to drives and servos of a robot row by row."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.control.plant import ROTOR, THRUSTER
from seals.run.recorded_rows import refill
from seals.world.actor import Actor

NAMES = {ROTOR: "rotor_speed_cmd", THRUSTER: "thruster_cmd"}
JOINTS = "joint_position_cmd"


class Commands:
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
        self._names = []
        for kind in kinds:
            numbers[kind] += 1
            self._names.append(f"{NAMES[kind]}_{numbers[kind]}")
        self._names += [f"{JOINTS}_{k + 1}" for k in range(joints)]
        self._drives = len(kinds)
        self._table = np.full((steps + 1 if self._names else 0, len(self._names)), np.nan)

    def take(self, row: int) -> None:
        """Record the commands in force from the preceding row to ``row``."""
        if not self._names or row == 0:
            return
        command, joints = self._actor.command, self._actor.joint_command
        rows = slice(row - 1, row + 1)
        if command is not None:
            self._table[rows, : self._drives] = command[0]
        if joints is not None:
            self._table[rows, self._drives :] = joints[0]

    def snapshot(self, rows: int) -> Floats:
        """Return the first ``rows`` rows."""
        return self._table[:rows]

    def restore(self, kept: Any, rows: int) -> None:
        """Continue after the rows of a snapshot.

        Raises:
            ValueError: it is of another run.
        """
        refill(self._table, kept, rows)

    def columns(self, rows: int) -> dict[str, Floats]:
        """Return the first ``rows`` rows as columns of a log; empty without a controller."""
        table = self._table[:rows]
        return {name: np.ascontiguousarray(table[:, k]) for k, name in enumerate(self._names)}
