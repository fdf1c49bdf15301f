"""Check for interpolated samples: straight lines in all noisy channels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.logs.finding import Finding, Severity
from seals.logs.log import Log

_NOISY = ("angular_velocity", "specific_force")
_ROUNDED = 2.5
"""Second difference of a straight line after rounding, in steps of the rounding."""
_MOVED = 4.0
"""Motion of a drawn line within the shortest stretch, in steps of the rounding."""
_SHORTEST = 0.25
"""Straight stretch that counts [s]: a lost packet or two is no reason for words."""
_SHARE = 0.1
"""Share of the log in straight stretches from which a warning is due."""
_LONG = 1.0
"""Straight stretch from which the log is refused [s]: longer than any lost packet; what stands
there was never measured."""


def check_filled(log: Log) -> list[Finding]:
    """Return the finding about periods in which all inertial channels are straight lines."""
    names = [f"{stem}_{axis}" for stem in _NOISY for axis in "xyz"]
    columns = [log.columns[name] for name in names if name in log.columns]
    if len(columns) < 3 or log.rows < 50:
        return []
    straight = np.ones(log.rows, dtype=bool)
    for values in columns:
        straight &= _straight(values)
    # the same value throughout is a frozen sensor: another check's business
    runs = [run for run in _runs(straight) if _seconds(log, run) >= _SHORTEST]
    runs = [part for run in runs for part in _drawn(log, columns, run)]
    if not runs:
        return []
    longest = max(runs, key=lambda run: _seconds(log, run))
    total = sum(_seconds(log, run) for run in runs)
    span = float(log.time.max() - log.time.min())
    if _seconds(log, longest) < _LONG and total < _SHARE * span:
        return []
    refused = _seconds(log, longest) >= _LONG
    first, start = float(log.time.min()), float(log.time[longest[0]])
    text = (
        f"all inertial channels run in straight lines for {total:.3g} s in {len(runs)} "
        f"stretch(es), the longest {_seconds(log, longest):.3g} s: lost samples were filled in.\n"
        f"Keep what was measured: seals convert ... span=[{first:.4g},{start:.4g}]"
    )
    return [
        Finding(
            severity=Severity.REFUSE if refused else Severity.WARN,
            code="filled",
            channel="angular_velocity",
            message=text,
            count=len(runs),
            where=start,
        )
    ]


def _drawn(log: Log, columns: list[Floats], run: tuple[int, int]) -> list[tuple[int, int]]:
    """Return the parts of a run in which lines were drawn: they move, and keep to their chords.

    A smooth signal that is rounded coarsely has small second differences as well, at rest and in
    motion; but at rest it moves by little more than the rounding, and in motion it leaves the
    chord.
    """
    rows = max(8, round(_SHORTEST * (run[1] - run[0]) / max(_seconds(log, run), 1e-9)))
    quanta = [_quantum(values) for values in columns]
    drawn = np.zeros(log.rows, dtype=bool)
    for first in range(run[0], max(run[1] - rows, run[0]) + 1, rows):
        # what is left over at the end goes with the last piece
        last = run[1] if run[1] - first < 2 * rows else first + rows
        pieces = [values[first:last] for values in columns]
        share = np.linspace(0.0, 1.0, last - first)
        moved = [abs(piece[-1] - piece[0]) for piece in pieces]
        bowed = [np.max(np.abs(p - p[0] - share * (p[-1] - p[0]))) for p in pieces]
        moves = any(m > _MOVED * q for m, q in zip(moved, quanta, strict=True))
        keeps = all(b <= _ROUNDED * q for b, q in zip(bowed, quanta, strict=True))
        drawn[first:last] = moves and keeps
    return _runs(drawn)


def _seconds(log: Log, run: tuple[int, int]) -> float:
    return float(log.time[run[1] - 1] - log.time[run[0]])


def _quantum(values: Floats) -> float:
    """Smallest step between neighbours: that of the rounding, in a file that rounds."""
    steps = np.abs(np.diff(values))
    moving = steps[np.isfinite(steps) & (steps > 1e-9 * np.nanmax(np.abs(values), initial=1e-12))]
    return float(np.min(moving)) if moving.size else 0.0


def _straight(values: Floats) -> NDArray[np.bool_]:
    """Mask of rows with the second difference of a straight line, as rounded in the file."""
    quantum = _quantum(values)
    bend = np.abs(np.diff(values, 2))
    flat = np.zeros(values.size, dtype=bool)
    flat[1:-1] = bend <= _ROUNDED * quantum
    return flat


def _runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First row, and the row after the last, of each run of true rows."""
    edges = np.diff(np.concatenate([[0], mask.astype(np.int8), [0]]))
    return list(zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True))
