"""Activity of an effect: the times in each log between which it acts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.schema import plain
from seals.sysid.data.samples import Samples

ACTIVE = "|active"
"""Ending of the keys that hold an effect's parameters while it acts."""


@dataclass(frozen=True, kw_only=True)
class Moment:
    """Time at which an effect begins or ends, on the clock of its log [s].

    Args:
        value: estimate.
        low90: lower end of its 90 % interval.
        high90: upper end of it.
    """

    value: float
    low90: float
    high90: float


@dataclass(frozen=True, kw_only=True)
class Span:
    """Part of one log in which an effect acts.

    Args:
        log: number of the log, in the order in which they were given.
        start: where it begins; None for the first row.
        end: where it ends; None for the last row.
    """

    log: int
    start: Moment | None = None
    end: Moment | None = None


@dataclass(frozen=True, kw_only=True)
class Activity:
    """Activity of an effect: the logs, and the time span of each, in which it acts.

    Args:
        spans: one for each log in which it acts, in order.
        occam_factor: evidence that these times cost, see `DecisionPolicy.activity`.
        growing: the effect grows along each log, from nothing to its size at the end.
    """

    spans: tuple[Span, ...]
    occam_factor: float = 0.0
    growing: bool = False

    def weights(self, samples: Samples, *, over_steps: bool = False) -> Floats:
        """Weight of the effect in every row: 1 where it acts, 0 where it does not, shape (T,).

        Args:
            samples: of all logs.
            over_steps: the share of the step after each row, in place of the moment of the row.
        """
        out = np.zeros(samples.rows)
        logs = log_rows(samples)
        for span in self.spans:
            rows = slice(*logs[span.log])
            time = samples.time[rows]
            begun = _passed(span.start, time, samples.step, over_steps=over_steps, open_is=1.0)
            ended = _passed(span.end, time, samples.step, over_steps=over_steps, open_is=0.0)
            out[rows] = np.maximum(begun - ended, 0.0)
            if self.growing:
                out[rows] *= (time - time[0]) / max(float(np.ptp(time)), samples.step)
        return out

    def complement(self, logs: int) -> Activity | None:
        """Return the activity at all other times; None where that is two parts of one log.

        Args:
            logs: number of all logs.
        """
        known = {span.log: span for span in self.spans}
        spans = []
        for k in range(logs):
            span = known.get(k)
            if span is None:
                spans.append(Span(log=k))
            elif span.start is not None and span.end is not None:
                return None
            elif span.start is not None or span.end is not None:
                spans.append(Span(log=k, start=span.end, end=span.start))
        return replace(self, spans=tuple(spans))

    def to_list(self, names: Sequence[str]) -> list[dict[str, Any]]:
        """Return the activity in the form of ``diagnosis.json``."""
        return [{**plain(span), "log": names[span.log]} for span in self.spans]


def _passed(
    moment: Moment | None, time: Floats, step: float, *, over_steps: bool, open_is: float
) -> Floats:
    """Step function: 1 after a moment, 0 before; ``over_steps``: its mean over each step."""
    if moment is None:
        return np.full(len(time), open_is)
    late = (time - moment.value) / step
    return np.clip(late + 1.0, 0.0, 1.0) if over_steps else (late >= 0.0).astype(float)


def log_rows(samples: Samples) -> tuple[tuple[int, int], ...]:
    """First row of each log, and the row after its last."""
    return tuple((s.first, s.last) for s in samples.logs) or ((0, samples.rows),)


def active_words(entries: Sequence[Mapping[str, Any]], logs: Sequence[str]) -> str:
    """Describe in words when an effect acts.

    Args:
        entries: as in ``diagnosis.json``.
        logs: names of all logs.

    Example:
        >>> moment = {"value": 9.0, "low90": 8.98, "high90": 9.02}
        >>> active_words([{"log": "a", "start": moment, "end": None}], ["a"])
        'from 9.00 s'
        >>> active_words([{"log": "a", "start": None, "end": moment}], ["a", "b"])
        'a: until 9.00 s; b: not at all'
    """
    by_log = {}
    for entry in entries:
        start, end = entry["start"], entry["end"]
        first = "" if start is None else f"from {start['value']:.2f} s"
        last = "" if end is None else f"until {end['value']:.2f} s"
        by_log[str(entry["log"])] = " ".join(filter(None, (first, last))) or "throughout"
    if len(logs) == 1:
        return by_log.get(logs[0], "not at all")
    return "; ".join(f"{name}: {by_log.get(name, 'not at all')}" for name in logs)
