"""Samples of a log at even time steps: time, commands and measured channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import LogError
from seals.logs.log import Log
from seals.logs.resample import one_sign
from seals.sysid.data.smoothing import local_polynomial
from seals.sysid.data.supply import full_voltage, supplied
from seals.sysid.data.vehicle import Vehicle

IMU = ("angular_velocity", "specific_force")
"""Channels of the inertial sensors."""
_UNEVEN = 0.02
"""Largest deviation of a time step from the usual one, as a share of it."""
_PARTS = 16
"""Parts of a row in which a servo follows its command, at most."""
_WIDEST = 0.25
"""Standard deviation of the widest kernel that smoothes the voltage [s]."""
_FEW = 20
"""Samples of the voltage up to which no bandwidth is chosen."""


@dataclass(frozen=True, kw_only=True)
class LogSpan:
    """Row range, clock and noise of one log in the samples of several.

    Args:
        name: of the log.
        first: row.
        last: row after its last one.
        begin: common clock at its first row [s].
        shift: common clock less the log's own time [s].
        sigma: white noise of its channels, 1-sigma; those left out are the vehicle's.
    """

    name: str
    first: int
    last: int
    begin: float = 0.0
    shift: float = 0.0
    sigma: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Samples of one or more runs of a vehicle, concatenated.

    Args:
        time: [s], shape (T,).
        step: between rows [s].
        runs: first and last-plus-one row of each run.
        channels: measured values with NaN for no sample, shape (T, k) each; orientation is
            q_WB_xyzw.
        command: of the actuators, shape (T, n).
        voltage: of the battery [V], shape (T, 1); None when not known.
        joint_command: [rad], shape (T, J).
        logs: spans of the logs; empty for one.
    """

    time: Floats
    step: float
    runs: tuple[tuple[int, int], ...]
    channels: Mapping[str, Floats]
    command: Floats
    voltage: Floats | None
    joint_command: Floats
    logs: tuple[LogSpan, ...] = ()

    @cached_property
    def clock(self) -> Floats:
        """Common clock of all logs, concatenated [s], shape (T,)."""
        clock: Floats = self.time.copy()
        for log in self.logs:
            clock[log.first : log.last] += log.shift
        return clock

    @cached_property
    def begins(self) -> NDArray[np.int64]:
        """First row of the run of every row, before which nothing was commanded, shape (T,)."""
        begins = np.zeros(self.rows, dtype=np.int64)
        for first, last in self.runs:
            begins[first:last] = first
        return begins

    @property
    def seconds(self) -> float:
        """Time of all runs together [s]."""
        return sum(float(self.time[last - 1] - self.time[first]) for first, last in self.runs)

    @property
    def log_index(self) -> NDArray[np.int64]:
        """Index of the log of every row, shape (T,)."""
        index = np.zeros(self.rows, dtype=np.int64)
        for k, log in enumerate(self.logs):
            index[log.first : log.last] = k
        return index

    def noise(self, channel: str, sigma: float) -> Floats:
        """White noise of a channel at every row, 1-sigma, shape (T,).

        Args:
            channel: its name.
            sigma: where no log states its own.
        """
        spread = np.full(self.rows, sigma)
        for log in self.logs:
            spread[log.first : log.last] = log.sigma.get(channel, sigma)
        return spread

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.time)

    @property
    def posed(self) -> bool:
        """True where position and orientation were measured."""
        return "position" in self.channels and "orientation" in self.channels


