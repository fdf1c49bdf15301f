"""Detect release, water entry and catch of a drop from the accelerometer alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats, true_spans
from seals.errors import LogError

FREE = 0.25
"""Share of g below which the smoothed specific force counts as free fall."""
SMOOTHING = 0.004
"""Width of the running median that decides on free fall [s]."""
SHORTEST = 0.08
"""Shortest free fall looked for [s]."""
LONGEST = 3.0
"""Longest free fall looked for [s]: about 44 m."""


@dataclass(frozen=True, kw_only=True)
class DropEvents:
    """Times of a drop.

    Args:
        release: start of the free fall [s].
        entry: first contact with the water [s].
        catch: start of the strongest shock after the entry [s], or the last sample when nothing
            stops the body.
        caught: whether that shock stands out from the water's forces.
        offset: mean specific force along the fall axis in free fall, bias and air drag [m/s^2].
        fall: duration of the free fall [s].
        spread: uncertainty of release and entry, one standard deviation [s].
    """

    release: float
    entry: float
    catch: float
    caught: bool
    offset: float
    fall: float
    spread: float


def find_drop(time: Floats, specific_force: Floats, *, gravity: float = 9.81) -> DropEvents:
    """Find the events of one drop.

    The free fall is the longest stretch in which the specific force is near zero and which starts
    at rest; the entry is its end; the catch is the strongest shock after it. A drop may be held in
    the hand, tossed, or bounce at the bottom.

    Args:
        time: [s], shape (rows,).
        specific_force: body axes, shape (rows, 3) or (rows,) along the fall axis [m/s^2].
        gravity: [m/s^2].

    Raises:
        LogError: there is no free fall that starts at rest.
    """
    from scipy.ndimage import median_filter

    force = specific_force if specific_force.ndim == 2 else specific_force[:, None]
    size = np.sqrt(np.nansum(force**2, axis=1))
    step = float(np.median(np.diff(time)))
    width = max(3, round(SMOOTHING / step) | 1)
    calm = median_filter(size, size=width, mode="nearest") < FREE * gravity
    # first and last index of every stretch of True
    runs = [(first, end - 1) for first, end in true_spans(calm)]
    found = [(a, b) for a, b in runs if SHORTEST <= time[b] - time[a] <= LONGEST]
    found = [run for run in found if _rest_before(size, run[0], step, gravity)]
    if not found:
        raise LogError(
            "no free fall from rest was found in the specific force.\n"
            f"Expected: about {gravity:.2f} m/s^2 at rest, "
            f"then at least {SHORTEST} s below {FREE * gravity:.1f} m/s^2."
        )
    first, last = max(found, key=lambda run: run[1] - run[0])
    axis = int(
        np.argmax(np.abs(np.nanmedian(force[max(0, first - int(0.5 / step)) : first], axis=0)))
    )
    inner = slice(first + (last - first) // 5, last - (last - first) // 10)
    offset = float(np.median(force[inner, axis]))
    noise = 1.4826 * float(np.median(np.abs(force[inner, axis] - offset)))
    bound = max(6.0 * noise, 0.015 * gravity)
    # last sample before the fall at which the body was still held
    before = force[: first + (last - first) // 4, axis] - offset
    held = np.flatnonzero(np.abs(before) > 0.5 * gravity)
    release = int(held[-1]) + 1 if held.size else first
    entry = _rise(force[:, axis] - offset, last, bound)
    after = slice(entry, len(time))
    peak = entry + int(np.argmax(size[after]))
    # the onset of the strongest shock: the last row below a tenth of its peak
    if peak <= entry:
        start = entry
    else:
        below = np.flatnonzero(size[entry:peak] < 0.1 * size[peak])
        start = entry + int(below[-1]) if below.size else peak
    water = float(np.percentile(size[entry : max(start, entry + 2)], 95))
    return DropEvents(
        release=float(time[release]) - 0.5 * step,
        # contact lies between the last calm sample and the first risen one
        entry=float(time[entry]) - 0.5 * step,
        catch=float(time[start]),
        caught=bool(size[peak] > 2.0 * max(water, gravity)),
        offset=offset,
        fall=float(time[entry] - time[release]),
        spread=0.5 * step,
    )


def _rest_before(size: Floats, start: int, step: float, gravity: float) -> bool:
    """Return whether the body hung still, near 1 g, for a while before ``start``."""
    rest = size[max(0, start - int(0.3 / step)) : max(0, start - int(0.03 / step))]
    return rest.size > 10 and abs(float(np.median(rest)) - gravity) < 0.15 * gravity


def _rise(force: Floats, last: int, bound: float) -> int:
    """First sample of the lasting rise that ends free fall, searched backwards from its end."""
    k = last
    while k > 0 and abs(force[k]) > bound:
        k -= 1
    return k + 1
