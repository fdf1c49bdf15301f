"""Submerged fraction of a rotor or propeller disc."""

from __future__ import annotations

import numpy as np

from seals.arrays import Array, namespace
from seals.motion import Drives, Medium, Motion


def wet_share(depth: Array, half_width: Array | float) -> Array:
    """Return the submerged fraction of a disc [1], smooth from 0 to 1.

    Equation:
        u^2 (3 - 2 u) with u = (depth + half_width) / (2 half_width), held between 0 and 1.

    Args:
        depth: of the hub below the surface [m].
        half_width: depth at which the disc is wholly wet [m].

    Example:
        >>> import numpy as np
        >>> wet_share(np.array([-0.2, 0.0, 0.2]), 0.1)
        array([0. , 0.5, 1. ])
    """
    u = (depth + half_width) / (2.0 * half_width)
    if type(u) is np.ndarray:
        u = np.minimum(np.maximum(u, 0.0), 1.0)
    else:
        u = namespace(depth).clip(u, 0.0, 1.0)
    return u * u * (3.0 - 2.0 * u)


def hub_depth(drives: Drives, motion: Motion, medium: Medium) -> Array | None:
    """Return the distance of every hub below the surface [m], shape (N, n); None without water.

    Under waves the surface is taken as plane around the link, and the distance is along its normal.
    """
    if medium.depth is None:
        return None
    if medium.normal is None:
        return medium.depth - motion.up @ drives.position.T
    slant = namespace(motion.up).sum(medium.normal * motion.up, axis=1, keepdims=True)
    return medium.depth * slant - medium.normal @ drives.position.T
