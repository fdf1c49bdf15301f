"""Several logs of one vehicle as one log, whose runs are fitted together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from seals.errors import LogError
from seals.logs.log import Log

_OWN = ("initial_state",)
"""Facts that belong to a log's own runs, one entry each."""
_LABELS = ("name", "description", "notes", "date")
"""Facts that may differ between logs of one vehicle."""


def join_logs(logs: Log | Sequence[Log]) -> Log:
    """Return one log with the runs of all of them, in order; a single log is returned as it is.

    Args:
        logs: of one vehicle, with the same channels.

    Raises:
        LogError: there is none, their channels differ, or they state different vehicles,
            surroundings, sensors or tolerances.
    """
    every = [logs] if isinstance(logs, Log) else list(logs)
    if not every:
        raise LogError("no log is given.\nGive one log or several logs of one vehicle.")
    first = every[0]
    if len(every) == 1:
        return first
    for other in every[1:]:
        _compare(first, other)
    parts = [part for log in every for part in log.segments()]
    columns = {k: np.concatenate([p.columns[k] for p in parts]) for k in first.columns}
    segment = np.concatenate([np.full(p.rows, k, dtype=np.int64) for k, p in enumerate(parts)])
    own = {k: _listed(k, every) for k in _OWN if all(k in log.meta for log in every)}
    meta = {k: v for k, v in first.meta.items() if k not in _OWN} | own
    name = f"{first.name} and {len(every) - 1} more"
    return replace(first, name=name, columns=columns, segment=segment, meta=meta)


def _listed(key: str, logs: Sequence[Log]) -> list[Any]:
    """Entries of all runs, in order."""
    return [entry for log in logs for entry in list(log.meta[key])[: len(log.segments())]]


def _compare(first: Log, other: Log) -> None:
    """Raise where two logs cannot be fitted together."""
    if set(first.columns) != set(other.columns):
        lacking = sorted(set(first.columns) ^ set(other.columns))
        raise LogError(
            f"logs '{first.name}' and '{other.name}' have different columns: "
            f"{', '.join(lacking[:6])}.\nGive logs with the same channels."
        )
    keys = sorted((set(first.meta) | set(other.meta)) - {*_OWN, *_LABELS})
    differ = [k for k in keys if _plain(first.meta.get(k)) != _plain(other.meta.get(k))]
    if differ:
        raise LogError(
            f"logs '{first.name}' and '{other.name}' state different {', '.join(differ)}.\n"
            "Logs that are fitted together are of one vehicle with one set of sensors, tolerances "
            "and surroundings; diagnose the others on their own."
        )


def _plain(value: Any) -> Any:
    """Facts without what names them only."""
    if isinstance(value, Mapping):
        return {k: _plain(v) for k, v in value.items() if k not in _LABELS}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return value
