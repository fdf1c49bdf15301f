"""Part of a log for a comparison: times, channels, start state, regimes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from seals.arrays import Floats
from seals.batch import TwinState
from seals.compare.regimes import Regimes


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
