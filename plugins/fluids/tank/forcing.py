"""Forcing of the water besides walls and bodies: sponge layer (beach) and wind stress."""

from __future__ import annotations

import math

import numpy as np

from seals.arrays import Floats
from seals.plugins.fluids.tank.basin import Basin
from seals.plugins.fluids.tank.settings import BeachSettings, WindSettings


def apply_beach(
    beach: BeachSettings, basin: Basin, places: Floats, velocities: Floats, step: float
) -> Floats:
    """Return the velocities after one step of the sponge layer [m/s], shape (n, 3).

    Args:
        beach: its settings.
        basin: that it lies in.
        places: of the particles [m], shape (n, 3).
        velocities: [m/s], shape (n, 3).
        step: [s].
    """
    if beach.length <= 0.0:
        return velocities
    s = np.clip((places[:, 0] - basin.upper[0] + beach.length) / beach.length, 0.0, 1.0)
    keep = np.exp(-beach.rate * s * s * step)
    out: Floats = velocities * np.stack([keep, keep, keep * keep], axis=1)
    return out


def apply_wind(  # noqa: PLR0917  the water as it stands
    wind: WindSettings,
    basin: Basin,
    heights: Floats,
    places: Floats,
    velocities: Floats,
    share: float,
) -> Floats:
    """Return the velocities after one step of the wind stress [m/s], shape (n, 3).

    The stress acts on the particles of the uppermost spacing, each with the area of its column.

    Args:
        wind: its stress.
        basin: that holds the water.
        heights: of the surface over the particles [m], shape (n,).
        places: of the particles [m], shape (n, 3).
        velocities: [m/s], shape (n, 3).
        share: of the step over the density of the water [s m^3/kg].
    """
    if wind.stress_x == 0.0 and wind.stress_y == 0.0:
        return velocities
    top = places[:, 2] > heights - basin.spacing
    if not top.any():
        return velocities
    area = math.prod((basin.upper - basin.lower)[:2].tolist())
    gain = area * share / (top.sum() * basin.spacing**3)
    out: Floats = velocities.copy()
    out[top, 0] += wind.stress_x * gain
    out[top, 1] += wind.stress_y * gain
    return out
