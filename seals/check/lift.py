"""Capability of a set of drives: hover thrust, control authority, rank of the allocation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats

WEAKEST = 1e-3
"""Singular value, against the largest, from which on a direction counts as commanded."""
WAYS = ("forward force", "sideways force", "vertical force", "roll", "pitch", "yaw")
"""Rows of a wrench matrix."""


class CommandedDirections(NamedTuple):
    """Directions of force and torque that the drives can command.

    Args:
        rank: number of directions.
        wanted: 4 for drives that all push the same way, 6 otherwise.
        condition: largest by smallest singular value, infinite below full rank [1].
        weakest: name of the direction that is hardest to command.
    """

    rank: int
    wanted: int
    condition: float
    weakest: str

    @classmethod
    def of(cls, matrix: Floats, centre: Floats, positions: Floats) -> CommandedDirections:
        """Return rank and condition of an allocation in units of full command.

        Moments are taken per mean arm, so that forces and moments compare.

        Args:
            matrix: from `wrench_matrix`.
            centre: of gravity [m], shape (3,).
            positions: of the drives [m], shape (n, 3).
        """
        arm = max(float(np.mean(np.linalg.norm(positions - centre, axis=1))), 1e-6)
        scaled = matrix / np.array([1.0, 1.0, 1.0, arm, arm, arm])[:, None]
        forces = np.linalg.matrix_rank(matrix[:3], tol=WEAKEST * float(np.abs(matrix[:3]).max()))
        # drives that all push along z can only ever command that force and three moments
        flat = forces == 1 and np.abs(matrix[2]).max() > 0.9 * np.abs(matrix[:3]).max()
        # fewer than six that all push up, canted or not, lift and turn it
        size = np.linalg.norm(matrix[:3], axis=0)
        flat |= matrix.shape[1] < 6 and bool(np.all(matrix[2] > 0.5 * size))
        rows = [2, 3, 4, 5] if flat else list(range(6))
        left, values, _ = np.linalg.svd(scaled[rows], full_matrices=True)
        values = np.concatenate((values, np.zeros(len(rows) - len(values))))
        rank = int(np.sum(values > WEAKEST * values[0]))
        condition = float(values[0] / values[-1]) if rank == len(rows) else float("inf")
        weakest = WAYS[rows[int(np.argmax(np.abs(left[:, -1])))]]
        return cls(rank, len(rows), condition, weakest)


def hover_share(matrix: Floats, weight: float, *, yaw: bool = True) -> float | None:
    """Return the fraction of full thrust at which the most loaded rotor holds the robot level.

    Args:
        matrix: of the rotors, from `wrench_matrix`.
        weight: [N].
        yaw: whether the yaw moment must vanish, too.

    Returns:
        The share [1], above one when the rotors are too weak; None when no thrusts balance.
    """
    from scipy.optimize import linprog

    count = matrix.shape[1]
    rows = slice(0, 6 if yaw else 5)
    size = np.abs(matrix).max(axis=1) + 1e-12
    # unknowns: one share a rotor, and the largest of them
    equal = np.concatenate((matrix / size[:, None], np.zeros((6, 1))), axis=1)[rows]
    load = (np.array([0.0, 0.0, weight, 0.0, 0.0, 0.0]) / size)[rows]
    below = np.concatenate((np.eye(count), -np.ones((count, 1))), axis=1)
    cost = np.zeros(count + 1)
    cost[-1] = 1.0
    found = linprog(cost, A_ub=below, b_ub=np.zeros(count), A_eq=equal, b_eq=load, bounds=(0, None))
    return float(np.asarray(found.x)[-1]) if found.status == 0 else None


def authority(matrix: Floats, weight: float, way: str) -> float:
    """Return the largest moment about one axis, both ways, while the weight is carried [N m].

    Args:
        matrix: of the rotors, from `wrench_matrix`.
        weight: [N].
        way: ``roll``, ``pitch`` or ``yaw``.
    """
    from scipy.optimize import linprog

    row = WAYS.index(way)
    others = [k for k in range(6) if k != row]
    load = np.array([0.0, 0.0, weight, 0.0, 0.0, 0.0])[others]
    most = []
    for sign in (1.0, -1.0):
        found = linprog(-sign * matrix[row], A_eq=matrix[others], b_eq=load, bounds=(0.0, 1.0))
        most.append(-float(found.fun or 0.0) if found.status == 0 else 0.0)
    return min(most)
