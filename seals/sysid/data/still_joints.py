"""Detection of joints that are at rest throughout a log."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.logs.log import Log
from seals.sysid.data.robot_description import RobotDescription
from seals.sysid.data.samples import Samples


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
    names = joint_order(log.meta, robot)
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


def joint_order(meta: Mapping[str, Any], robot: RobotDescription) -> tuple[str, ...]:
    """Names of the joints in the order of a log's columns: as it lists them, else as the URDF."""
    return tuple(meta.get("joints") or robot.listed or robot.robot.joints)
