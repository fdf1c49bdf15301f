"""Readings of a table that are none: repeated until the next one comes, held, or leaping away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats, true_spans
from seals.logs.channels import CHANNELS, columns_of
from seals.logs.log import Log
from seals.logs.resample import one_sign

_VECTORS = ("position", "orientation", "velocity", "angular_velocity", "specific_force")
"""Channels of three components or four: by chance all of them hardly ever repeat together."""
_POSE = ("position", "orientation")
_REPEATED, _REGULAR = 0.4, 0.85
"""Least share of repeated rows, and of readings repeated a common number of times, plus or minus
one: a slower sensor on the rows of the log. A coarse one repeats as often as it happens to."""
_LOST, _JUMP = 10, 3.0
"""Rows for which a pose was held where it failed, and the jump behind them in usual steps."""
_FEWEST, _BESIDE = 50, 3
"""Readings of a pose that tell what is usual, and neighbours on either side of one."""
_LEAP, _FAR, _RARE = 0.03, 6.0, 0.04
"""Least leap [m, half a rad], the same over what 95 % stay below, and the largest share of rows."""


def without_false_readings(log: Log) -> tuple[Log, list[str]]:
    """Return a log in which rows without a reading of their own have none, and remarks.

    A table repeats a slower sensor's reading until the next one comes, and motion capture holds its
    last value where it loses the markers, or takes others for them in a row or two: a fit would see
    a pose that stands and jumps. Runs of SEALS do nothing of this, and a vehicle at rest may repeat
    itself in all channels.

    Args:
        log: with any times, rising in each segment.

    Example:
        >>> from seals.logs.log import Log
        >>> rng, rows = np.random.default_rng(0), np.arange(40)
        >>> place = {f"position_{a}": np.sin(rows // 4 + k) for k, a in enumerate("xyz")}
        >>> spin = {f"angular_velocity_{a}": rng.standard_normal(40) for a in "xyz"}
        >>> log = Log(columns={"t": 0.01 * rows, **place, **spin}, meta={}, name="x")
        >>> thin, said = without_false_readings(log)
        >>> said
        ['position repeats each reading in 4 rows: one every 0.04 s is kept']
        >>> int(np.isfinite(thin.columns["position_x"]).sum())
        10
    """
    if "simulated" in log.meta:
        return log, []
    columns, said = dict(log.columns), list[str]()
    # rows in which some other reading changes: where none does, the vehicle rests or all stop
    moving = np.zeros(log.rows, dtype=bool)
    for vector in (s for s in _VECTORS if log.has(s)):
        moving |= ~_repeats(log, vector)
    for stem in (s for s in _VECTORS if log.has(s) and not CHANNELS[s].command):
        same = _repeats(log, stem) & moving
        begins = np.flatnonzero(~same)
        lengths = np.diff(np.append(begins, same.size)).astype(float)
        usual = float(np.median(lengths)) if lengths.size else 1.0
        regular = np.mean(np.abs(lengths - usual) <= 1.0) if lengths.size else 0.0
        if usual >= 2.0 and np.mean(same) >= _REPEATED and regular >= _REGULAR:
            every = usual * float(np.median(np.diff(log.time)))
            said.append(
                f"{stem} repeats each reading in {usual:.0f} rows: one every {every:.3g} s is kept"
            )
        elif stem in _POSE and usual < 2.0:
            same = _failures(log, stem, same)
            for first, end in true_spans(same):
                begin = float(log.time[max(first - 1, 0)])
                seconds = float(log.time[end - 1]) - begin
                said.append(f"{stem} was held for {seconds:.3g} s from t = {begin:.4g} s: left out")
        else:
            continue
        _without(columns, stem, same)
    for stem in (s for s in _POSE if log.has(s)):
        false = _leaps(log, stem)
        if false.any():
            said.append(f"{stem} jumps away and back in {false.sum()} rows: left out")
        _without(columns, stem, false)
    return replace(log, columns=columns), said


def _without(columns: dict[str, Floats], stem: str, rows: NDArray[np.bool_]) -> None:
    """Take the samples of some rows from the components of a channel that the log has."""
    for name in columns_of(stem, columns):
        if name in columns:
            columns[name] = np.where(rows, np.nan, columns[name])


def _leaps(log: Log, stem: str) -> NDArray[np.bool_]:
    """Rows at which a pose is far from the median of its neighbours, as it is nowhere else.

    A step from which it does not come back is none.
    """
    values = log.channel(stem)
    values = one_sign(values) if stem == "orientation" else values
    out = np.zeros(log.rows, dtype=bool)
    there = np.flatnonzero(np.isfinite(values).all(axis=1))
    if there.size < _FEWEST:
        return out
    seen = values[there]
    # beyond the ends the motion goes on as it came
    padded = np.pad(seen, ((_BESIDE, _BESIDE), (0, 0)), mode="reflect", reflect_type="odd")
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * _BESIDE + 1, axis=0)
    away = np.linalg.norm(seen - np.median(around, axis=-1), axis=1)
    # a bounce turns back within as many steps as there are neighbours
    steps = np.linalg.norm(np.diff(seen, axis=0), axis=1)
    usual = float(np.median(steps[steps > 0.0])) if steps.any() else 0.0
    far = away > max(_LEAP, _FAR * float(np.quantile(away, 0.95)), _FAR * usual)
    if np.mean(far) < _RARE:
        out[there[far]] = True
    return out


def _repeats(log: Log, stem: str) -> NDArray[np.bool_]:
    """Rows that repeat the row before in every component; never the first of a segment."""
    values = log.channel(stem)
    same = np.all(values[1:] == values[:-1], axis=1) & (np.diff(log.segment) == 0)
    return np.append(False, same)


def _failures(log: Log, stem: str, same: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Repeated rows of long holds behind which the reading jumps, as a pose does that came back."""
    values = log.channel(stem)
    steps = np.append(0.0, np.linalg.norm(np.diff(values, axis=0), axis=1))
    usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    begins = np.flatnonzero(~same)
    ends = np.append(begins[1:], same.size)
    out = np.zeros_like(same)
    for first, last in zip(begins, ends, strict=True):
        back = steps[last] > _JUMP * usual if last < same.size else True
        if last - first >= _LOST and back:
            out[first + 1 : last] = True
    return out
