"""Selection of the parts of a log without contact, since contact forces are not modelled."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import true_spans
from seals.errors import LogError
from seals.logs.log import Log

LEAST = 2.0
"""Shortest stretch that is used [s]: a window to fit, and one to hold out."""


class _Stretch(NamedTuple):
    """Rows without contact in one run: the log's rows, begin and end [s]."""

    rows: NDArray[np.int64]
    begin: float
    end: float


def contact_free(log: Log) -> Log:
    """Return the parts of a log without contact, each as a separate run.

    Contacts are those that the metadata state: ``contacts``, begin and end of each [s]. A log that
    states none is returned as it is.

    Raises:
        LogError: no stretch without contact is long enough.
    """
    spans = _spans(log)
    if not spans:
        return log
    every = [s for number in np.unique(log.segment) for s in _stretches(log, spans, int(number))]
    used = [s for s in every if s.end - s.begin >= LEAST]
    if not used:
        longest = max((s.end - s.begin for s in every), default=0.0)
        raise LogError(
            f"log '{log.name}': the robot is in contact with ground or objects, and never without "
            f"contact for {LEAST:g} s (longest {longest:.2g} s).\n"
            f"Contact forces are not modelled: give a log with {LEAST:g} s or more without "
            "contact; "
            "see docs/limits.md."
        )
    named = ", ".join(f"{s.begin:.2f} to {s.end:.2f} s" for s in used)
    print(f"log '{log.name}': only rows without contact are used: {named}.", file=sys.stderr)
    segment = np.concatenate([np.full(s.rows.size, k) for k, s in enumerate(used)])
    meta = {key: value for key, value in log.meta.items() if key != "contacts"}
    return replace(log.select(np.concatenate([s.rows for s in used])), segment=segment, meta=meta)


def _spans(log: Log) -> list[tuple[float, float]]:
    """Begin and end of every contact [s]."""
    given: Any = log.meta.get("contacts") or []
    try:
        return [(float(begin), float(end)) for begin, end in given]
    except (TypeError, ValueError) as error:
        raise LogError(
            f"log '{log.name}': contacts={given!r:.80} are not beginnings and ends.\n"
            "Allowed: pairs of times in seconds, contacts: [[0.0, 1.2], [7.5, 8.0]]"
        ) from error


def _stretches(log: Log, spans: Sequence[tuple[float, float]], number: int) -> list[_Stretch]:
    """Stretches without contact of one run.

    Without a measured pose only the first is of use: the state at its begin is what the log says.
    """
    rows = np.flatnonzero(log.segment == number)
    time = log.time[rows]
    free = np.ones(rows.size, dtype=bool)
    for begin, end in spans:
        free &= (time < begin) | (time > end)
    spans_free = true_spans(free)
    found = [_Stretch(rows[a:b], float(time[a]), float(time[b - 1])) for a, b in spans_free]
    return found if log.has("position") else [s for s in found if s.rows[0] == rows[0]]
