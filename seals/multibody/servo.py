"""Implicit integration of joint drives: stable at any gain, within their limits.

A drive pulls a joint toward a place with a force that falls with the joint's position and velocity.
Where it falls so steeply that a step cannot follow, the step must know the fall: the force is that
at the end of the step, and the fall stands on the left side of the equations of motion.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Array, namespace, some
from seals.motion import JointDrive
from seals.multibody.linear import solved

GAINS = ("kp", "kd", "torque_limit", "armature")
"""Numbers of the servo of a joint."""


def limited(drive: JointDrive) -> Array:
    """Generalised forces of joint drives within their limits [N m or N], shape (N, J)."""
    xp = namespace(drive.force)
    return drive.limit * xp.clip(drive.force / drive.limit, -1.0, 1.0)


def resisted(
    matrix: Array, right: Array, resistance: Array, ahead: Any, change: Array | None = None
) -> tuple[Array, Array]:
    """Take resistances of the joints implicitly.

    Equation:
        (M + ahead r on the joints) a = right + ahead r a0 on the joints, for right with -r q'.

    Args:
        matrix: M, generalised inertia, joints last, shape (B, n, n).
        right: generalised force [N, N m], shape (B, n).
        resistance: r, share of the joint rates in it [N m s/rad or N s/m], shape (1 or B, J).
        ahead: time from the rates of ``right`` to those that resist [s].
        change: a0, acceleration of the joints that those rates know of, (1 or B, J); None for none.
    """
    # the rates that resist are q' + ahead a: what `right` knows of a is taken back
    later = ahead * resistance + 0.0 * right[:, right.shape[1] - resistance.shape[1] :]
    if change is not None:
        lead = right.shape[1] - later.shape[1]
        more = right[:, lead:] + later * change
        right = namespace(right).concat((right[:, :lead], more), axis=1)
    return heavier(matrix, later), right


def driven(matrix: Array, right: Array, drive: JointDrive, gain: Array) -> tuple[Array, Array]:
    """Solve the equations of motion with implicit joint drives and their limits.

    Equation:
        matrix a = right + f on the joints, f = clip(force - gain a, -limit, limit). A joint at its
        limit keeps it; that is exact for one joint, and for several unless one at its limit brings
        another to its own.

    Args:
        matrix: generalised inertia, joints last, shape (B, n, n).
        right: generalised force of everything else [N, N m], shape (B, n).
        drive: force and limit of the drives, J of them.
        gain: of the acceleration [kg m^2 or kg], shape (1 or B, J).

    Returns:
        Generalised acceleration, shape (B, n), and the drives' forces, shape (B, J).
    """
    xp = namespace(matrix)
    force, limit = drive.force, drive.limit
    lead = matrix.shape[1] - force.shape[1]
    change = _solve(matrix, right, force, gain)
    wanted = force - gain * change[:, lead:]
    beyond = xp.abs(wanted) > limit
    if not some(beyond):
        return change, wanted
    at_limit = xp.astype(beyond, wanted.dtype)
    # at a limit the force no longer falls with the acceleration: its gain is zero
    held = at_limit * xp.sign(wanted) * limit + (1.0 - at_limit) * force
    left = (1.0 - at_limit) * gain
    change = _solve(matrix, right, held, left)
    wanted = held - left * change[:, lead:]
    return change, xp.clip(wanted, -limit, limit)


def heavier(matrix: Array, armature: Array) -> Array:
    """Add the inertia of drives (1 or B, J) to generalised inertias (B, n, n)."""
    size, joints = matrix.shape[1], armature.shape[1]
    if type(matrix) is np.ndarray and len(matrix) == 1:
        out = matrix.copy()
        # every (n + 1)-th entry from the first joint on: the lower part of the diagonal
        out.ravel()[(size - joints) * (size + 1) :: size + 1] += armature[0]
        return out
    # the joints are the last coordinates of the diagonal
    xp = namespace(armature)
    place = {"dtype": armature.dtype, "device": armature.device}
    lead = xp.zeros((armature.shape[0], size - armature.shape[1]), **place)
    diagonal = xp.concat((lead, armature), axis=1)
    return matrix + diagonal[:, :, None] * xp.eye(size, **place)[None]


def _solve(matrix: Array, right: Array, force: Array, gain: Array) -> Array:
    """Solve (matrix + gain on the joints) a = right + force on the joints."""
    xp = namespace(matrix)
    size = matrix.shape[1]
    lead = size - force.shape[1]
    if type(matrix) is np.ndarray and len(matrix) == 1:
        # one robot, every step of the simulator: no diagonal matrix, no batch
        both = right[0].copy()
        both[lead:] += force[0]
        return solved(heavier(matrix, gain)[0], both)[None]
    both = xp.concat((right[:, :lead], right[:, lead:] + force), axis=1)
    return xp.linalg.solve(heavier(matrix, gain), both[:, :, None])[:, :, 0]
