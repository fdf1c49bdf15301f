"""Velocity change of a robot at a joint limit, without the impulse of the limit."""

from __future__ import annotations

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.backend import Dynamics
from seals.errors import PhysicsError
from seals.multibody.equations import Assembly
from seals.multibody.linear import solved


def base_inertia(assembly: Assembly, dynamics: Dynamics) -> Array:
    """Return the rows of the base of the generalised inertia, added inertia included, (6, n).

    Args:
        assembly: of the robot's own inertia.
        dynamics: of the robot; its base is free.
    """
    jacobian = dynamics.kinematics.jacobian[0]
    total = assembly.total_inertia(dynamics.found, 1)[0]
    size = jacobian.shape[2]
    rows = namespace(jacobian).matmul(total, jacobian).reshape(-1, size)
    return jacobian[:, :, :6].reshape(-1, 6).T @ rows


def locked_kick(inertia: Floats, kick: Floats) -> Floats:
    """Return the change of velocity of the base as if all joints were locked, shape (6,).

    A stop acts between links: it changes neither the linear nor the angular momentum of the robot.
    What is left of a change of velocity without it is that of the locked robot with the same change
    of momentum.

    Equation:
        M_bb s = M_b a, with M the generalised inertia, added inertia included, and b the rows of
        the base.

    Args:
        inertia: M_b where the step began, see `base_inertia`, shape (6, n).
        kick: change of the generalised velocity over the step, about the base origin, shape (n,).

    Raises:
        PhysicsError: the locked robot has no inertia about some axis.
    """
    try:
        found: Floats = solved(inertia[:, :6], inertia @ kick)
    except np.linalg.LinAlgError as cause:
        raise PhysicsError(
            "the robot has no inertia about an axis of its base, and a joint stands at its limit.\n"
            "Give at least one link of its URDF an inertia about it: ixx, iyy, izz above zero."
        ) from cause
    return found
