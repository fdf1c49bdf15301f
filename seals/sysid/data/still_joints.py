"""Joints at rest throughout a log, so that the robot is one rigid body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.logs.log import Log
from seals.sysid.data.robot_description import RobotDescription

_STILL = 2.0
"""Variance of a joint's readings in units of their noise: a motion no larger than the noise."""


def still_joints(log: Log, robot: RobotDescription | None) -> dict[str, float]:
    """Return the joint positions [rad or m] by name if no joint moves in a log.

    A joint stands still where its readings scatter no wider about their mean than noise and a
    motion as small as that. Empty where one joint moves, or none is measured.

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
    level = _STILL * float(stated["joint_position"]["sigma"]) ** 2
    found = {}
    for name, readings in zip(names, measured.T, strict=True):
        given = readings[np.isfinite(readings)]
        if not given.size or given.var() > level:
            return {}
        found[name] = float(given.mean())
    return found


def joint_order(meta: Mapping[str, Any], robot: RobotDescription) -> tuple[str, ...]:
    """Names of the joints in the order of a log's columns: as it lists them, else as the URDF."""
    return tuple(meta.get("joints") or robot.listed or robot.robot.joints)
