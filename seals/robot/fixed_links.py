"""Pose of a link that is rigidly connected to the base, in the axes of the base."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.robot.model import RobotModel


def place_on_base(robot: RobotModel, link: str) -> tuple[Floats, Floats] | None:
    """Return where a link sits on the base, or None where joints move it or there is none.

    Args:
        robot: its links.
        link: name, or ``root`` for the base.

    Returns:
        Origin in base axes [m], shape (3,), and the rotation from link to base axes, shape (3, 3).
    """
    if link != "root" and link not in robot.links:
        return None
    origin: Floats = np.zeros(3)
    turn: Floats = np.eye(3)
    k = 0 if link == "root" else robot.links.index(link)
    while k > 0:
        if robot.tree.joint[k] >= 0:
            return None
        origin = robot.tree.origin[k] + robot.tree.rotation[k] @ origin
        turn = robot.tree.rotation[k] @ turn
        k = robot.tree.parent[k]
    return origin, turn
