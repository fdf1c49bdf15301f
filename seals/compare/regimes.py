"""Regimes of a log, read from the data: rest, air, entry, water, exit, contact."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.compare.events import DropEvents

Regimes = NDArray[np.int64]


class Regime(IntEnum):
    """Regime of the body: rest, air, entry, water, exit, contact."""

    rest = 0
    air = 1
    entry = 2
    water = 3
    exit = 4
    contact = 5


def regimes_of_drop(time: Floats, events: DropEvents, *, entering: float) -> Regimes:
    """Regimes of a drop from its events.

    Args:
        time: [s].
        events: of the drop.
        entering: time from first contact until the body is wet over its whole length [s].
    """
    out = np.full(time.shape, int(Regime.rest), dtype=np.int64)
    out[(time >= events.release) & (time < events.entry)] = Regime.air
    out[(time >= events.entry) & (time < events.entry + entering)] = Regime.entry
    out[(time >= events.entry + entering) & (time < events.catch)] = Regime.water
    if events.caught:
        out[(time >= events.catch) & (time < events.catch + 0.1)] = Regime.contact
    return out


def regimes_of_height(
    height: Floats, climb: Floats, *, water: float | None, reach: float
) -> Regimes:
    """Regimes of a log with measured height.

    Args:
        height: of the body origin, world z [m], shape (rows,); NaN is carried forward.
        climb: vertical speed [m/s], shape (rows,).
        water: mean surface height [m], None without water.
        reach: radius of the body about its origin [m].
    """
    out = np.full(height.shape, int(Regime.air), dtype=np.int64)
    if water is None:
        return out
    above = height - water
    out[above < -reach] = Regime.water
    cut = np.abs(above) <= reach
    out[cut & (climb <= 0.0)] = Regime.entry
    out[cut & (climb > 0.0)] = Regime.exit
    return out
