"""Checks of particles and bodies given to the solver, and of its state after a step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import PhysicsError
from seals.plugins.fluids.solvers.pbf.fields import CROWDED, ESCAPED, LONGEST, NOT_FINITE
from seals.plugins.fluids.solvers.pbf.points import nearest_pair

Array = NDArray[np.float64]
# particles, and particles and samples, may be filled this close [spacings]
CLOSEST = 0.6


def check_state(arrays: Mapping[str, Any], capacity: int) -> None:
    """Refuse a stored state with indices or sizes outside the arrays.

    Raises:
        ValueError: a count, the numbers of the particles, or the origin cannot be.
    """
    count = arrays["count"]
    if type(count) is not int or not 0 <= count <= capacity:
        raise ValueError(f"{str(count)[:40]} particles; this water holds 0 to {capacity:,}")
    if not np.array_equal(np.sort(arrays["number"][:count]), np.arange(count)):
        raise ValueError("the particles are not numbered from 0, each once")
    if not np.isfinite(arrays["origin"]).all():
        raise ValueError("the origin of the water is not finite")


def check_fill(
    new: Array,
    speed: Array,
    *,
    have: Array,
    static: Array,
    lower: Array,
    size: Array,
    spacing: float,
    capacity: int,
    trusted: bool,
) -> None:
    """Refuse initial particles that are invalid, such as not finite or overlapping.

    Raises:
        PhysicsError: wrong shape, not finite, outside, over capacity, or overlapping.
    """
    if new.ndim != 2 or new.shape[1] != 3 or speed.shape != new.shape:
        raise PhysicsError(
            f"Particles need positions and velocities of shape (n, 3), "
            f"not {new.shape} and {speed.shape}."
        )
    if not (np.isfinite(new).all() and np.isfinite(speed).all()):
        raise PhysicsError("A position or velocity of the particles to fill is not finite.")
    if len(new) + len(have) > capacity:
        raise PhysicsError(
            f"{len(new) + len(have)} particles exceed the capacity of {capacity}.\n"
            "Give more capacity, less water, or a coarser spacing; none were left out."
        )
    outside = ((new < lower) | (new > lower + size)).any(axis=1)
    if outside.any():
        raise PhysicsError(
            f"{outside.sum()} of {len(new)} particles lie outside of the domain "
            f"{lower} .. {lower + size} m, the first at {new[outside][0]}."
        )
    if not trusted:
        _overlaps(new, have=have, static=static, spacing=spacing)


def _overlaps(new: Array, *, have: Array, static: Array, spacing: float) -> None:
    radius = CLOSEST * spacing
    for other, name in ((have, "particles already there"), (static, "static boundary samples")):
        gap = nearest_pair(new, other, radius)
        if gap < radius:
            raise PhysicsError(
                f"Particles to fill overlap {name}: {gap:.4g} m apart, spacing {spacing:.4g} m.\n"
                "Leave out what lies within one spacing."
            )
    gap = nearest_pair(new, new, radius, same=True)
    if gap < radius:
        raise PhysicsError(
            f"Particles to fill overlap each other: {gap:.4g} m apart, spacing {spacing:.4g} m."
        )


def check_place(values: list[Any], bodies: int) -> None:
    """Refuse poses, twists and masses that are not finite, or not one per body.

    Raises:
        PhysicsError: wrong length or not finite.
    """
    for value in values:
        array = np.asarray(value)
        if len(array) != bodies or not np.isfinite(array).all():
            raise PhysicsError(
                f"place_bodies() needs finite values for each of {bodies} bodies; got shape "
                f"{array.shape}{'' if np.isfinite(array).all() else ' with values not finite'}."
            )


def trouble(
    found: NDArray[np.int32],
    *,
    finite: bool,
    outflow: bool,
    time: float,
    substep: float,
    longest: int,
    advised: float,
) -> str:
    """Return the reason why an advance failed, or an empty string."""
    when = f"at {time:.4g} s"
    if found[NOT_FINITE] or not finite:
        return (
            f"The water became not finite {when} (substep {substep:.3g} s).\n"
            f"Take substeps of {advised:.3g} s or less, and check bodies that start in the water."
        )
    if found[CROWDED]:
        return (
            f"{found[CROWDED]} particles had more than neighbours={longest} neighbours {when}, "
            f"up to {found[LONGEST]}.\n"
            "A body may have been placed over water; else raise neighbours."
        )
    if found[ESCAPED] and not outflow:
        return (
            f"{found[ESCAPED]} times a particle was outside of the domain {when}.\n"
            "Close the gap in the walls (samples one spacing apart), take shorter substeps, "
            "enlarge the domain, or set outflow=true to let water go."
        )
    return ""
