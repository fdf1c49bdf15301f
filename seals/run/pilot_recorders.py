"""Recorders of guide and controller: references, commands, stages, and times of contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.control import Reference
from seals.control.plant import ROTOR, THRUSTER
from seals.control.protocols import Goal
from seals.run.recorder import Moment, Recorder, Rows, refill
from seals.state_records import fits
from seals.world.actor import Actor
from seals.world.pilot import Pilot


class _TableRecorder(Recorder):
    """Recorder of one table; without guide and controller it has no rows."""

    _rows: Rows

    def snapshot(self) -> Any:
        """Return the rows so far."""
        return self._rows.snapshot()

    def restore(self, kept: Any, rows: int, folder: Path) -> None:
        """Continue after the rows of a snapshot."""
        self._rows.restore(kept, rows)

    def columns(self, rows: int) -> dict[str, Floats]:
        """Return the first ``rows`` rows as columns of a log; empty if nothing is recorded."""
        return self._rows.columns(rows)


class Aims(_TableRecorder):
    """Recorder of the references of one robot, each held until the next row.

    They are the actions of a demonstration.

    Args:
        pilot: guide and controller of the robot, or None.
        steps: expected steps; there is one row more, that of the start.
    """

    def __init__(self, pilot: Pilot | None, *, steps: int) -> None:
        self._pilot = pilot
        self._grippers = () if pilot is None else tuple(pilot.plant.robot.grippers)
        names = [*(f"aim_velocity_{axis}" for axis in "xyz"), "aim_yaw", "aim_yaw_rate"]
        names += [f"aim_grip_{k + 1}" for k in range(len(self._grippers))]
        self._rows = Rows(names, 0 if pilot is None else steps + 1)
        self._grip: Floats = np.zeros(len(self._grippers))

    def record(self, moment: Moment) -> None:
        """Record the reference in force from the preceding row to the present one."""
        row, past = moment.row, moment.history
        self._rows.count = row + 1
        aim = None if self._pilot is None else self._pilot.aim
        if past is not None and past.aim is not None and self._pilot is not None:
            rows = self._rows.values[moment.first - 1 : row - 1]
            rows[:] = self._values(past.aim)
            rows[:, :3] = past.velocities()
        if aim is not None:
            self._rows.values[max(row - 1, 0) : row + 1] = self._values(aim)

    def snapshot(self) -> dict[str, Floats]:
        """Return the rows so far, and the last grip references."""
        return {"rows": super().snapshot(), "grip": self._grip}

    def restore(self, kept: Mapping[str, Any], rows: int, folder: Path) -> None:
        """Continue after the rows of a snapshot."""
        super().restore(kept["rows"], rows, folder)
        refill(self._grip, kept["grip"], len(self._grip))

    def _values(self, aim: Reference) -> Floats:
        # a gripper that the aim leaves out keeps its last grip
        pairs = zip(self._grippers, self._grip, strict=True)
        self._grip = np.array([float(aim.grip.get(name, last)) for name, last in pairs])
        return np.array([*aim.velocity, aim.yaw, aim.yaw_rate, *self._grip])


NAMES = {ROTOR: "rotor_speed_cmd", THRUSTER: "thruster_cmd"}
JOINTS = "joint_position_cmd"


class Commands(_TableRecorder):
    """Recorder of the commands of one robot, each held from its row to the next.

    Args:
        actor: the robot in its world.
        steps: expected steps; there is one row more, that of the start.
    """

    def __init__(self, actor: Actor, *, steps: int) -> None:
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
        if moment.history is not None:
            # the commands of steps that were made at once, from a row on
            first, past = moment.first - 1, moment.history
            lines, commands = self._rows.values[first : first + len(past.times)], past.commands()
            if commands is not None:
                lines[:, : self._drives] = commands
            asked = past.joint_commands()
            if asked is not None:
                lines[:, self._drives :] = asked
        rows = slice(row - 1, row + 1)
        if command is not None:
            self._rows.values[rows, : self._drives] = command[0]
        if joints is not None:
            self._rows.values[rows, self._drives :] = joints[0]


GAP = 0.1
"""Time without contact below which two contacts count as one [s]: shorter than any use of it."""


class Contacts(Recorder):
    """Recorder of the times at which a robot touches ground or other bodies.

    A diagnosis excludes them.

    Args:
        actor: the robot in its world.

    Attributes:
        spans: begin and end of every contact [s], in order.
    """

    def __init__(self, actor: Actor) -> None:
        self._body = actor.body
        self.spans: list[tuple[float, float]] = []

    def record(self, moment: Moment) -> None:
        """Record whether anything was touched since the row before."""
        past, time = moment.history, moment.world.time
        pressing = None if past is None else past.pressing()
        if past is not None and pressing is not None:
            for begin, end, forces in zip(past.begins(), past.times, pressing, strict=True):
                self._note(begin, end, forces)
        if time > moment.before:
            self._note(moment.before, time, self._body.contact_normals())

    def _note(self, begin: float, end: float, forces: Floats) -> None:
        """Note the normal forces on all links between two instants."""
        if not (forces > 0.0).any():
            return
        if self.spans and begin - self.spans[-1][1] < GAP:
            begin = self.spans.pop()[0]
        self.spans.append((begin, end))

    def snapshot(self) -> list[tuple[float, float]]:
        """Return the contacts so far."""
        return list(self.spans)

    def restore(self, kept: Sequence[tuple[float, float]], rows: int, folder: Path) -> None:
        """Continue after the contacts of a snapshot."""
        if not fits(kept, list[tuple[float, float]]):
            raise ValueError("its contacts are not a list of beginnings and ends")
        self.spans = list(kept)

    def described(self) -> dict[str, Any]:
        """Return the entry of ``meta.yaml``; empty without contacts."""
        return {"contacts": [list(span) for span in self.spans]} if self.spans else {}


class Stages(Recorder):
    """Recorder of the stages of a run by their start times.

    Args:
        pilot: guide and controller of the robot, or None.

    Attributes:
        starts: time [s] and name of every stage, in order.
    """

    def __init__(self, pilot: Pilot | None) -> None:
        self._pilot = pilot
        self.starts: list[tuple[float, str]] = []

    def record(self, moment: Moment) -> None:
        """Record the present stage."""
        stage = "" if self._pilot is None else self._pilot.stage
        if stage and (not self.starts or self.starts[-1][1] != stage):
            # the guide was asked for the first of steps that were made at once
            past = moment.history
            self.starts.append((moment.world.time if past is None else past.times[0], stage))

    def snapshot(self) -> list[tuple[float, str]]:
        """Return the stages so far."""
        return list(self.starts)

    def restore(self, kept: Sequence[tuple[float, str]], rows: int, folder: Path) -> None:
        """Continue after the stages of a snapshot."""
        if not fits(kept, list[tuple[float, str]]):
            raise ValueError("its stages are not a list of times and names")
        self.starts = list(kept)

    @property
    def outcome(self) -> bool | None:
        """Return True when the guide is done, False when it gave up, None otherwise."""
        return None if self._pilot is None else self._pilot.finished

    @property
    def goals(self) -> tuple[Goal, ...]:
        """Places that the guide is to reach; empty without a guide."""
        return () if self._pilot is None else self._pilot.goals

    def described(self) -> dict[str, Any]:
        """Return the entry of ``meta.yaml``; empty without a guide."""
        if not self.starts:
            return {}
        rows = [{"time": time, "name": name} for time, name in self.starts]
        return {"guide": {"stages": rows, "outcome": self.outcome}}
