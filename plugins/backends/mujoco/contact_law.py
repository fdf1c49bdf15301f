"""MuJoCo's contacts: parameters from coefficients of surfaces, and contact points of a robot."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.robot.model import Surface

STIFF = 0.999
"""Share of the reference acceleration that a constraint enforces [1]: 1 would be rigid."""
RETURN = 0.1
"""Share of a penetration that is taken back in one step [1].

A body pushed out leaves with that share of the speed at which it came, so less is better; at 0.1 a
penetration is gone after some thirty steps.
"""
GRIP = 100.0
"""Ratio of the stiffnesses of friction and of the normal force [1]: a held body does not creep."""
LEAST = 1e-5
"""Least friction coefficient of the engine [1]."""


def impedance() -> list[float]:
    """Return the engine's ``solimp``: the same stiffness at any penetration."""
    return [STIFF, STIFF, 0.001, 0.5, 2.0]


def reference(step: float, restitution: float = 0.0) -> list[float]:
    """Return the engine's ``solref`` of a constraint that stops an approach within one step.

    Equation:
        The engine aims at the acceleration a = -b v - k r. With b = (1 + e) / h the velocity after
        a step is -e v (Newton's law of impact), with k = RETURN / h^2 a penetration r goes back by
        that share. Negative numbers are stiffness and damping as such, scaled by the impedance.

    Args:
        step: h [s].
        restitution: e [1].
    """
    return [-RETURN / step**2 * STIFF**2, -(1.0 + restitution) / step * STIFF]


def set_pair(pair: Any, surface: Surface, step: float) -> None:
    """Set the parameters of a pair of shapes.

    Args:
        pair: of the engine's model description.
        surface: combined coefficients.
        step: h [s].
    """
    slide, spin, roll = surface.friction or 0.0, surface.spinning or 0.0, surface.rolling or 0.0
    pair.condim = 6 if roll > 0.0 else 4 if spin > 0.0 else 3 if slide > LEAST else 1
    pair.friction = [max(x, LEAST) for x in (slide, slide, spin, roll, roll)]
    pair.solref = reference(step, surface.restitution or 0.0)
    # without restitution: what slides is stopped, not sent back
    pair.solreffriction = reference(step)
    pair.solimp = impedance()
    pair.margin = pair.gap = 0.0


class Points(NamedTuple):
    """Contact points of one step, C of them.

    Args:
        geom: the two shapes of each, shape (C, 2).
        pos: places, world [m], shape (C, 3).
        frame: normal and two tangents as rows, world, shape (C, 9).
        parts: normal force and two of friction [N], shape (C, 3).
    """

    geom: NDArray[np.int32]
    pos: Floats
    frame: Floats
    parts: Floats


def points_of(data: Any) -> Points:
    """Return the contact points in the engine's data after a step."""
    contact = data.contact
    start, size = contact.efc_address, contact.dim
    parts, found = np.zeros((len(start), 3)), data.efc_force
    # normal force and two of friction, where there are any
    for k in range(3):
        held = (start >= 0) & (size > k)
        parts[held, k] = found[start[held] + k]
    return Points(contact.geom, contact.pos, contact.frame.reshape(-1, 9), parts)


class MujocoContacts:
    """Contacts of one step, see `seals.coupling.ContactPoints`.

    Args:
        points: gives all that touch in the scene.
        touched: link of the robot that is the first and the second shape of every contact, -1 for
            none, shape (C, 2).
    """

    def __init__(self, points: Callable[[], Points], touched: NDArray[np.int64]) -> None:
        self._points, self._touched = points, touched

    @property
    def links(self) -> list[int]:
        """Row of the touched link at every contact."""
        found: list[int] = self._touched[self._touched >= 0].tolist()
        return found

    def forces(self) -> tuple[Floats, Floats, Floats]:
        """Return points, forces and normal forces."""
        rows, side = np.nonzero(self._touched >= 0)
        points = self._points()
        place, frame, parts = points.pos[rows], points.frame[rows], points.parts[rows]
        force = np.matmul(parts[:, None, :], frame.reshape(-1, 3, 3))[:, 0]
        # a contact pushes its second shape along the normal, and the first one back
        force[side == 0] *= -1.0
        return place, force, parts[:, 0]
