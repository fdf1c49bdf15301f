"""Echoes of a sonar over range: scattering of ray hits, and their spread over range bins."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.sensors.casting import Hits


class Echoes(NamedTuple):
    """Echoes of n rays.

    Args:
        way: one-way range at which each arrives [m], infinite for none, shape (n,).
        extent: of range over which its cell returns sound [m], shape (n,).
        power: intensity over that of the source at 1 m [1], shape (n,).
    """

    way: Floats
    extent: Floats
    power: Floats

    def over_range(
        self,
        columns: int,
        bins: int,
        *,
        nearest: float,
        size: float,
        pulse: float,
    ) -> Floats:
        """Return intensity over range for each column of rays, shape (columns, bins).

        Equation:
            A point returns its power over the length of the pulse, p = c tau / 2; a cell of extent
            e the same energy over e + p. A bin has the mean over its length.

        Args:
            columns: of rays.
            bins: of range.
            nearest: range where the first begins [m].
            size: of a bin [m].
            pulse: length of the pulse in range [m].
        """
        count = len(self.way)
        met = np.flatnonzero(self.power > 0.0)
        column = (np.arange(count) % columns)[met]
        width = self.extent[met] + pulse
        low = (self.way[met] - 0.5 * width - nearest) / size
        # integral of a step function: its slope changes where a cell begins and where it ends
        slope = self.power[met] * pulse / width
        edges = np.clip(np.concatenate([low, low + width / size]), 0.0, float(bins))
        slope = np.concatenate([slope, -slope])
        place = np.ceil(edges).astype(np.int64) + np.concatenate([column, column]) * (bins + 1)
        total = columns * (bins + 1)
        rise = np.bincount(place, slope, total).reshape(columns, bins + 1).cumsum(axis=1)
        less = np.bincount(place, slope * edges, total).reshape(columns, bins + 1).cumsum(axis=1)
        integral = rise * np.arange(bins + 1) - less
        found: Floats = np.maximum(np.diff(integral, axis=1), 0.0)
        return found


def scattered(
    hits: Hits, directions: Array, across: Array, strength: Array, *, loss: float, step: float
) -> Echoes:
    """Return the echoes of ray hits by Lambert's law, without the beam patterns.

    Equation:
        A ray of solid angle W meets the area A = W r^2 / cos i at incidence i and range r, of
        backscattering strength m cos(i)^2. Its echo is m cos(i)^2 A / r^4 10^(-2 a r / 10) =
        m cos(i) W / r^2 10^(-2 a r / 10); the factor W is left to the caller. Over the height of
        the ray's cell, the angle d, range changes by d r (n . t) / (n . u).

    Args:
        hits: of the rays.
        directions: u, unit vectors, shape (n, 3).
        across: t, their derivatives with respect to elevation, shape (n, 3).
        strength: m of what each ray met [1], shape (n,).
        loss: absorption a [dB/m].
        step: height of a cell, d [rad].

    References:
        Urick 1983, Principles of Underwater Sound, ch. 2 and 8 (sonar equation, Lambert's law).
    """
    xp = namespace(directions)
    met = xp.isfinite(hits.distance)
    way = xp.where(met, hits.distance, 1.0)
    facing = xp.abs(xp.vecdot(hits.normal, directions))
    sloping = xp.abs(xp.vecdot(hits.normal, across))
    extent = step * way * sloping / xp.maximum(facing, 1e-3)
    power = strength * facing * 10.0 ** (-0.2 * loss * way) / (way * way)
    return Echoes(hits.distance, extent, xp.where(met, power, 0.0))
