"""Sensors that repeat one reading while the vehicle moves."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError
from seals.logs.log import Log
from seals.sysid.data.samples import Samples
from seals.sysid.data.vehicle import Vehicle

_STILL = 1.0
"""Time for which a reading with noise never repeats itself [s]."""
_FEWEST = 20
"""Readings in that time at least."""
_MOVED = 10.0
"""Range of a channel of the pose, in its stated noise, from which the vehicle moved."""
_POSE = ("position", "orientation")
_INERTIAL = ("angular_velocity", "specific_force")


def refuse_frozen(log: Log, samples: Samples, vehicle: Vehicle) -> None:
    """Refuse a log in which an inertial sensor stands still while the pose moves.

    A fit would call the frozen reading a bias. Runs of SEALS may be without noise and pass.

    Args:
        log: as read.
        samples: of the log.
        vehicle: stated noise.

    Raises:
        LogError: a component repeats one value for a second or more while the vehicle moves.
    """
    if "simulated" in log.meta:
        return
    seen = samples.channels
    pose = [(seen[n], vehicle.sigma.get(n, 0.0)) for n in _POSE if n in seen]
    for name in (n for n in _INERTIAL if n in seen):
        for axis, values in enumerate(seen[name].T):
            for first, last in _repeats(values):
                seconds = float(samples.time[last] - samples.time[first])
                moves = any(_moves(c[first : last + 1], sigma) for c, sigma in pose)
                if seconds >= _STILL and moves:
                    raise LogError(
                        f"{name}_{'xyz'[axis]} reads {values[first]:.6g} without change for "
                        f"{seconds:.1f} s from t = {samples.time[first]:.4g} s on, while the pose "
                        "moves: the sensor is frozen.\nCut that time out, or remove the channel."
                    )


def _repeats(values: Floats) -> list[tuple[int, int]]:
    """Return first and last row of every stretch in which one value repeats; NaN is no reading."""
    there = np.flatnonzero(np.isfinite(values))
    if len(there) < _FEWEST:
        return []
    cuts = np.flatnonzero(np.diff(values[there]) != 0.0)
    begins, ends = np.append(0, cuts + 1), np.append(cuts, len(there) - 1)
    long = ends - begins + 1 >= _FEWEST
    return [(int(there[a]), int(there[b])) for a, b in zip(begins[long], ends[long], strict=True)]


def _moves(values: Floats, sigma: float) -> bool:
    seen = values[np.isfinite(values).all(axis=1)]
    return len(seen) > 1 and sigma > 0.0 and bool(np.ptp(seen, axis=0).max() > _MOVED * sigma)
