"""Resampling of a log to even time steps, with a delay correction per channel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, suggestion
from seals.logs.channels import CHANNELS, columns_of, stem_of
from seals.logs.log import Log
from seals.logs.merge import MOST_CELLS

_BRIDGED = 1.6
"""Longest distance of two samples between which a value is interpolated, in usual steps."""
_DENSE = 1.5
"""Samples per row from which their mean is taken in place of the value at the row's time."""
_ROUNDING = 2e-6
"""Difference of times that are one row [s]: stamps are written in microseconds."""
FASTEST = 10_000.0
"""Largest rate of rows [Hz]."""


def even_rows(log: Log, rate: float, late: Mapping[str, float] | None = None) -> Log:
    """Return a log whose rows are evenly spaced.

    Measured channels are interpolated between neighbouring samples and averaged where they are
    faster than the rows. A slower channel has a value in the rows nearest to its samples only, NaN
    in the others; nothing is interpolated across gaps. Commands are held.

    Args:
        log: with any times, rising in each segment.
        rate: of the rows [Hz]; zero keeps the log's own times, for a shift alone.
        late: channel -> time by which its stamps are late [s]: taken off before.

    Raises:
        LogError: the rate is not allowed, or a channel is not in the log.
    """
    late = dict(late or {})
    for stem in late:
        if not log.has(stem):
            raise LogError(f"late: '{stem}' is not in the log.\n{suggestion(stem, log.channels())}")
    if not 0.0 <= rate <= FASTEST:
        raise LogError(f"rate={rate:g} is not allowed.\nAllowed: above 0 to {FASTEST:g} Hz")
    if not rate and not late:
        return log
    parts = [_part(part, rate, late) for part in log.segments()]
    columns = {key: np.concatenate([part.columns[key] for part in parts]) for key in log.columns}
    segment = np.concatenate([part.segment for part in parts])
    return replace(log, columns=columns, segment=segment)


def _part(log: Log, rate: float, late: Mapping[str, float]) -> Log:
    first, last = float(log.time.min()), float(log.time.max())
    rows = int((last - first) * rate + 1e-6) + 1
    if rate and rows * len(log.columns) > MOST_CELLS:
        raise LogError(f"rate={rate:g} makes {rows:,} rows.\nUse a lower rate, or shorten the log.")
    time = first + np.arange(rows) / rate if rate else log.time
    columns: dict[str, Floats] = {"t": time}
    for stem in log.channels():
        values, shift = log.channel(stem), late.get(stem, 0.0)
        known = CHANNELS.get(stem)
        names = [key for key in log.columns if key != "t" and stem_of(key) == stem]
        order = columns_of(stem, log.columns)
        spread = _held if known is not None and known.command else _sampled
        if stem.endswith("orientation"):
            values = one_sign(values)
        even = spread(log.time - shift, values, time)
        if stem.endswith("orientation"):
            even = even / np.linalg.norm(even, axis=1, keepdims=True)
        columns |= {name: even[:, order.index(name)] for name in names}
    number = int(log.segment[0])
    return replace(log, columns=columns, segment=np.full(time.size, number, dtype=np.int64))


def one_sign(q: Floats) -> Floats:
    """Return quaternions with a sign that does not flip along the rows, shape (T, 4)."""
    good = np.flatnonzero(np.isfinite(q).all(axis=1))
    out: Floats = q.copy()
    if good.size:
        dots = np.sum(q[good[1:]] * q[good[:-1]], axis=1)
        out[good] *= np.concatenate([[1.0], np.cumprod(np.where(dots < 0.0, -1.0, 1.0))])[:, None]
    return out


def _held(stamps: Floats, values: Floats, time: Floats) -> Floats:
    """Commands at the rows: the last one sent in each column, NaN before the first."""
    out = np.full((time.size, values.shape[1]), np.nan)
    for k in range(values.shape[1]):
        good = np.isfinite(values[:, k])
        # times that differ by rounding, to a microsecond or so, are one row
        last = np.searchsorted(stamps[good], time + _ROUNDING, side="right") - 1
        some = last >= 0
        out[some, k] = values[good, k][last[some]]
    return out


def _sampled(stamps: Floats, values: Floats, time: Floats) -> Floats:
    """Interpolate measurements at the rows; columns with the same sample times are grouped."""
    out = np.full((time.size, values.shape[1]), np.nan)
    masks = np.isfinite(values)
    for mask in {m.tobytes(): m for m in masks.T if m.sum() > 1}.values():
        own = [k for k in range(values.shape[1]) if np.array_equal(masks[:, k], mask)]
        out[:, own] = _interpolated(stamps[mask], values[mask][:, own], time)
    return out


def _interpolated(stamps: Floats, values: Floats, time: Floats) -> Floats:
    usual = float(np.median(np.diff(stamps)))
    step = float(np.median(np.diff(time))) if time.size > 1 else 1.0
    if usual * _DENSE < step:
        width = max(1, round(step / usual))
        kernel = np.ones(width) / width
        mean = np.stack([np.convolve(v, kernel, mode="valid") for v in values.T], axis=1)
        centre = np.convolve(stamps, kernel, mode="valid")
        stamps, values = centre, mean
    after = np.clip(np.searchsorted(stamps, time), 1, stamps.size - 1)
    near = np.minimum(np.abs(time - stamps[after - 1]), np.abs(time - stamps[after]))
    whole = stamps[after] - stamps[after - 1] < _BRIDGED * max(usual, step)
    # a slow channel stands in the row nearest to its sample
    there = (near <= 0.5 * step + 1e-9) & (whole | (near <= 1e-9))
    inside = (time >= stamps[0] - 1e-9) & (time <= stamps[-1] + 1e-9)
    even = np.stack([np.interp(time, stamps, v) for v in values.T], axis=1)
    return np.where((there & inside)[:, None], even, np.nan)
