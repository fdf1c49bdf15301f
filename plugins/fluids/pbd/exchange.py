"""What the water hands back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Exchange(NamedTuple):
    """What the water did during one ``advance``.

    Args:
        impulses: impulse of the water on each body, force part then moment about its centre of
            mass, world axes [N s, N m s], shape (K, 6).
        walls: impulse of the water on everything static [N s], shape (3,).
        gravity: impulse of gravity on the water [N s], shape (3,).
        external: change of the water's momentum that nothing above accounts for [N s], shape (3,):
            rounding, and vorticity confinement where it is on.
        iterations: density iterations, mean over the substeps.
        mean_compression: mean of max(density / rest density - 1, 0) after the last substep [1].
        max_compression: its maximum [1].
        left: particles that left through an open domain face, taken out during this advance.
    """

    impulses: Array
    walls: Array
    gravity: Array
    external: Array
    iterations: float
    mean_compression: float
    max_compression: float
    left: int


@dataclass(frozen=True)
class Snapshot:
    """State of the water, to be handed to ``restore``."""

    arrays: dict[str, Any]
