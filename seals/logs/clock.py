"""Detection of the unit of time stamps: ns, us or ms in place of seconds."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.logs.channels import stem_of

CLOCK = "clock"
"""Key of ``meta.yaml``: unit in which the stamps stood, and the first of them [s]."""
FACTORS: Mapping[str, float] = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3}
"""Seconds in one of each unit."""
_NAMED = re.compile(r"(?:_|\(|\[|\b)(ns|us|µs|ms)[)\]]?$|(nano|micro|milli)(?:sec|second)s?$")
_LONG = {"nano": "ns", "micro": "us", "milli": "ms", "µs": "us"}
# seconds since 1970 from the year 2000 to 2100
_CALENDAR = (9.4e8, 4.11e9)
# usual steps that only one unit explains: 2 Hz to 200 Hz in us, slower than 200 Hz in ns
_BY_STEP = (("us", 5e3, 5e5), ("ns", 5e6, 1e11))
_MILLI = (4.0, 5e2)
_FAST = ("specific_force", "angular_velocity", "rotor_speed")
"""Channels that nobody logs slower than every four seconds."""


def in_seconds(
    time: Floats, segment: NDArray[Any], *, named: str = "", channels: Iterable[str] = ()
) -> tuple[Floats, dict[str, Any]]:
    """Return stamps in seconds, and the detected unit; empty if they are seconds already.

    Converted stamps start at zero: as seconds since 1970 they would lose their last digits.

    Args:
        time: the stamps as they stand, shape (rows,).
        segment: number of the run each row belongs to, shape (rows,); empty for one run.
        named: name of their column, which may tell the unit.
        channels: names of the other columns.

    Example:
        >>> import numpy as np
        >>> stamps, clock = in_seconds(1.7e18 + 1e7 * np.arange(3), np.zeros(0))
        >>> stamps.round(6).tolist(), clock["unit"]
        ([0.0, 0.01, 0.02], 'ns')
    """
    unit = _unit(time, segment, named, channels)
    if not unit:
        return time, {}
    finite = time[np.isfinite(time)]
    start = float(finite[0])
    return (time - start) * FACTORS[unit], {"unit": unit, "start": start * FACTORS[unit]}


def tell(log: str, clock: Mapping[str, Any]) -> None:
    """Print on the error stream that stamps were converted."""
    if clock:
        print(f"log '{log}': {remark(clock)}", file=sys.stderr)


def remark(clock: Mapping[str, Any]) -> str:
    """Describe the detected unit in words.

    Example:
        >>> remark({"unit": "ms", "start": 2.5})
        'the time stamps are in ms and were converted to s; the first is 2.5 s.'
    """
    return f"the time stamps are in {clock['unit']} and were converted to s; the first is " + (
        f"{float(clock['start']):.10g} s."
    )


def guessed(step: float) -> str:
    """Return the units that would explain a typical step too long for seconds.

    Example:
        >>> guessed(1e7), guessed(1e6), guessed(20.0)
        ('ns', 'us or ns', 'ms')
    """
    for unit, low, high in _BY_STEP:
        if low <= step < high:
            return unit
    return "us or ns" if step >= _BY_STEP[0][1] else "ms or us" if step >= _MILLI[1] else "ms"


def _unit(time: Floats, segment: NDArray[Any], named: str, channels: Iterable[str]) -> str:
    # median of the steps forward in time, within runs
    steps = np.diff(time)
    if segment.size == time.size:
        steps = steps[np.diff(segment) == 0]
    rising = steps[np.isfinite(steps) & (steps > 0.0)]
    step = float(np.median(rising)) if rising.size else float("nan")
    if not step > 2.0:
        return ""
    stamp = float(np.nanmedian(time[np.isfinite(time)]))
    for unit, factor in FACTORS.items():
        if _CALENDAR[0] < stamp * factor < _CALENDAR[1] and step * factor < 1e4:
            return unit
    found = _NAMED.search(named.strip().lower())
    if found:
        word = str(found[1] or found[2])
        return _LONG.get(word, word)
    for unit, low, high in _BY_STEP:
        if low <= step < high:
            return unit
    fast = any(stem_of(name) in _FAST for name in channels)
    return "ms" if fast and _MILLI[0] <= step < _MILLI[1] else ""