def read_samples(log: Log, vehicle: Vehicle) -> Samples:
    """Arrange the samples of a log for identification.

    Raises:
        LogError: times are uneven, runs are too short, or a needed channel is missing.
    """
    parts = log.segments()
    steps = [np.diff(p.time) for p in parts if p.rows > 1]
    step = float(np.median(np.concatenate(steps))) if steps else 0.0
    if step <= 0.0:
        raise LogError(f"log '{log.name}' has no run of two rows or more.\nGive a longer log.")
    runs, start = [], 0
    for part in parts:
        worst = float(np.abs(np.diff(part.time) - step).max()) if part.rows > 1 else 0.0
        if worst > _UNEVEN * step:
            raise LogError(
                f"log '{part.name}': rows are {step:g} s apart, but one gap differs by "
                f"{worst:.3g} s.\nAllowed: evenly spaced rows, with empty cells for samples that "
                "were lost. Convert the log with rate=HERTZ, which resamples it, or mark the "
                "parts as segments."
            )
        runs.append((start, start + part.rows))
        start += part.rows
    order = np.concatenate([np.flatnonzero(log.segment == p.segment[0]) for p in parts])
    used = log.select(order)
    channels = {name: used.channel(name).copy() for name in vehicle.sigma if used.has(name)}
    channels.pop("battery_voltage", None)
    joined, first = [], 0
    for entry in log.meta.get("logs") or ():
        last = first + int(entry["rows"])
        joined.append(
            LogSpan(
                name=str(entry["name"]),
                first=first,
                last=last,
                begin=float(entry["begin"]),
                shift=float(entry["shift"]),
                sigma=entry["sigma"],
            )
        )
        first = last
    spans = tuple(joined)
    each = [used.select(slice(s.first, s.last)) for s in spans] or [used]
    if "orientation" in channels:
        channels["orientation"] = _xyzw(channels["orientation"])
    missing = [name for name in IMU if name not in channels]
    if missing and "position" not in channels:
        raise LogError(
            f"log '{log.name}' lacks {' and '.join(missing)}, and has no pose either.\n"
            "A diagnosis needs an inertial sensor or a measured pose."
        )
    _refuse_partial_pose(log.name, channels, runs)
    joints = vehicle.robot.tree.joints
    if joints and vehicle.columns and "joint_position" in channels:
        channels["joint_position"] = channels["joint_position"][:, list(vehicle.columns)]
    if not joints:
        channels.pop("joint_position", None)
    return Samples(
        time=used.time.copy(),
        step=step,
        runs=tuple(runs),
        channels=channels,
        command=np.concatenate([_drive_commands(one, vehicle) for one in each]),
        voltage=_voltage(each, vehicle, step),
        joint_command=np.concatenate([_joint_commands(one, vehicle) for one in each]),
        logs=spans,
    )


def _refuse_partial_pose(
    name: str, channels: Mapping[str, Floats], runs: Sequence[tuple[int, int]]
) -> None:
    """Refuse a pose of which a component has no sample in a run; the depth stands for z."""
    if "position" not in channels or "orientation" not in channels:
        return
    place = np.isfinite(channels["position"])
    if "depth" in channels:
        place[:, 2] |= np.isfinite(channels["depth"][:, 0])
    turned = np.asarray(np.isfinite(channels["orientation"]).all(axis=1))
    for first, last in runs:
        rows = place[first:last]
        missing = [f"position_{axis}" for k, axis in enumerate("xyz") if not rows[:, k].any()]
        if not turned[first:last].any():
            missing.append("orientation")
        if missing:
            raise LogError(
                f"log '{name}': no sample of {' and '.join(missing)} in rows {first} to {last}.\n"
                "A diagnosis uses the measured pose: position and orientation in every run, or the "
                "depth instead of position_z. Keep rows that have it, span= of seals convert, or "
                "delete the columns of the position and give initial_state in meta.yaml."
            )


def _drive_commands(log: Log, vehicle: Vehicle) -> Floats:
    """Commands to the drives that they can follow at the voltage of the battery, shape (T, n)."""
    command = _held(log, vehicle.commands, len(vehicle.lag))
    if not log.has("battery_voltage"):
        return command
    return supplied(command, log.channel("battery_voltage")[:, 0], log.time, vehicle)


def _voltage(logs: Sequence[Log], vehicle: Vehicle, step: float) -> Floats | None:
    """Smooth voltage of the battery [V], shape (T, 1); None where no log tells it."""
    if not logs[0].has("battery_voltage"):
        return None
    each = [log.channel("battery_voltage")[:, :1] for log in logs]
    measured = [np.isfinite(v) for v in each]
    if not any(good.any() for good in measured):
        return None
    # in a log without it nothing sags
    mean = float(np.nanmean(np.concatenate(each)))
    full = vehicle.full_voltage or full_voltage(vehicle) or mean
    known = logs[0].meta.get("known_exactly")
    exact = isinstance(known, list) and "battery_voltage" in known
    out = []
    for volts, good in zip(each, measured, strict=True):
        if not good.any():
            out.append(np.full_like(volts, full))
        else:
            out.append(volts if exact and good.all() else _smooth(volts, step))
    return np.concatenate(out)


