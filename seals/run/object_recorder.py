"""Recorder of the objects of a run: poses and loads."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.config.plugin_lookup import plugin_name
from seals.run.recorder import Moment, Recorder, Rows
from seals.run.settings import RunSettings
from seals.world import Actor, Ledger

POSE = ("position_x", "position_y", "position_z")
TURN = ("orientation_w", "orientation_x", "orientation_y", "orientation_z")
SPEED = ("velocity_x", "velocity_y", "velocity_z")


class ObjectRecorder(Recorder):
    """Recorder of the objects: pose and velocity in the world, joint positions.

    Args:
        actors: the objects by name.
        steps: expected steps; there is one row more, that of the start.
    """

    def __init__(self, actors: Mapping[str, Actor], *, steps: int) -> None:
        self.actors = dict(actors)
        self._rows = {}
        for name, actor in actors.items():
            joints = (f"joint_position_{k + 1}" for k in range(actor.robot.tree.joints))
            columns = [f"object_{name}_{column}" for column in (*POSE, *TURN, *SPEED, *joints)]
            self._rows[name] = Rows(columns, steps + 1, fill=0.0)

    def record(self, moment: Moment) -> None:
        """Record the present poses of all objects."""
        for name, actor in self.actors.items():
            c = actor.body.read()
            turn = c.quaternion[[3, 0, 1, 2]]
            table = self._rows[name]
            table.count = moment.row + 1
            table.values[moment.row] = np.concatenate((c.position, turn, c.velocity, c.joints))

    def snapshot(self) -> dict[str, Floats]:
        """Return the rows so far by object."""
        return {name: table.snapshot() for name, table in self._rows.items()}

    def restore(self, kept: Mapping[str, Any], rows: int, folder: Path) -> None:
        """Continue after the rows of a snapshot."""
        for name, table in self._rows.items():
            table.restore(kept[name], rows)

    def columns(self, rows: int) -> dict[str, Floats]:
        """Return the first rows as columns ``object_NAME_CHANNEL``; velocities in world axes."""
        tables = self._rows.values()
        return {name: column for t in tables for name, column in t.columns(rows).items()}

    @property
    def ledgers(self) -> dict[str, Ledger]:
        """Return every object's ledger by name."""
        return {name: actor.ledger for name, actor in self.actors.items()}


def describe_objects(settings: RunSettings, actors: Mapping[str, Actor]) -> dict[str, Any]:
    """Return the entry of ``meta.yaml`` about the objects: robot, mass and effects."""
    return {
        name: {
            "robot": settings.objects[name].robot,
            "mass": float(actor.robot.mass.sum()),
            "joints": list(actor.robot.joints),
            "effects": list(actor.effects.names),
            **({"guide": plugin_name("guide", type(actor.pilot.guide))} if actor.pilot else {}),
        }
        for name, actor in actors.items()
    }
