"""Inertia, momentum and Kirchhoff terms of one body in six dimensions.

All are about the link origin in link axes.
"""

from __future__ import annotations

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.frames import FEW, cross, skew_last
from seals.motion import AddedInertia, Medium, Motion


def rigid_inertia(mass: float, centre: Floats, inertia: Floats) -> Floats:
    """Inertia matrix of a rigid body about the link origin.

    Args:
        mass: [kg].
        centre: centre of mass in link axes [m], shape (3,).
        inertia: about the centre of mass, link axes [kg m^2], shape (3, 3).

    Returns:
        Matrix, order [linear, angular], shape (6, 6).
    """
    s = skew_last(np.asarray(centre, dtype=float))
    out = np.empty((6, 6))
    out[:3, :3], out[:3, 3:] = mass * np.eye(3), -mass * s
    # Steiner: J = J_C - m (c x)(c x)
    out[3:, :3], out[3:, 3:] = mass * s, inertia - mass * s @ s
    return out


def twist_map(origin: Floats, turn: Floats) -> Floats:
    """Return the map from the twist of a body to that of a frame fixed to it, frame axes.

    Args:
        origin: of the frame in the body [m], shape (3,).
        turn: rotation of the frame in the body, shape (3, 3).
    """
    arm = skew_last(np.asarray(origin, dtype=float))
    out = np.zeros((6, 6))
    # V = R^T (v + w x o) = R^T v - R^T (o x) w, W = R^T w
    out[:3, :3], out[:3, 3:], out[3:, 3:] = turn.T, -turn.T @ arm, turn.T
    return out


def momentum(matrix: Array, velocity: Array, spin: Array) -> tuple[Array, Array]:
    """Linear and angular momentum, matrix times [velocity, spin].

    Args:
        matrix: shape (1 or N, 6, 6); on NumPy also one for each of several links of equal many
            rows, shape (L, 6, 6).
        velocity: [m/s], shape (N, 3).
        spin: [rad/s], shape (N, 3).

    Returns:
        Linear [kg m/s] and angular momentum [kg m^2/s], each (N, 3).
    """
    xp = namespace(velocity)
    if matrix.shape[0] == 1:
        twist = xp.concat((velocity.T, spin.T), axis=0)
        both = xp.matmul(matrix[0], twist)
        return both[:3].T, both[3:].T
    twist = xp.concat((velocity, spin), axis=1)
    if matrix.shape[0] < twist.shape[0]:
        # one matrix for each link, rows link by link
        rows = twist.reshape(matrix.shape[0], -1, 6)
        both = np.matmul(rows, matrix.transpose(0, 2, 1)).reshape(-1, 6)
    else:
        both = xp.matmul(matrix, twist[:, :, None])[:, :, 0]
    return both[:, :3], both[:, 3:]


def kirchhoff(
    matrix: Array, velocity: Array, spin: Array, *, weight: Array | None = None
) -> tuple[Array, Array]:
    """Velocity-dependent terms of a body with a general inertia matrix.

    Equation:
        F = w x p, T = w x L + v x p with (p, L) = matrix (v, w); the equations of motion are
        matrix (v', w') + (F, T) = wrench, derivatives taken in body axes (Kirchhoff).

    Args:
        matrix: shape (1 or N, 6, 6).
        velocity: relative to the medium for added mass [m/s], shape (N, 3).
        spin: [rad/s], shape (N, 3).
        weight: factor of the matrix, shape (N, 1).
    """
    xp = namespace(velocity)
    if type(velocity) is np.ndarray and velocity.shape == spin.shape and len(velocity) < FEW:
        return _few(matrix, velocity, spin, weight)
    linear, angular = momentum(matrix, velocity, spin)
    if weight is not None:
        linear, angular = weight * linear, weight * angular
    # three cross products in one call; rows of one body stand for the batch
    if linear.shape[0] != velocity.shape[0] or spin.shape[0] != velocity.shape[0]:
        return cross(spin, linear), cross(spin, angular) + cross(velocity, linear)
    n = velocity.shape[0]
    left = xp.concat((spin.T, spin.T, velocity.T), axis=1).T
    right = xp.concat((linear.T, angular.T, linear.T), axis=1).T
    turned = cross(left, right)
    return turned[:n], turned[n : 2 * n] + turned[2 * n :]


def _few(
    matrix: Floats, velocity: Floats, spin: Floats, weight: Floats | None
) -> tuple[Floats, Floats]:
    """Kirchhoff terms of a few rows: small matrix products instead of column operations."""
    twist = np.concatenate((velocity, spin), axis=1)
    both = np.matmul(matrix, twist[:, :, None])
    if weight is not None:
        both = weight[:, :, None] * both
    linear, angular = both[:, :3], both[:, 3:]
    # F = w x p, T = w x L + v x p (Kirchhoff; Lamb 1932, chapter VI)
    turning = skew_last(spin)
    force = np.matmul(turning, linear)[:, :, 0]
    torque = np.matmul(turning, angular) + np.matmul(skew_last(velocity), linear)
    return force, torque[:, :, 0]


def added_terms(added: AddedInertia, medium: Medium, motion: Motion) -> tuple[Array, Array]:
    """Velocity-dependent reaction of an added inertia about the link origin, link axes [N, N m].

    Equation:
        weight A (w x u - a, 0) + Kirchhoff terms of weight A at (v - u, w), with u the velocity
        and a the acceleration of the medium: what remains of d/dt (weight A nu_r) when
        (v', w') = 0 and weight is held. An inertia apart, along directions that rest in the world,
        has A (w x v - a, 0) alone: Coriolis and Munk terms would turn a ball that enters aslant.
    """
    spin = motion.angular_velocity
    if added.apart:
        drift = cross(spin, motion.velocity) - medium.acceleration
        return momentum(added.matrix, drift, spin * 0.0)
    # added mass answers to the motion through the water, not to that in the world
    relative = motion.velocity - medium.velocity
    force, torque = kirchhoff(added.matrix, relative, spin, weight=added.weight)
    if type(spin) is np.ndarray and not (medium.velocity.any() or medium.acceleration.any()):
        return force, torque
    drift = cross(spin, medium.velocity + spin * 0.0) - medium.acceleration
    push, twist = momentum(added.matrix, drift, spin * 0.0)
    return force + added.weight * push, torque + added.weight * twist
