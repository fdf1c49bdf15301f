"""Order of rows: (batch, links, ...) for the equations of motion, link by link for the effects."""

from __future__ import annotations

from seals.arrays import Array, namespace
from seals.motion import Body, Motion
from seals.multibody.kinematics import Kinematics, Moving


def link_motion(kinematics: Kinematics, moving: Moving, time: Array, bodies: Body) -> Motion:
    """Motion of all links, rows link by link.

    Args:
        kinematics: poses (B, L, ...).
        moving: velocities of the links.
        time: [s], shape (1, 1).
        bodies: constant properties, rows link by link.
    """
    rotation = by_link(kinematics.rotations)
    rows = by_link(moving.twists)
    return Motion(
        time=time,
        position=by_link(kinematics.origins),
        rotation=rotation,
        up=rotation[:, 2, :],
        velocity=rows[:, :3],
        angular_velocity=rows[:, 3:],
        body=bodies,
    )


def by_link(x: Array) -> Array:
    """Reorder (B, L, ...) into rows link by link, (L B, ...)."""
    if x.shape[0] == 1:
        return x[0]
    xp = namespace(x)
    order = (1, 0, *range(2, x.ndim))
    return xp.reshape(xp.permute_dims(x, order), (x.shape[0] * x.shape[1], *x.shape[2:]))


def by_batch(x: Array, links: int) -> Array:
    """Reorder rows link by link (L B, ...) into (B, L, ...)."""
    if x.shape[0] == links:
        return x[None]
    xp = namespace(x)
    shaped = xp.reshape(x, (links, x.shape[0] // links, *x.shape[1:]))
    return xp.permute_dims(shaped, (1, 0, *range(2, shaped.ndim)))
