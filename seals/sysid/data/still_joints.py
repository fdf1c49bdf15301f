"""Joints at rest throughout a log: the robot is one rigid body, or their effects do not show."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.logs.log import Log
from seals.sysid.data.robot_description import RobotDescription
from seals.sysid.data.samples import Samples

_QUIET = 2.0
"""Variance of a joint's readings in units of their noise: a motion no larger than the noise."""
_SURE = 3.0
"""Standard errors by which that variance exceeds one where a joint moves [1]."""


def still_joints(log: Log, robot: RobotDescription | None) -> dict[str, float]:
    """Return the joint positions [rad or m] by name if no joint moves in a log.

    A joint stands still where its readings scatter no wider about their mean than their noise: an
    arm that swings as little as that still shakes the base. Empty where one joint moves, or none
    is measured.

    Args:
        log: with or without measured joints.
        robot: that names them; None where the metadata describe the vehicle.
    """
    stated: Mapping[str, Any] = (log.meta.get("sensors") or {}).get("channels") or {}
    if robot is None or "joint_position" not in stated or not log.has("joint_position"):
        return {}
    names = joint_order(log.meta, robot)
    measured = log.channel("joint_position")
    if measured.shape[1] != len(names):
        return {}
    level = float(stated["joint_position"]["sigma"]) ** 2
    found = {}
    for name, readings in zip(names, measured.T, strict=True):
        given = readings[np.isfinite(readings)]
        if not given.size or given.var() > level * (1.0 + _SURE * math.sqrt(2.0 / given.size)):
            return {}
        found[name] = float(given.mean())
    return found


def joints_at_rest(samples: Samples, sigma: float) -> frozenset[int]:
    """Return the joints, counted from 1, that neither move nor are commanded to.

    The sign of their speed is that of the noise, which friction or play of a joint would follow.

    Args:
        samples: of the log.
        sigma: noise of the measured joints [rad or m].
    """
    measured, command = samples.channels.get("joint_position"), samples.joint_command
    if measured is None:
        return frozenset()
    level = _QUIET * sigma**2
    quiet = [np.nanvar(measured[:, k]) <= level for k in range(measured.shape[1])]
    if command.shape == measured.shape:
        quiet = [q and np.var(command[:, k]) <= level for k, q in enumerate(quiet)]
    return frozenset(k + 1 for k, q in enumerate(quiet) if q)


def joint_order(meta: Mapping[str, Any], robot: RobotDescription) -> tuple[str, ...]:
    """Names of the joints in the order of a log's columns: as it lists them, else as the URDF."""
    return tuple(meta.get("joints") or robot.listed or robot.robot.joints)
