"""Added mass, drag and required wrench of a whole robot, for model-based controllers."""

from __future__ import annotations

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.control.limbs import stowed
from seals.control.plant import Plant
from seals.control.protocols import RobotState
from seals.effects.effect import MediumKind
from seals.frames import cross
from seals.multibody.spatial import twist_map
from seals.multibody.tree import poses_in_base


def added_inertia(plant: Plant) -> Floats:
    """Return the 6x6 inertia of the water a submerged robot carries with it.

    About the body origin in body axes, order [linear, angular], arms stowed. It sums what the
    effects of the model account for as added mass.
    """
    robot = plant.robot
    origins, turns = poses_in_base(robot.tree, stowed(robot))
    total = np.zeros((6, 6))
    for bound in plant.effects.inertias:
        p = bound.params
        if "added mass" not in bound.effect.accounts_for or "coupling" not in p:
            continue
        diagonal = np.concatenate((p["mass"][0], p["inertia"][0]))
        matrix = np.diag(diagonal) + p["coupling"][0]
        for link in bound.links:
            # the link's twist is x times the body's: by kinetic energy M = sum x^T M_link x
            x = twist_map(origins[link], turns[link])
            total += x.T @ matrix @ x
    return total


def water_drag(plant: Plant) -> Floats:
    """Return the quadratic drag of a submerged robot, body axes [N s^2/m^2], shape (3,).

    It sums what the effects of the model account for as quadratic drag in water, arms stowed.
    """
    robot = plant.robot
    _, turns = poses_in_base(robot.tree, stowed(robot))
    total = np.zeros(3)
    for bound in plant.effects.loads:
        mine = "quadratic drag" in bound.effect.accounts_for and "coefficient" in bound.params
        if mine and bound.kind is not MediumKind.air:
            for link in bound.links:
                # of a flow along one body axis, the part along each axis of the link, squared
                total += (turns[link] ** 2) @ bound.params["coefficient"][0]
    return total


def model_wrench(
    s: RobotState, acceleration: Array, turning: Array, *, added: Array, gravity: float
) -> Array:
    """Return force and torque about the centre of gravity, body axes [N, N m], shape (B, 6).

    Equation:
        F = (m + s M_A) a + weight - buoyancy, T = (J + s J_A) w' + w x J w - buoyancy's torque, s
        the submersion.

    Args:
        s: the robots now.
        acceleration: a, body axes [m/s^2], shape (B, 3).
        turning: w', body axes [rad/s^2], shape (B, 3).
        added: added inertia of the submerged robot, from `seals.control.added`, shape (6, 6).
        gravity: [m/s^2].

    References:
        Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control, ch. 8.
    """
    xp, up, spin = namespace(acceleration), s.rotation[:, 2, :], s.angular_velocity
    force = s.mass * acceleration + s.submersion * (acceleration @ added[:3, :3].T)
    force = force + (s.mass * gravity - s.buoyancy.force) * up
    carried, swirl = (xp.matmul(s.inertia, x[:, :, None])[:, :, 0] for x in (turning, spin))
    torque = carried + s.submersion * (turning @ added[3:, 3:].T) + cross(spin, swirl)
    torque = torque - cross(s.buoyancy.centre - s.centre, s.buoyancy.force * up)
    return xp.concat((force, torque), axis=1)
