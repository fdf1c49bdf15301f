"""Initial servo gains and hydrodynamic coefficients of a new robot, by rules of thumb."""

from __future__ import annotations

import math

import numpy as np

from seals.arrays import Floats
from seals.check.joints import joint_loads_of
from seals.robot.model import RobotModel
from seals.scaffold.drag import WATER
from seals.scaffold.ellipsoid import added_mass_of_ellipsoid
from seals.scaffold.shapes import LinkHull
from seals.scaffold.takeover import Takeover

FREQUENCY, DAMPING = 6.0, 1.0
"""Natural frequency [Hz] and damping ratio of the servos: a brisk hobby servo, no overshoot."""
RESERVE = 3.0
"""Torque of a servo whose URDF states none, by the torque that holds its joint level."""
_LEAST_TORQUE = 0.01


def servo_values(robot: RobotModel, source: Takeover) -> dict[str, list[float]]:
    """Return gains and limits of the servos, one number per joint.

    Args:
        robot: with the joints that remain.
        source: the URDF, for limits of effort.
    """
    inertia, hold = joint_loads_of(robot)
    rate = 2.0 * math.pi * FREQUENCY
    safe = np.maximum(inertia, 1e-7)
    stated = np.array([source.effort_limit(name) for name in robot.joints])
    limit = np.where(stated > 0.0, stated, np.maximum(RESERVE * hold, _LEAST_TORQUE))
    return {
        "kp_each": [short(x) for x in safe * rate**2],
        "kd_each": [short(x) for x in 2.0 * DAMPING * safe * rate],
        "torque_limit_each": [short(x) for x in limit],
    }


def added_mass(hull: LinkHull) -> Floats:
    """Return the added-mass matrix in water about the link origin, shape (6, 6).

    Every shape counts as the ellipsoid of its volume with the proportions of its box.
    """
    total = np.zeros((6, 6))
    for box, volume in zip(hull.boxes, hull.volumes, strict=True):
        half = np.maximum(box.edges / 2.0, 1e-6)
        size = volume / (4.0 / 3.0 * math.pi * float(half.prod()))
        own = added_mass_of_ellipsoid(half * size ** (1.0 / 3.0), WATER)
        linear = box.turn @ np.diag(own[:3]) @ box.turn.T
        angular = box.turn @ np.diag(own[3:]) @ box.turn.T
        x, y, z = box.centre
        arm = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        total[:3, :3] += linear
        total[:3, 3:] -= linear @ arm
        total[3:, :3] += arm @ linear
        total[3:, 3:] += angular - arm @ linear @ arm
    return _without_trifles(total)


def _without_trifles(matrix: Floats) -> Floats:
    """Couplings below a hundredth of what they couple are left out; three digits stay.

    A sphere off the origin adds no moment of its own: a thousandth more keeps the rounded matrix
    from being indefinite.
    """
    for part in (slice(0, 3), slice(3, 6)):
        own = matrix[part, part]
        own[np.abs(own) < 1e-9 * np.abs(own).max()] = 0.0
    size = np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
    kept = np.where(np.abs(matrix) > 0.01 * size, 0.5 * (matrix + matrix.T), 0.0)
    diagonal = np.diag(kept)
    if np.any(kept - np.diag(diagonal)):
        kept[[3, 4, 5], [3, 4, 5]] *= 1.001
        return kept
    return np.diag([short(float(x)) for x in diagonal])


def short(value: float) -> float:
    """Return a number with three significant digits.

    Example:
        >>> short(0.0123456)
        0.0123
    """
    return float(f"{value:.3g}")
