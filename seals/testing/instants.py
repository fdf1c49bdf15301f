"""Random inputs of hooks: motion and medium, on any array library."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, as_like
from seals.frames import matrix_of
from seals.motion import Body, Drives, Inputs, Joints, Medium, Motion, Reading

JOINTS, DRIVES = 3, 4


class Instant(NamedTuple):
    """All inputs that a hook may receive."""

    motion: Motion
    medium: Medium
    joints: Joints
    inputs: Inputs
    drives: Drives
    reading: Reading


def random_instant(rng: np.random.Generator, rows: int, *, still: bool = False) -> Instant:
    """Return random inputs as NumPy arrays.

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
        entry_shares=rng.uniform(0.1, 2.0, (rows, 6)),
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
    medium = _random_medium(rng, 1 if still else rows, rotation)
    inputs = Inputs(
        step=0.004,
        joint_torque=torque,
        drive=rng.uniform(200.0, 600.0, (rows, DRIVES)),
        voltage=rng.uniform(14.0, 16.8, (rows, 1)),
        joint_command=normal((rows, JOINTS)),
    )
    reading = Reading(
        normal((rows, 3)), 9.81 * normal((rows, 3)), normal((rows, 3)), normal((rows, 3))
    )
    # random rotors, some of which push
    axis = rng.standard_normal((DRIVES, 3))
    way = rng.choice((-1.0, 1.0), (rows, DRIVES))
    return Instant(
        motion,
        medium,
        joints,
        inputs,
        Drives(
            position=0.1 * rng.standard_normal((DRIVES, 3)),
            axis=axis / np.linalg.norm(axis, axis=1, keepdims=True),
            radius=rng.uniform(0.05, 0.2, DRIVES),
            thrust=way * rng.uniform(1.0, 4.0, (rows, DRIVES)),
            torque=0.02 * rng.standard_normal((rows, DRIVES)),
            speed=rng.uniform(200.0, 600.0, (rows, DRIVES)),
        ),
        reading,
    )


def _random_medium(rng: np.random.Generator, rows: int, rotation: Floats) -> Medium:
    """Random surroundings, partly submerged."""
    normal = rng.standard_normal
    share = rng.uniform(0.1, 0.9, (rows, 1))
    return Medium(
        medium_fraction=share,
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
        depth=0.1 * normal((rows, 1)),
        water_density=rng.uniform(900.0, 1100.0, (rows, 1)),
        air_density=np.array([[1.2]]),
    )


def converted(bundle: Any, like: Array) -> Any:
    """Return the same inputs in the array library of ``like``; numbers and None stay."""
    return _mapped(bundle, lambda x: as_like(x, like))


def picked(bundle: Any, row: int) -> Any:
    """Return one row of the inputs; fields with a single row, and drive positions, stay."""
    return _mapped(bundle, lambda x: x if x.shape[0] == 1 else x[row : row + 1], rowwise=True)


def repeated(bundle: Any, rows: int) -> Any:
    """Return the fields of one row repeated ``rows`` times."""
    return _mapped(
        bundle, lambda x: np.repeat(x, rows, axis=0) if x.shape[0] == 1 else x, rowwise=True
    )


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


def _mapped(bundle: Any, change: Any, *, rowwise: bool = False) -> Any:
    if bundle is None or isinstance(bundle, int | float):
        return bundle
    if rowwise and isinstance(bundle, Drives):
        given = {"thrust": bundle.thrust, "torque": bundle.torque, "speed": bundle.speed}
        return bundle._replace(**{k: None if x is None else change(x) for k, x in given.items()})
    if isinstance(bundle, tuple):
        parts = tuple(_mapped(part, change, rowwise=rowwise) for part in bundle)
        return type(bundle)(*parts) if hasattr(bundle, "_fields") else parts
    return change(bundle)
