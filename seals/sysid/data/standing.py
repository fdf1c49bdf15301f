"""Sensors that repeat one reading while the vehicle moves, and joints that stand still."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError
from seals.logs.log import Log
from seals.sysid.data.robot_description import RobotDescription
from seals.sysid.data.samples import Samples
from seals.sysid.data.vehicle import Vehicle

_STILL = 1.0
"""Time for which a reading with noise never repeats itself [s]."""
_FEWEST = 20
"""Readings in that time at least."""
_MOVED = 10.0
"""Range of a channel, in its stated noise, from which the vehicle moved."""
_POSE = ("position", "orientation")
_INERTIAL = ("angular_velocity", "specific_force")
_HELD = "the inertial sensors measure motion: the pose was held during a failure"


def refuse_frozen(log: Log, samples: Samples, vehicle: Vehicle) -> None:
    """Refuse a log in which one of pose and inertial sensors stands still while the other moves.

    A fit would call the frozen reading a bias. Runs of SEALS may be without noise and pass.

    Args:
        log: as read.
        samples: of the log.
        vehicle: stated noise.

    Raises:
        LogError: a component repeats one value for a second or more while the vehicle moves.
    """
    if "simulated" in log.meta:
        return
    seen = samples.channels
    pose, inertial = ([n for n in names if n in seen] for names in (_POSE, _INERTIAL))
    single = [(f"{n}_{a}", v) for n in inertial for a, v in zip("xyz", seen[n].T, strict=True)]
    for name, values, others, why in (
        *((n, v, pose, "the pose moves: the sensor is frozen") for n, v in single),
        # a planar motion holds a component of the pose, and never all of them
        *((n, _changes(seen[n]), inertial, _HELD) for n in pose),
    ):
        for first, last in _repeats(values):
            seconds = float(samples.time[last] - samples.time[first])
            if seconds >= _STILL and any(
                _moves(seen[n][first : last + 1], vehicle.sigma.get(n, 0.0)) for n in others
            ):
                reads = f"reads {values[first]:.6g}" if others is pose else "stands"
                raise LogError(
                    f"{name} {reads} without change for {seconds:.1f} s from "
                    f"t = {samples.time[first]:.4g} s on, while {why}.\n"
                    "Cut out this period, or remove the channel."
                )


def _changes(values: Floats) -> Floats:
    """Count the changes of any component up to each row; NaN where there is no reading."""
    there = np.isfinite(values).all(axis=1)
    out = np.full(len(values), np.nan)
    moved = np.any(np.diff(values[there], axis=0) != 0.0, axis=1)
    out[there] = np.append(0.0, np.cumsum(moved))[: int(there.sum())]
    return out


def _repeats(values: Floats) -> list[tuple[int, int]]:
    """Return first and last row of every stretch in which one value repeats; NaN is no reading."""
    there = np.flatnonzero(np.isfinite(values))
    if len(there) < _FEWEST:
        return []
    cuts = np.flatnonzero(np.diff(values[there]) != 0.0)
    begins, ends = np.append(0, cuts + 1), np.append(cuts, len(there) - 1)
    long = ends - begins + 1 >= _FEWEST
    return [(int(there[a]), int(there[b])) for a, b in zip(begins[long], ends[long], strict=True)]


def _moves(values: Floats, sigma: float) -> bool:
    seen = values[np.isfinite(values).all(axis=1)]
    return len(seen) > 1 and sigma > 0.0 and bool(np.ptp(seen, axis=0).max() > _MOVED * sigma)


def still_joints(log: Log, robot: RobotDescription | None, *, errors: float) -> dict[str, float]:
    """Return the joint positions [rad or m] by name if no joint moves in a log.

    A joint stands still where its readings scatter no wider about their mean than their noise: an
    arm that swings as little as that still shakes the base. Empty where one joint moves, or none
    is measured.

    Args:
        log: with or without measured joints.
        robot: that names them; None where the metadata describe the vehicle.
        errors: standard errors by which the variance exceeds the noise's where a joint moves.
    """
    stated: Mapping[str, Any] = (log.meta.get("sensors") or {}).get("channels") or {}
    if robot is None or "joint_position" not in stated or not log.has("joint_position"):
        return {}
    names = tuple(log.meta.get("joints") or robot.listed or robot.robot.joints)
    measured = log.channel("joint_position")
    if measured.shape[1] != len(names):
        return {}
    level = float(stated["joint_position"]["sigma"]) ** 2
    found = {}
    for name, readings in zip(names, measured.T, strict=True):
        given = readings[np.isfinite(readings)]
        if not given.size or given.var() > level * (1.0 + errors * math.sqrt(2.0 / given.size)):
            return {}
        found[name] = float(given.mean())
    return found


def joints_at_rest(samples: Samples, sigma: float, *, quiet: float) -> frozenset[int]:
    """Return the joints, counted from 1, that neither move nor are commanded to.

    The sign of their speed is that of the noise, which friction or play of a joint would follow.

    Args:
        samples: of the log.
        sigma: noise of the measured joints [rad or m].
        quiet: variance up to which a joint is at rest, in units of the noise's [1].
    """
    measured, command = samples.channels.get("joint_position"), samples.joint_command
    if measured is None:
        return frozenset()
    level = quiet * sigma**2
    still = [np.nanvar(measured[:, k]) <= level for k in range(measured.shape[1])]
    if command.shape == measured.shape:
        still = [s and np.var(command[:, k]) <= level for k, s in enumerate(still)]
    return frozenset(k + 1 for k, s in enumerate(still) if s)
