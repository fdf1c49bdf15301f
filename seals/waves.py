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


@runtime_checkable
class Orbits(Protocol):
    """A wave that also knows how far it carries the water: what a window in the sea asks for."""

    @property
    def shortest(self) -> float:
        """Length of its shortest wave [m]."""
        ...

    def displacement(self, position: Array, time: Array, level: float) -> Array:
        """Return how far the water is from where it would rest [m], shape (N, 3).

        The velocity at the place of rest is the rate of the displacement, to first order in the
        steepness. The mean of the displacement makes up for the volume that the orbits squeeze at
        second order, so that water at its density of rest stays so.

        Args:
            position: of rest, world [m], shape (N, 3).
            time: [s], shape (1 or N, 1).
            level: mean surface height [m].
        """
        ...
