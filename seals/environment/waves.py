"""Interface of wave plug-ins: water surface and motion of the water below it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

from seals.arrays import Array, columns, namespace


class Sea(NamedTuple):
    """The sea at some points; None stands for still water.

    Args:
        elevation: height of the surface above or below the points, world z [m], shape (N, 1) or a
            float.
        normal: unit normal of the surface, world axes [1], shape (N, 3).
        rise: speed of the surface along its normal [m/s], shape (N, 1).
        velocity: of the water at the points, world axes [m/s], shape (N, 3).
        acceleration: rate of that velocity at the points, world axes [m/s^2], shape (N, 3).
        gradient: of that velocity, row i by place that of its component i, world axes [1/s], shape
            (N, 3, 3). Water that moves gains G u besides, and bodies feel it; None neglects that.
    """

    elevation: Array
    normal: Array | None
    rise: Array | None
    velocity: Array | None
    acceleration: Array | None
    gradient: Array | None = None


def gradient_along(east: Array, north: Array, along: Array, down: Array) -> Array:
    """Return the velocity gradient of water that a wave moves in one vertical plane, (N, 3, 3).

    No water appears and none turns, so that two numbers make all nine.

    Args:
        east: cosine of the wave's direction, a number or (N,).
        north: its sine.
        along: gradient of the speed along that direction, along it [1/s], shape (N,).
        down: gradient of the same speed, upward [1/s], shape (N,).
    """
    level = (east * east * along, east * north * along, north * north * along)
    return gradient_of(level, (east * down, north * down))


def gradient_of(level: Sequence[Array], upward: Sequence[Array]) -> Array:
    """Return the velocity gradient of water in which nothing turns [1/s], shape (N, 3, 3).

    Args:
        level: of the eastward speed toward east and toward north, and of the northward speed toward
            north, (N,) each.
        upward: of the eastward and of the northward speed, upward, (N,) each.
    """
    (east, across, north), (up, side) = level, upward
    rows = (
        columns(east, across, up),
        columns(across, north, side),
        columns(up, side, -east - north),
    )
    return namespace(east).stack(rows, axis=1)


def carried(gradient: Array, velocity: Array) -> Array:
    """Return the convective acceleration in a velocity gradient, G u [m/s^2], shape (N, 3).

    Args:
        gradient: shape (N, 3, 3).
        velocity: shape (N or 1, 3).
    """
    return namespace(gradient).sum(gradient * velocity[:, None, :], axis=2)


class WaveOptions:
    """Optional attributes of waves and their defaults; see `options_of`."""

    gravity: float | None = None
    """Gravity of its dispersion [m/s^2]; None for waves without one of their own."""

    depth: float | None = None
    """Depth of the water of its dispersion [m]; None for deep water."""

    period: float = 0.0
    """Period at its peak [s]; 0 for waves without one."""


@runtime_checkable
class Waves(Protocol):
    """Wave plug-in: a keyword-only dataclass with one pure function.

    What waves may have beside it, and the defaults: `WaveOptions`.

    Waves that a diagnosis may find missing have besides: ``candidate``, the name under which it
    reports them; ``identification``; the class method ``additions(subject)``, whose addition
    without an effect holds the parameters of the waves; ``of_log``, which makes the waves that a
    log means by its parameters; ``beside()``, the effects by instance that go with them;
    ``per_log``, the fields of which each of several logs has its own; and the methods ``guesses``
    and ``plausible``, each as those of `seals.effects.Effect`.
    """

    def at(self, position: Array, time: Array, level: float) -> Sea:
        """Return the sea at points.

        Args:
            position: world [m], shape (N, 3).
            time: [s], shape (1 or N, 1).
            level: mean surface height [m].
        """


@runtime_checkable
class Orbits(Protocol):
    """Interface of waves with water displacement, needed by the moving domain of a fluid."""

    @property
    def shortest(self) -> float:
        """Length of its shortest wave [m]."""

    def displacement(self, position: Array, time: Array, level: float) -> Array:
        """Return the displacement of the water from its rest position [m], shape (N, 3).

        The velocity at the place of rest is the rate of the displacement, to first order in the
        steepness. The mean of the displacement makes up for the volume that the orbits squeeze at
        second order, so that water at its density of rest stays so.

        Args:
            position: of rest, world [m], shape (N, 3).
            time: [s], shape (1 or N, 1).
            level: mean surface height [m].
        """
