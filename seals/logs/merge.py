"""Merge of sample streams with different time stamps into one table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import LogError
from seals.logs.channels import CHANNELS, stem_of

MOST_CELLS = 20_000_000
"""Largest merged table, rows times columns."""
_JUMP = 1_000_000
"""A clock that falls back by more than this was set anew [us]."""
_LONGEST = 100 * 86_400 * 1_000_000
"""Longest log [us]: stamps farther apart belong to two clocks."""


@dataclass(frozen=True, kw_only=True)
class Stream:
    """Samples that share their times: one topic of a recording.

    Args:
        name: of the topic, for refusals.
        stamps: time of each sample [us] of the recording's clock, shape (samples,).
        columns: column of the log -> its values in SI units, each of shape (samples,).
    """

    name: str
    stamps: NDArray[np.int64]
    columns: dict[str, Floats]


def merge(streams: Sequence[Stream], *, where: str) -> tuple[dict[str, Floats], int]:
    """Return one table over the union of all time stamps, and its start time.

    A measured column is NaN where its topic has no sample; a command is held until the next one.

    Args:
        streams: the topics; no two may fill one column.
        where: the file, for refusals.

    Returns:
        Columns with the time ``t`` [s] from the first sample on, and the first stamp [us].

    Raises:
        LogError: there is nothing to merge, or the stamps cannot be those of one clock.

    Example:
        >>> fast = Stream(name="a", stamps=np.array([5, 7, 9]), columns={"depth": np.arange(3.0)})
        >>> slow = Stream(name="b", stamps=np.array([6, 9]), columns={"range": np.array([4.0, 8])})
        >>> columns, start = merge([fast, slow], where="x")
        >>> start, columns["depth"].tolist(), columns["range"].tolist()
        (5, [0.0, nan, 1.0, 2.0], [nan, 4.0, nan, 8.0])
    """
    full = [_sorted(stream, where) for stream in streams if stream.stamps.size and stream.columns]
    if not full:
        raise LogError(f"'{where}' contains no sample of a known channel.")
    owner: dict[str, str] = {}
    for one in full:
        for column in one.columns:
            if column in owner:
                raise LogError(
                    f"'{where}': '{owner[column]}' and '{one.name}' both give '{column}'.\n"
                    f"Choose one: topics=['{one.name}', ...]"
                )
            owner[column] = one.name
    stamps = np.unique(np.concatenate([stream.stamps for stream in full]))
    width = 1 + sum(len(stream.columns) for stream in full)
    if stamps.size * width > MOST_CELLS:
        raise LogError(
            f"'{where}' makes a table of {stamps.size:,} rows and {width} columns; the limit is "
            f"{MOST_CELLS:,} values.\nUse fewer topics (topics=[...]), or shorten the log."
        )
    if stamps[-1] - stamps[0] > _LONGEST:
        raise LogError(
            f"'{where}' has stamps {(stamps[-1] - stamps[0]) / 8.64e10:.0f} days apart.\n"
            "Two clocks? Choose the topics of one clock, or clock=record if the reader has this "
            "option."
        )
    table = {"t": (stamps - stamps[0]) * 1e-6}
    for stream in full:
        rows = np.searchsorted(stamps, stream.stamps)
        for name, values in stream.columns.items():
            table[name] = _spread(name, values, rows, stamps.size)
    return table, int(stamps[0])


def _spread(name: str, values: Floats, rows: NDArray[np.int64], count: int) -> Floats:
    known = CHANNELS.get(stem_of(name))
    if known is None or not known.command:
        spread = np.full(count, np.nan)
        spread[rows] = values
        return spread
    last = np.searchsorted(rows, np.arange(count), side="right") - 1
    return np.where(last >= 0, values[np.maximum(last, 0)], np.nan)


def _sorted(stream: Stream, where: str) -> Stream:
    """Return a stream sorted by time; of samples with equal stamps the last one is kept."""
    steps = np.diff(stream.stamps)
    if steps.size and steps.min() < -_JUMP:
        raise LogError(
            f"'{where}': the clock of '{stream.name}' falls back by {-steps.min() * 1e-6:.3g} s.\n"
            "It was reset during the recording: split the log there."
        )
    order = np.argsort(stream.stamps, kind="stable")
    last = np.append(np.diff(stream.stamps[order]) > 0, True)
    kept = order[last]
    columns = {name: values[kept] for name, values in stream.columns.items()}
    return Stream(name=stream.name, stamps=stream.stamps[kept], columns=columns)
