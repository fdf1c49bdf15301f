"""Axes of a vehicle that its drives can command, and their priority under saturation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seals.arrays import Floats
from seals.control.plant import ROTOR, Layout
from seals.errors import ConfigError, suggestion

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
"""Rows of a wrench: force along body x, y, z, then torque about them (SNAME 1950)."""
SURGE, SWAY, HEAVE, ROLL, PITCH, YAW = range(6)
STATION_ORDER = (SURGE, SWAY, HEAVE, YAW, ROLL, PITCH)
"""Order in which axes are claimed: a vehicle moves with its thrust before it leans with it."""
OWN = 0.02
"""Share of the strongest axis that must be an axis' own for it to be commanded; else passive."""
LEAST_WEIGHT = 1e-3
"""Smallest weight of a rank of priority: its square stays far above the softening of the solver."""


def wrench_matrix(layout: Layout, centre: Floats) -> Floats:
    """Return the wrench of each drive at full command, shape (6, n).

    Args:
        layout: of the drives, n of them.
        centre: of gravity, body axes [m], shape (3,).

    Returns:
        Rows of force [N], then of moment about the centre [N m], body axes.
    """
    power = np.where([kind == ROTOR for kind in layout.kind], layout.limit**2, layout.limit)
    thrust = layout.thrust_coefficient * power
    reaction = layout.reaction_coefficient * power
    force = (layout.axis * thrust[:, None]).T
    moment = np.cross(layout.position - centre, layout.axis) * thrust[:, None]
    return np.concatenate((force, (moment + layout.axis * reaction[:, None]).T))


def mean_arm(layout: Layout, centre: Floats) -> float:
    """Return the mean distance of the drives from a centre [m], which scales moments to forces."""
    if not layout.drives:
        return 1.0
    return max(float(np.mean(np.linalg.norm(layout.position - centre, axis=1))), 1e-6)


def commanded_axes(
    matrix: Floats, arm: float, order: Sequence[int] = STATION_ORDER
) -> tuple[int, ...]:
    """Return the axes that can be commanded independently of each other, ascending.

    Axes claim their direction of the drives' space in turn. One that has next to nothing left of
    its own, such as the pitch of a vehicle whose thrusters all lie in one plane, is passive.

    Args:
        matrix: from `wrench_matrix`, shape (6, n).
        arm: by which moments are divided, from `mean_arm` [m].
        order: axes in the order in which they claim.

    Example:
        >>> commanded_axes(np.eye(6)[:, [0, 2]], 1.0)
        (0, 2)
    """
    scaled = matrix / np.array([1.0, 1.0, 1.0, arm, arm, arm])[:, None]
    most = float(np.sqrt((scaled * scaled).sum(axis=1)).max(initial=0.0))
    taken: list[Floats] = []
    found = []
    for axis in order:
        own = scaled[axis].astype(float)
        for direction in taken:
            own = own - (own @ direction) * direction
        size = float(np.sqrt(own @ own))
        if size > OWN * most:
            taken.append(own / size)
            found.append(axis)
    return tuple(sorted(found))


def named_axes(axes: Sequence[int]) -> str:
    """Return the names of axes as text.

    Example:
        >>> named_axes((0, 5))
        'surge, yaw'
    """
    return ", ".join(AXES[k] for k in axes) or "none"


def priority_weights(priority: Sequence[str], rows: Sequence[int]) -> Floats:
    """Return the weight of each row by its rank: 1 first, each next one smaller by one ratio <= 10.

    Weighted least squares then leave a rank an error of at most the ratio times those of the ranks
    below it, each error as a share of what the drives can do.

    Args:
        priority: ranks, the first gives way last; axes of one rank are joined by ``+``. Axes that
            are left out come last.
        rows: numbers of the wanted axes.

    Raises:
        ConfigError: a name is not an axis, or stands twice.

    Example:
        >>> priority_weights(["yaw", "surge+sway"], (0, 1, 5))
        array([0.1, 0.1, 1. ])
    """
    ranks = [[name.strip() for name in entry.split("+")] for entry in priority]
    named = [name for rank in ranks for name in rank]
    for name in named:
        if name not in AXES or named.count(name) > 1:
            what = "stands twice" if name in AXES else "is not an axis"
            raise ConfigError(
                f"priority={list(priority)}: '{name}' {what}.\n"
                f"{suggestion(name, AXES)}  Write [roll+pitch,yaw,heave,surge+sway]."
            )
    ranks.append([name for name in AXES if name not in named])
    present = [rank for rank in ranks if any(AXES[k] in rank for k in rows)]
    ratio = max(0.1, LEAST_WEIGHT ** (1.0 / max(len(present) - 1, 1)))
    weight = {name: ratio**k for k, rank in enumerate(present) for name in rank}
    return np.array([weight[AXES[k]] for k in rows])
