"""Recorder of a robot in the channels of the log format."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.frames import matrix_of, unrotate
from seals.logs.channels import column_names
from seals.robot.whole_body import place_on_base
from seals.run.recorder import Moment, Recorder, refill
from seals.world.actor import Actor
from seals.world.history import History

BATTERY = ("battery_voltage", "battery_current", "battery_charge")
"""Channels of a battery [V, A, 1]."""


class RobotRecorder(Recorder):
    """Recorder of one robot: sensor readings, and true values for channels without a sensor.

    Args:
        actor: the robot in its world.
        steps: expected steps; there is one row more, that of the start.
        gravity: [m/s^2].
        water_level: height of the calm surface [m], None without water.

    Attributes:
        rows: rows recorded so far.
        most: rows of the whole run.
    """

    def __init__(
        self, actor: Actor, *, steps: int, gravity: float, water_level: float | None
    ) -> None:
        self.actor, self.gravity, self.water_level = actor, gravity, water_level
        joints = actor.robot.tree.joints
        self.rows, self.most = 0, steps + 1
        self._time = np.zeros(steps + 1)
        self._state = np.zeros((steps + 1, 13 + 2 * joints))
        self._read = {
            (sensor, channel): np.full((steps + 1, width), np.nan)
            for sensor, plugin in actor.sensors.items()
            for channel, width in plugin.channels().items()
        }
        self._names = _names_of(actor)
        self._battery = np.zeros((steps + 1 if actor.battery else 0, len(BATTERY)))

    def record(self, moment: Moment) -> None:
        """Record the present state and the readings that were due."""
        row = moment.row
        if moment.history is not None:
            self._record_past(moment.first, moment.history)
        self._time[row] = moment.world.time
        # one flat write: position, quaternion, velocity, spin, joints, rates
        self._state[row] = np.concatenate(self.actor.body.read())
        if self.actor.battery:
            self._battery[row] = self.actor.battery_state()
        for sensor, reading in self.actor.readings.items():
            if reading is not None:
                for channel, values in reading.items():
                    self._read[sensor, channel][row] = values
        self.rows = row + 1

    def _record_past(self, first: int, past: History) -> None:
        """Record steps that were made at once, from a row on."""
        rows = slice(first, first + len(past.times))
        self._time[rows] = past.times
        self._state[rows] = np.concatenate(past.states(), axis=1)
        if self.actor.battery:
            self._battery[rows] = self.actor.battery_states(past)
        for taken, readings in past.readings:
            part = first + taken if isinstance(taken, int) else rows
            for sensor, reading in readings.items():
                for channel, values in (reading or {}).items():
                    self._read[sensor, channel][part] = values

    def snapshot(self) -> dict[str, Any]:
        """Return the rows so far."""
        n = self.rows
        read = {key: values[:n] for key, values in self._read.items()}
        return {
            "rows": n,
            "time": self._time[:n],
            "state": self._state[:n],
            "read": read,
            "battery": self._battery[:n],
        }

    def restore(self, kept: Mapping[str, Any], rows: int, folder: Path) -> None:
        """Continue after the rows of a snapshot."""
        refill(self._time, kept["time"], rows)
        refill(self._state, kept["state"], rows)
        refill(self._battery, kept["battery"], rows)
        for key, values in self._read.items():
            refill(values, kept["read"][key], rows)
        self.rows = rows

    @property
    def time(self) -> Floats:
        """Time of the rows [s], shape (rows,)."""
        return self._time[: self.rows]

    @property
    def truth(self) -> Mapping[str, Floats]:
        """Exact values by channel, shape (rows, k); orientation as w, x, y, z."""
        s = self._state[: self.rows]
        turn = matrix_of(s[:, 3:7])
        out = {
            "position": s[:, 0:3],
            "orientation": s[:, [6, 3, 4, 5]],
            "velocity": unrotate(turn, s[:, 7:10]),
            "angular_velocity": unrotate(turn, s[:, 10:13]),
            "specific_force": self._specific_force(turn),
        }
        if self.actor.battery:
            out |= {name: self._battery[: self.rows, [k]] for k, name in enumerate(BATTERY)}
        if self.water_level is not None:
            out["depth"] = self.water_level - s[:, 2:3]
        joints = (s.shape[1] - 13) // 2
        if joints:
            out["joint_position"] = s[:, 13 : 13 + joints]
            out["joint_velocity"] = s[:, 13 + joints :]
        return out

    def _specific_force(self, turn: Any) -> Floats:
        """Acceleration in the last step minus gravity, in the axes before it; NaN in the first row.

        As an accelerometer reads it, see `seals.world.felt`: the change of the mean velocity since
        the step before. The velocity at the end of the first step, less that at the start, is h
        times the first acceleration.
        """
        place, velocity = self._state[: self.rows, :3], self._state[: self.rows, 7:10]
        step = np.diff(self.time)[:, None]
        acceleration = np.full((self.rows, 3), np.nan)
        acceleration[1:2] = np.diff(velocity[:2], axis=0) / step[:1]
        acceleration[2:] = np.diff(np.diff(place, axis=0) / step, axis=0) / step[1:]
        acceleration[:, 2] += self.gravity
        found: Floats = acceleration
        found[1:] = unrotate(turn[:-1], acceleration[1:])
        return found

    def sources(self) -> dict[str, str]:
        """Return for each channel of the log its sensor, or ``""`` for true values."""
        return dict.fromkeys(self.truth, "") | {
            name: sensor for (sensor, _), name in self._names.items()
        }

    def columns(self) -> dict[str, Floats]:
        """Return the columns of the log, ``t`` first; readings replace true values."""
        channels = dict(self.truth)
        channels |= {self._names[key]: values[: self.rows] for key, values in self._read.items()}
        out = {"t": self.time}
        own = {name: channel for (_, channel), name in self._names.items()}
        for name, values in channels.items():
            names = column_names(name, values.shape[1], own.get(name, name))
            out |= dict(zip(names, values.T, strict=True))
        return {name: np.ascontiguousarray(values) for name, values in out.items()}


def _names_of(actor: Actor) -> dict[tuple[str, str], str]:
    """Names in the log of every sensor's channels.

    The log's own names are those of the body: the first sensor on the base takes them, the readings
    of all others stand under ``SENSOR_CHANNEL``. An inertial sensor may sit on a link that is fixed
    to the base: its log states where.
    """
    names: dict[tuple[str, str], str] = {}
    for sensor, plugin in actor.sensors.items():
        on_base = plugin.link in ("root", actor.robot.links[0]) or (
            "specific_force" in plugin.channels()
            and place_on_base(actor.robot, plugin.link) is not None
        )
        for channel in plugin.channels():
            free = on_base and channel not in names.values()
            names[sensor, channel] = channel if free else f"{sensor}_{channel}"
    return names
