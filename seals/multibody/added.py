"""Velocity-dependent (Coriolis and Munk) terms of added inertia."""

from __future__ import annotations

import numpy as np

from seals.arrays import Array
from seals.frames import cross
from seals.motion import AddedInertia, Medium, Motion
from seals.multibody.spatial import kirchhoff, momentum


def added_terms(added: AddedInertia, medium: Medium, motion: Motion) -> tuple[Array, Array]:
    """Velocity-dependent reaction of an added inertia about the link origin, link axes [N, N m].

    Equation:
        weight A (w x u - a, 0) + Kirchhoff terms of weight A at (v - u, w), with u the velocity
        and a the acceleration of the medium: what remains of d/dt (weight A nu_r) when
        (v', w') = 0 and weight is held.
    """
    spin = motion.angular_velocity
    relative = motion.velocity - medium.velocity
    force, torque = kirchhoff(added.matrix, relative, spin, weight=added.weight)
    if type(spin) is np.ndarray and not (medium.velocity.any() or medium.acceleration.any()):
        return force, torque
    drift = cross(spin, medium.velocity + spin * 0.0) - medium.acceleration
    push, twist = momentum(added.matrix, drift, spin * 0.0)
    return force + added.weight * push, torque + added.weight * twist
