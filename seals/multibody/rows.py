"""Conversion of row order: (batch, links) for the equations of motion, link by link for effects."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import numpy as np

from seals.arrays import Array, index_on, namespace
from seals.motion import Body, Motion
from seals.multibody.kinematics import Kinematics, LinkVelocities

Bundle = TypeVar("Bundle", bound=NamedTuple)
"""Arrays of rows that belong together."""


def link_motion(
    kinematics: Kinematics, moving: LinkVelocities, time: Array, bodies: Body
) -> Motion:
    """Motion of all links, rows link by link.

    Args:
        kinematics: poses (B, L, ...).
        moving: velocities of the links.
        time: [s], shape (1, 1) or (B, 1).
        bodies: constant properties, rows link by link.
    """
    rotation = by_link(kinematics.rotations)
    rows = by_link(moving.twists)
    if time.shape[0] > 1:
        time = namespace(time).concat([time] * (rows.shape[0] // time.shape[0]), axis=0)
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


def take(bundle: Bundle, rows: Any) -> Bundle:
    """Select rows of every field; fields with a single row are kept."""
    if rows is None:
        return bundle
    return type(bundle)._make(picked(bundle, rows))


def take_motion(motion: Motion, rows: Any) -> Motion:
    """Select rows of a motion and of its body."""
    if rows is None:
        return motion
    return Motion._make((*picked(motion[:-1], rows), take(motion.body, rows)))


def picked(fields: tuple[Array, ...], rows: Any) -> list[Array]:
    """Select rows of several fields; fields with a single row are kept."""
    if type(fields[0]) is np.ndarray:
        return [x if x is None or x.shape[0] == 1 else x[rows] for x in fields]
    return [_pick(x, rows) for x in fields]


def _pick(x: Array, rows: Any) -> Array:
    if x is None or x.shape[0] == 1:
        return x
    if isinstance(rows, slice):
        return x[rows]
    return namespace(x).take(x, index_on(rows, x), axis=0)
