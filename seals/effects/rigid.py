"""Changes of a link's rigid-body inertia: added weight, and the changed body."""

from __future__ import annotations

from seals.arrays import Array, columns, namespace
from seals.frames import cross
from seals.motion import Body, Motion, Wrench


def _moments_of(matrix: Array) -> tuple[Array, Array]:
    """Mass [kg], shape (N, 1), and first moment m c [kg m], shape (N, 3), of rigid inertias.

    Args:
        matrix: about the link origin, order [linear, angular], shape (N, 6, 6).
    """
    return matrix[:, 0, 0:1], columns(matrix[:, 5, 1], matrix[:, 3, 2], matrix[:, 4, 0])


def weight_of(matrix: Array, motion: Motion, gravity: Array) -> Wrench:
    """Weight of a change of inertia about the link origin, link axes [N, N m]."""
    mass, moment = _moments_of(matrix)
    pull = motion.up * -gravity
    return Wrench(mass * pull, cross(moment + motion.up * 0.0, pull))


def changed(body: Body, matrix: Array) -> Body:
    """Return the body with a change of inertia added.

    Args:
        body: constant properties, fields of shape (1 or N, k), rows link by link.
        matrix: sum of all changes about the link origin, shape (N, 6, 6), or one for each link.
    """
    mass, moment = (_everyone(x, body.mass.shape[0]) for x in _moments_of(matrix))
    total = body.mass + mass
    # a link without mass, such as a place where lift acts, keeps the centre it states
    none = total == 0.0
    centre = (body.mass * body.centre_of_mass + moment) / (total + none)
    centre = namespace(centre).where(none, body.centre_of_mass + centre * 0.0, centre)
    return body._replace(mass=total, centre_of_mass=centre)


def _everyone(change: Array, rows: int) -> Array:
    """Repeat one change per link for every row of the bodies."""
    count = change.shape[0]
    if count in (1, rows) or rows % count or rows == 1:
        return change
    return namespace(change).repeat(change, rows // count, axis=0)
