"""Random instants of motion and medium, on any array library."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, as_like
from seals.frames import matrix_of
from seals.motion import Body, Inputs, Joints, Medium, Motion

JOINTS = 3


class Instant(NamedTuple):
    """Everything a hook may be given."""

    motion: Motion
    medium: Medium
    joints: Joints
    inputs: Inputs


def random_instant(rng: np.random.Generator, rows: int, *, still: bool = False) -> Instant:
    """Return a random instant in NumPy arrays.

    Args:
        rng: random state.
        rows: number of rows N.
        still: medium of one row that stands for all, as in calm air.
    """
    normal = rng.standard_normal
    turn = normal((rows, 4))
    rotation = matrix_of(turn / np.linalg.norm(turn, axis=1, keepdims=True))
    body = Body(
        mass=rng.uniform(0.5, 2.0, (rows, 1)),
        centre_of_mass=0.05 * normal((rows, 3)),
        volume=rng.uniform(1e-3, 4e-3, (rows, 1)),
        plan_area=rng.uniform(0.01, 0.1, (rows, 1)),
    )
    motion = Motion(
        time=np.array([[0.37]]),
        position=normal((rows, 3)),
        rotation=rotation,
        up=rotation[:, 2, :],
        velocity=normal((rows, 3)),
        angular_velocity=normal((rows, 3)),
        body=body,
    )
    torque = 0.1 * normal((rows, JOINTS))
    joints = Joints(normal((rows, JOINTS)), normal((rows, JOINTS)))
    return Instant(
        motion, _random_medium(rng, 1 if still else rows, rotation), joints, Inputs(0.004, torque)
    )


def _random_medium(rng: np.random.Generator, rows: int, rotation: Floats) -> Medium:
    """Random surroundings, partly submerged."""
    normal = rng.standard_normal
    share = rng.uniform(0.1, 0.9, (rows, 1))
    return Medium(
        share=share,
        velocity=normal((rows, 3)),
        acceleration=normal((rows, 3)),
        density=rng.uniform(900.0, 1100.0, (rows, 1)),
        viscosity=rng.uniform(1e-3, 2e-3, (rows, 1)),
        submersion=share,
        submersion_rate=normal((rows, 1)),
        buoyancy_centre=0.05 * normal((rows, 3)),
        normal=rotation[:rows, 2, :],
        sinking_speed=normal((rows, 1)),
        gravity=np.array([[9.81]]),
    )


def converted(bundle: Any, like: Array) -> Any:
    """Return the same instant in the array library of ``like``; numbers and None stay."""
    return _mapped(bundle, lambda x: as_like(x, like))


def picked(bundle: Any, row: int) -> Any:
    """Return one row of an instant; fields of one row stay."""
    return _mapped(bundle, lambda x: x if x.shape[0] == 1 else x[row : row + 1])


def repeated(bundle: Any, rows: int) -> Any:
    """Return fields of one row repeated ``rows`` times."""
    return _mapped(bundle, lambda x: np.repeat(x, rows, axis=0) if x.shape[0] == 1 else x)


def copied(bundle: Any) -> Any:
    """Return a copy in NumPy, from any array library."""
    return _mapped(
        bundle, lambda x: np.array(x if isinstance(x, np.ndarray) else np.from_dlpack(x))
    )


def leaves(bundle: Any) -> list[Any]:
    """Return the arrays of a bundle in order, None included, numbers left out."""
    if isinstance(bundle, tuple):
        return [leaf for part in bundle for leaf in leaves(part)]
    return [] if isinstance(bundle, int | float) else [bundle]


def _mapped(bundle: Any, change: Any) -> Any:
    if bundle is None or isinstance(bundle, int | float):
        return bundle
    if isinstance(bundle, tuple):
        parts = tuple(_mapped(part, change) for part in bundle)
        return type(bundle)(*parts) if hasattr(bundle, "_fields") else parts
    return change(bundle)
