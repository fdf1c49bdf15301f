"""Mass properties of a whole robot, and poses of links that are fixed to its base."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.multibody.tree import poses_in_base
from seals.robot.model import RobotModel


def whole_body(robot: RobotModel) -> tuple[float, Floats, Floats]:
    """Return mass [kg], centre of gravity [m] and inertia about it [kg m^2], base axes.

    Joints stand at zero.
    """
    origins, turns = poses_in_base(robot.tree)
    places = origins + np.einsum("lij,lj->li", turns, robot.centre)
    mass = float(robot.mass.sum())
    centre = robot.mass @ places / mass if mass > 0.0 else np.zeros(3)
    arms = places - centre
    turned = np.einsum("lij,ljk,lmk->im", turns, robot.inertia, turns)
    steiner = np.einsum("l,li,li->", robot.mass, arms, arms) * np.eye(3)
    return mass, centre, turned + steiner - np.einsum("l,li,lj->ij", robot.mass, arms, arms)


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
