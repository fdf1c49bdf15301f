"""Scatter of healthy flights: what differs between sessions, and within one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from seals.arrays import Floats
from seals.sysid.healthy_flights.balance import Balance, DriveLayout


@dataclass(frozen=True, kw_only=True)
class Known:
    """What is known of the scatter of other vehicles.

    Args:
        share: standard deviation of a mode, as a share of the mean thrust of a drive.
        flights: that this knowledge is worth.
    """

    share: float
    flights: float


OTHER_SESSIONS = Known(share=0.02, flights=2.0)
"""From session to session: root mean square of 12 healthy flights of three states of two small
quadrotors (CrazyPAD), of 0.2 to 5 %; what differs so much from one to another is worth little."""
OTHER_TURNS = Known(share=0.008, flights=4.0)
"""Between two legs of a flight, of the same flights: 0.6 to 0.9 %, and so worth more."""
_ORDER = ("thrust", "roll", "pitch", "yaw", "surge", "sway")
_ROWS = (2, 3, 4, 5, 0, 1)
"""Rows of the wrench in this order."""
_INDEPENDENT = 1e-6


@dataclass(frozen=True, kw_only=True)
class Modes:
    """Directions among the thrusts by which drives act on a vehicle.

    Args:
        names: of the modes.
        vectors: unit vectors, orthogonal, shape (modes, n).
    """

    names: tuple[str, ...]
    vectors: Floats

    @classmethod
    def of(cls, layout: DriveLayout) -> Modes:
        """Return thrust, roll, pitch, yaw, surge and sway if the drives distinguish them."""
        names, vectors = [], list[Floats]()
        for name, row in zip(_ORDER, _ROWS, strict=True):
            mode = layout.wrench[row] / max(float(np.linalg.norm(layout.wrench[row])), 1e-12)
            for other in vectors:
                mode = mode - (mode @ other) * other
            size = float(np.linalg.norm(mode))
            if size > _INDEPENDENT:
                names.append(name)
                vectors.append(mode / size)
        return cls(names=tuple(names), vectors=np.array(vectors))


@dataclass(frozen=True, kw_only=True)
class Scatter:
    """Student's t of a further healthy flight in each mode.

    Args:
        mean: of the thrusts [N], shape (n,).
        variance: of a further flight by mode [N^2], shape (modes,).
        degrees: of freedom of these variances, shape (modes,).
        sessions: number of healthy sessions.
    """

    mean: Floats
    variance: Floats
    degrees: Floats
    sessions: int

    def improbable(self, change: Floats) -> float:
        """Return the probability that some mode of a healthy flight is as far off, at most one.

        Args:
            change: from the mean by mode, shape (modes,).
        """
        tails = 2.0 * student.sf(np.abs(change) / np.sqrt(self.variance), self.degrees)
        return min(1.0, float(np.min(tails)) * change.size)


def scatter_of(
    modes: Modes,
    flights: Sequence[Balance],
    values: Sequence[Floats],
    known: Known = OTHER_SESSIONS,
) -> Scatter:
    """Return the scatter of healthy flights with their sessions as a random effect.

    Equation:
        A further flight is one of a further session: s^2 (1 + 1 / S) with s^2 the variance of the
        means of S sessions, plus (1 - 1 / m) w^2 with w^2 the variance within sessions of m flights
        each. What is known of other vehicles counts as some more sessions. Roll and pitch share one
        variance, for a battery or a deck shifts either way.

    Args:
        modes: of the drives.
        flights: healthy ones, one at least.
        values: thrusts of each [N], shape (n,).
        known: of other vehicles.
    """
    groups: dict[int, list[Floats]] = {}
    for flight, value in zip(flights, values, strict=True):
        groups.setdefault(flight.session, []).append(np.asarray(value))
    means = np.stack([np.mean(group, axis=0) for group in groups.values()])
    mean = means.mean(axis=0)
    count, size = len(means), len(values) / len(means)
    level = known.share * float(np.mean(np.abs(np.mean([f.mean for f in flights], axis=0))))
    weight = count - 1.0 + known.flights
    between = _squares(modes, means - mean) + known.flights * level**2
    inside = [v - np.mean(g, axis=0) for g in groups.values() for v in g]
    free = len(values) - count
    within = _squares(modes, np.array(inside)) / free if free else np.zeros(len(modes.names))
    degrees = np.full(len(modes.names), weight)
    degrees[_shared(modes)] *= 2.0
    return Scatter(
        mean=mean,
        variance=between / weight * (1.0 + 1.0 / count) + (1.0 - 1.0 / size) * within,
        degrees=degrees,
        sessions=count,
    )


def _squares(modes: Modes, rows: Floats) -> Floats:
    """Sums of squares by mode; roll and pitch share theirs."""
    squares = ((rows @ modes.vectors.T) ** 2).sum(axis=0)
    shared = _shared(modes)
    if shared:
        squares[shared] = squares[shared].mean()
    return np.asarray(squares)


def _shared(modes: Modes) -> list[int]:
    both = [k for k, name in enumerate(modes.names) if name in ("roll", "pitch")]
    return both if len(both) == 2 else []
