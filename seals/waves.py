"""The protocol of wave plug-ins: the water surface and the motion of the water under it."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

from seals.arrays import Array


class Sea(NamedTuple):
    """The sea at some points; None stands for still water.

    Args:
        elevation: height of the surface above or below the points, world z [m], shape (N, 1) or a
            float.
        normal: unit normal of the surface, world axes [1], shape (N, 3).
        rise: speed of the surface along its normal [m/s], shape (N, 1).
        velocity: of the water at the points, world axes [m/s], shape (N, 3).
        acceleration: of the water at the points, world axes [m/s^2], shape (N, 3).
    """

    elevation: Array
    normal: Array | None
    rise: Array | None
    velocity: Array | None
    acceleration: Array | None


@runtime_checkable
class Waves(Protocol):
    """A wave plug-in: a keyword-only dataclass with one pure function."""

    def at(self, position: Array, time: Array, level: float) -> Sea:
        """Return the sea at points.

        Args:
            position: world [m], shape (N, 3).
            time: [s], shape (1 or N, 1).
            level: mean surface height [m].
        """
        ...
