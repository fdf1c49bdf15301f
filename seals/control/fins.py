"""Fins for control: links with lift that a joint turns, and their effect on the vehicle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control.plant import THRUSTER, Layout, Plant
from seals.effects.effect import MediumKind
from seals.environment.seawater import FRESH_WATER
from seals.multibody.tree import poses_in_base

STOP = 0.35
"""Largest deflection of a fin whose joint has no limit: beyond it fins stall [rad]."""


class Fins(NamedTuple):
    """Control surfaces of a robot, joints at zero, body axes about the body origin.

    Args:
        joints: index of the joint that turns each, n of them.
        position: where the lift acts [m], shape (n, 3).
        axis: direction of the lift for a positive deflection [1], shape (n, 3).
        slope: lift for a unit of deflection at a unit of speed [N s^2/(m^2 rad)], shape (n,).
        limit: largest deflection either way [rad], shape (n,).
    """

    joints: tuple[int, ...]
    position: Floats
    axis: Floats
    slope: Floats
    limit: Floats


def fins_of(plant: Plant) -> Fins:
    """Return the fins of a robot: links with an effect of lift that one joint turns.

    Equation:
        A fin with its chord along body x, turned by d, meets the water at the angle of attack d (x
        . (a x z)): its lift is rho A_L U^2 / 2 times that against z, a the joint's axis, z the
        link's z axis. See the effect ``lift``.

    References:
        Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control, ch. 9 (fins and
        rudders).
    """
    robot, tree = plant.robot, plant.robot.tree
    origins, turns = poses_in_base(tree)
    density = plant.environment.water_density or FRESH_WATER
    rows = []
    for bound in plant.effects.loads:
        lifts = "lift" in bound.effect.accounts_for and "coefficient" in bound.params
        if not lifts or bound.kind is MediumKind.air:
            continue
        area = float(np.reshape(bound.params["coefficient"], -1)[0])
        for link in bound.links:
            moving = np.flatnonzero(tree.moves[link]) if tree.joints else np.zeros(0, dtype=int)
            if len(moving) != 1 or tree.slides[moving[0]]:
                continue
            joint = int(moving[0])
            up = turns[link][:, 2]
            hinge = turns[tree.child[joint]] @ tree.axis[joint]
            # x . (a x z) is the first component of a x z in body axes
            slope = -0.5 * density * area * float(np.cross(hinge, up)[0])
            stop = min(abs(float(robot.lower[joint])), abs(float(robot.upper[joint])), STOP)
            rows.append((joint, origins[link], up * np.sign(slope), abs(slope), stop))
    rows = [row for row in rows if row[3] > 0.0]
    return Fins(
        joints=tuple(row[0] for row in rows),
        position=np.reshape([row[1] for row in rows], (-1, 3)),
        axis=np.reshape([row[2] for row in rows], (-1, 3)),
        slope=np.array([row[3] for row in rows]),
        limit=np.array([row[4] for row in rows]),
    )


def with_fins(layout: Layout, fins: Fins) -> Layout:
    """Return a layout with the fins as further drives whose command is the deflection [rad].

    Their gain is the square of the speed through the water [m^2/s^2]; see `Allocation.matrix`.
    """
    count = len(fins.joints)
    none, one = np.zeros(count), np.ones(count)

    def joined(ours: Floats, theirs: Floats) -> Floats:
        return np.concatenate((ours, theirs))

    return Layout(
        position=joined(layout.position, fins.position),
        axis=joined(layout.axis, fins.axis),
        thrust_coefficient=joined(layout.thrust_coefficient, fins.slope),
        reaction_coefficient=joined(layout.reaction_coefficient, none),
        limit=joined(layout.limit, fins.limit),
        low=joined(layout.low, -fins.limit),
        lag=joined(layout.lag, none),
        fall=joined(layout.fall, none),
        reverse=joined(layout.reverse, one),
        kind=(*layout.kind, *(THRUSTER,) * count),
        link=(*layout.link, *(0,) * count),
    )
