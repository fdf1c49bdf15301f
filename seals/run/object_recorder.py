"""Recorder of the objects of a run: poses and loads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.config.plugin_lookup import plugin_name
from seals.run.recorded_rows import refill
from seals.run.settings import RunSettings
from seals.world import Actor, Ledger

POSE = ("position_x", "position_y", "position_z")
TURN = ("orientation_w", "orientation_x", "orientation_y", "orientation_z")
SPEED = ("velocity_x", "velocity_y", "velocity_z")


class ObjectRecorder:
    """Recorder of the objects: pose and velocity in the world, joint positions.

    Args:
        actors: the objects by name.
        steps: expected steps; there is one row more, that of the start.
    """

    def __init__(self, actors: Mapping[str, Actor], *, steps: int) -> None:
        """Reserve the rows."""
        self.actors = dict(actors)
        self._rows = {
            name: np.zeros((steps + 1, 10 + actor.robot.tree.joints))
            for name, actor in actors.items()
        }
        self.rows = 0

    def take(self) -> None:
        """Record the present poses of all objects."""
        for name, actor in self.actors.items():
            c = actor.body.read()
            turn = c.quaternion[[3, 0, 1, 2]]
            self._rows[name][self.rows] = np.concatenate((c.position, turn, c.velocity, c.joints))
        self.rows += 1

    def snapshot(self) -> dict[str, Floats]:
        """Return the rows so far by object."""
        return {name: table[: self.rows] for name, table in self._rows.items()}

    def restore(self, kept: Mapping[str, Any], rows: int) -> None:
        """Continue after the rows of a snapshot.

        Raises:
            ValueError: it is of another run.
        """
        for name, table in self._rows.items():
            refill(table, kept[name], rows)
        self.rows = rows

    def columns(self, rows: int) -> dict[str, Floats]:
        """Return the first rows as columns ``object_NAME_CHANNEL``; velocities in world axes."""
        out: dict[str, Floats] = {}
        for name, table in self._rows.items():
            joints = [f"joint_position_{k + 1}" for k in range(table.shape[1] - 10)]
            for k, column in enumerate((*POSE, *TURN, *SPEED, *joints)):
                out[f"object_{name}_{column}"] = np.ascontiguousarray(table[:rows, k])
        return out

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
            **_behaviour(actor),
        }
        for name, actor in actors.items()
    }


def _behaviour(actor: Actor) -> dict[str, str]:
    """Return the guide of an object that moves by itself."""
    if actor.pilot is None:
        return {}
    return {"guide": plugin_name("guide", type(actor.pilot.guide))}