def _joint_commands(log: Log, vehicle: Vehicle) -> Floats:
    """Commands to the joints in their order, shape (T, J); none for joints without servos."""
    joints = vehicle.robot.tree.joints
    command = _held(log, "joint_position_cmd" if joints and vehicle.servo else "", joints)
    command = command[:, list(vehicle.columns)] if command.size and vehicle.columns else command
    speed = vehicle.servo.get("speed")
    return command if speed is None else _followed(command, log.time, speed, _simulated(log))


def _simulated(log: Log) -> float | None:
    """Return the step of a simulated log [s], None for others."""
    stated = log.meta.get("simulated")
    step = stated.get("step") if isinstance(stated, Mapping) else None
    return float(step) if isinstance(step, int | float) and step > 0.0 else None


def _followed(command: Floats, time: Floats, speed: Floats, step: float | None) -> Floats:
    """Commands that servos of limited speed follow: means between the rows, shape (T, J).

    Over a gap the servos go on to the command after it; where time goes back, another run begins.

    Args:
        command: held from each row on [rad or m], shape (T, J); the first is reached.
        time: of the rows of one log [s], shape (T,).
        speed: largest of each joint [rad/s or m/s], shape (J,).
        step: of a simulation, whose servos move ahead at the start of each [s]; None for others.
    """
    span = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    most = speed * span
    if not (np.abs(np.diff(command, axis=0)) > most).any():
        return command
    parts = _PARTS if step is None else max(1, round(min(span / step, _PARTS)))
    within = (np.arange(parts) + (0.5 if step is None else 1.0))[:, None] / parts
    gap = np.diff(time, prepend=time[0] - span)
    unseen = np.where(gap > 0.0, np.maximum(gap - (1.0 + _UNEVEN) * span, 0.0), np.inf)
    found, held = np.empty_like(command), command[0]
    for k, goal in enumerate(command):
        if unseen[k] > 0.0:
            held = held + np.clip(goal - held, -speed * unseen[k], speed * unseen[k])
        way = goal - held
        found[k] = held + np.clip(way, -most * within, most * within).mean(axis=0)
        held = held + np.clip(way, -most, most)
    return found


def _held(log: Log, channel: str, count: int) -> Floats:
    """Hold the last command in cells without a number."""
    if not channel or not count:
        return np.zeros((log.rows, 0))
    if not log.has(channel):
        raise LogError(
            f"log '{log.name}' has no channel '{channel}'.\n"
            "The commands of the actuators are required: without them every thrust would resemble "
            "a missing effect."
        )
    values: Floats = log.channel(channel).copy()
    if values.shape[1] != count:
        raise LogError(
            f"log '{log.name}': {channel} has {values.shape[1]} columns, the vehicle has {count} "
            "actuators.\nGive one column for each, or the robot that was recorded: robot=NAME"
        )
    for k in range(1, len(values)):
        lost = ~np.isfinite(values[k])
        values[k, lost] = values[k - 1, lost]
    values[~np.isfinite(values)] = 0.0
    return values


def _smooth(voltage: Floats, step: float) -> Floats:
    """Return the voltage without its noise, shape (T, 1).

    It falls with the current within milliseconds: of several bandwidths the one is taken that tells
    every other sample best from those between.
    """
    widths = [max(_WIDEST, 2.0 * step)]
    while widths[-1] > step:
        widths.append(0.5 * widths[-1])

    def fitted(volts: Floats, width: float) -> Floats:
        return local_polynomial(volts, step, bandwidth=width)[0]

    given = np.flatnonzero(np.isfinite(voltage[:, 0]))
    kept = voltage.copy()
    kept[given[::2]] = np.nan
    missed = [np.nanmean((fitted(kept, w) - voltage)[given[::2]] ** 2) for w in widths]
    return fitted(voltage, widths[int(np.argmin(missed))] if len(given) > _FEW else widths[0])


def _xyzw(wxyz: Floats) -> Floats:
    """Quaternions in the order x, y, z, w with a sign that does not flip along the rows.

    One of which a component has no sample is none.
    """
    q: Floats = wxyz[:, [1, 2, 3, 0]]
    whole = np.isfinite(q).all(axis=1)
    q[~whole] = np.nan
    # in place: fits are repeatable to the last digit in one order of memory alone
    q[:] = one_sign(q)
    good = np.flatnonzero(whole)
    q[good] *= (1.0 / np.linalg.norm(q[good], axis=1))[:, None]
    return q
