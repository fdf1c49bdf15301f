"""Mass, centre of gravity and inertia of a whole robot, its joints at zero."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.multibody.tree import forward
from seals.robot.model import RobotModel


def whole_body(robot: RobotModel) -> tuple[float, Floats, Floats]:
    """Return mass [kg], centre of gravity [m] and inertia about it [kg m^2], base axes.

    Joints stand at zero.
    """
    zero = np.zeros((1, robot.tree.joints))
    origins, turns = forward(robot.tree, np.zeros((1, 3)), np.eye(3)[None], zero)
    places = origins[0] + np.einsum("lij,lj->li", turns[0], robot.centre)
    mass = float(robot.mass.sum())
    centre = robot.mass @ places / mass if mass > 0.0 else np.zeros(3)
    arms = places - centre
    turned = np.einsum("lij,ljk,lmk->im", turns[0], robot.inertia, turns[0])
    steiner = np.einsum("l,li,li->", robot.mass, arms, arms) * np.eye(3)
    return mass, centre, turned + steiner - np.einsum("l,li,lj->ij", robot.mass, arms, arms)
