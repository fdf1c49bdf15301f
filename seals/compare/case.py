"""Part of a log for a comparison: times, channels, start state, and regimes read from the data.

Regimes are rest, air, entry, water, exit and contact.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.batch import TwinState
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


def start_names(joints: int) -> list[str]:
    """Return the names of the components of a start, in order.

    Example:
        >>> start_names(1)[-2:]
        ['joints_1', 'rates_1']
    """
    blocks = ("position", "attitude", "velocity", "spin")
    names = [f"{block}_{axis}" for block in blocks for axis in "xyz"]
    return names + [f"{block}_{k + 1}" for block in ("joints", "rates") for k in range(joints)]


@dataclass(frozen=True, kw_only=True)
class Start:
    """State at the first row, and its uncertainty.

    Args:
        state: batch of one.
        sigma: one standard deviation of its errors, see `TwinState.moved`, shape (12 + 2 J,); 0
            holds a component.
        source: in words.
    """

    state: TwinState
    sigma: Floats
    source: str

    @property
    def free(self) -> list[int]:
        """Components that may be estimated."""
        return [int(k) for k in np.flatnonzero(self.sigma > 0.0)]


@dataclass(frozen=True, kw_only=True)
class Case:
    """Part of a log that is predicted from one start state.

    Args:
        name: of the log or segment.
        held_out: whether it only judges.
        time: from the start [s], shape (rows,).
        clock: time of the first row in the log [s].
        measured: channel to samples, shape (rows, k); NaN where there is none.
        sigma: channel to noise, one per component, shape (k,).
        regime: of each row.
        start: state at the first row.
        speed: a number that names the operating point, for tables [m/s].
        notes: facts found on the way, in words.
        given: measured inputs of a course that is not simulated, by name.
    """

    name: str
    held_out: bool
    time: Floats
    clock: float
    measured: Mapping[str, Floats]
    sigma: Mapping[str, Floats]
    regime: Regimes
    start: Start
    speed: float = 0.0
    notes: list[str] = field(default_factory=list)
    given: dict[str, Floats] = field(default_factory=dict)
