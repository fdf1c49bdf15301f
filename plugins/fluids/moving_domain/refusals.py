"""Checks of the moving domain before memory is allocated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seals.arrays import Floats
from seals.environment.ground import Solid
from seals.environment.settings import EnvironmentSettings
from seals.errors import ConfigError, PhysicsError
from seals.plugins.fluids.moving_domain.box import Box
from seals.plugins.fluids.moving_domain.outer_sea import OuterSea
from seals.plugins.fluids.sampling import Samples

THINNEST = 4
"""Least width of the ring in spacings: a particle sees two of them."""
INSIDE = 4
"""Least width of what is left inside of the ring, in spacings."""
FEWEST = 6
"""Least depth in spacings."""
RESOLVED = 8.0
"""Shortest wave in spacings."""
STILL = 0.02
"""Largest vertical motion at a floor that stands still, over that at the surface [1]."""


def refuse_box(spacing: float, size: tuple[float, float, float], ring: int) -> None:
    """Refuse sizes that leave no water inside the relaxation zone.

    Raises:
        ConfigError: says what would do.
    """
    if ring < THINNEST:
        raise ConfigError(
            f"ring={ring} spacings is too thin: the range of a particle is two spacings.\n"
            f"Allowed: {THINNEST} or more; 5 is usual."
        )
    least = {"length": 2 * ring + INSIDE, "width": 2 * ring + INSIDE, "depth": FEWEST}
    for (name, count), length in zip(least.items(), size, strict=True):
        if length < count * spacing:
            raise ConfigError(
                f"the window's {name} of {length:.3g} m is too small for a spacing of "
                f"{spacing:g} m and a ring of {ring} spacings.\n"
                f"Allowed: {count * spacing:.3g} m or more, or a spacing up to "
                f"{max(length, 0.0) / count:.3g} m."
            )


def refuse_ground(environment: EnvironmentSettings, solids: Sequence[Solid]) -> None:
    """Refuse static solids in the water, which the moving domain could meet.

    Raises:
        ConfigError: names it.
    """
    level = float(environment.water_level or 0.0)
    for solid in solids:
        low = solid.position[2] - 0.5 * max(solid.size, default=0.0)
        if solid.kind != "plane" and low < level:
            raise ConfigError(
                f"'{solid.name}' is in the water: a window in an open sea has no shore or "
                "obstacles.\nUse a basin: water=particles, or leave it out."
            )


def refuse_sea(outer: OuterSea, box: Box, *, floor: float | None) -> None:
    """Refuse waves that the particles cannot resolve.

    Args:
        outer: the sea.
        box: the window.
        floor: height of the sea bed [m]; None for none.

    Raises:
        ConfigError: too short, or they would pass through the floor.
    """
    if outer.shortest < RESOLVED * box.spacing:
        raise ConfigError(
            f"the shortest wave of {outer.shortest:.3g} m is {outer.shortest / box.spacing:.1f} "
            f"spacings long.\nAllowed: {RESOLVED:g} or more; take a spacing up to "
            f"{outer.shortest / RESOLVED:.3g} m, or longer waves."
        )
    if floor is None or box.lower[2] > floor + 0.5 * box.spacing:
        return
    east = np.linspace(0.0, min(4.0 * outer.shortest, 1e6), 64)
    at = np.stack([east, 0.3 * east, np.full(64, floor)], axis=1)
    top = at + np.array([0.0, 0.0, outer.level - floor])
    deep, high = (np.abs(outer.displacement(p, 0.0)[:, 2]).max() for p in (at, top))
    if deep > STILL * high:
        raise ConfigError(
            f"the sea bed at {floor:g} m is fixed, but the waves move {deep / high:.0%} as "
            "high there as at the surface.\n"
            f"State the depth of the sea: wave=sea wave.depth={outer.level - floor:g}"
        )


def refuse_large_robot(samples: Samples, box: Box) -> None:
    """Refuse a robot that does not fit inside the relaxation zone.

    Args:
        samples: of the body that the window follows, about its reference point.
        box: the window.

    Raises:
        PhysicsError: says which window would do.
    """
    if not len(samples.points):
        return
    reach = float(np.linalg.norm(samples.points, axis=1).max()) + 0.5 * box.spacing
    needed = 2.0 * reach + 2.0 * (box.ring + box.cell + 1) * box.spacing
    side = float((box.upper - box.lower)[:2].min())
    if side < needed:
        raise PhysicsError(
            f"the window of {side:.3g} m is smaller than its robot of {2.0 * reach:.3g} m with a "
            f"ring of {box.ring} spacings on both sides.\n"
            f"Allowed: fluid.size of {needed:.3g} m or more; twice that for good forces."
        )


def refuse_astray(names: Sequence[str], rest: Floats, box: Box) -> None:
    """Refuse bodies outside the domain, where there are no particles.

    Args:
        names: of the bodies.
        rest: places of rest of their reference points [m], shape (K, 3).
        box: the window.

    Raises:
        PhysicsError: names the first one.
    """
    out = ~box.holds(rest)
    if out.any():
        name = names[int(np.argmax(out))]
        raise PhysicsError(
            f"'{name}' is outside the window, which follows '{names[0]}'.\n"
            "Increase fluid.size, or leave the object out: there is no water outside."
        )
