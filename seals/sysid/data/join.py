"""Concatenation of several logs of one vehicle for a common fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from seals.errors import LogError
from seals.logs.log import Log
from seals.logs.run_folder import ROBOT
from seals.sysid.data.contact import contact_free
from seals.sysid.data.decimation import decimated, longest_step
from seals.sysid.data.known_sea import GAP, sea_laws
from seals.untrusted_io import read_bytes

_OWN = ("initial_state",)
"""Facts that belong to a log's own runs, one entry each."""
_LABELS = (
    "name", "description", "notes", "date", "recording", "motor_command", "motors", "clock",
    "guide", "simulated",
)  # fmt: skip
"""Facts that may differ between logs of one vehicle."""


def join_logs(logs: Log | Sequence[Log]) -> Log:
    """Return one log with the runs of all of them, in order: without contact, fast ones thinned.

    What the logs know of their surroundings, figures of their sensors and the level of their gusts
    may differ: the entry ``logs`` of the metadata keeps those of each. A channel that one log lacks
    has no samples in its rows.

    Raises:
        LogError: there is none, or they state different vehicles, environments, sensors or
            tolerances.
    """
    every = [logs] if isinstance(logs, Log) else list(logs)
    if not every:
        raise LogError("no log is given.\nGive one log or several logs of one vehicle.")
    every = [contact_free(log) for log in every]
    rows = sum(log.rows for log in every)
    longest = min(longest_step(log) for log in every)
    every = [decimated(log, rows, longest=longest) for log in every]
    first = every[0]
    if len(every) == 1:
        return first
    for other in every[1:]:
        keys = sorted((set(first.meta) | set(other.meta)) - {*_OWN, *_LABELS, "disturbance"})
        differ = [k for k in keys if _plain(k, first.meta.get(k)) != _plain(k, other.meta.get(k))]
        if differ:
            raise LogError(
                f"logs '{first.name}' and '{other.name}' state different {', '.join(differ)}.\n"
                "Logs that are fitted together must be of one vehicle with one set of sensors "
                "and tolerances, in one medium; diagnose the others separately."
            )
    parts = [part for log in every for part in log.segments()]
    names = dict.fromkeys(name for log in every for name in log.columns)
    columns = {
        k: np.concatenate([p.columns.get(k, np.full(p.rows, np.nan)) for p in parts]) for k in names
    }
    segment = np.concatenate([np.full(p.rows, k, dtype=np.int64) for k, p in enumerate(parts)])
    # entries of all runs, in order
    own = {
        k: [entry for log in every for entry in list(log.meta[k])[: len(log.segments())]]
        for k in _OWN
        if all(k in log.meta for log in every)
    }
    meta = {k: v for k, v in first.meta.items() if k not in _OWN} | own
    meta |= {"logs": _each(every)}
    if any("sensors" in log.meta for log in every):
        # sensors of the first log, with the channels of all
        channels: dict[str, Any] = {}
        for log in reversed(every):
            channels |= _channels(log)
        meta["sensors"] = {**(every[0].meta.get("sensors") or {}), "channels": channels}
    if any("disturbance" in log.meta for log in every):
        meta["disturbance"] = max(
            (dict(log.meta.get("disturbance") or {}) for log in every),
            key=lambda gust: float(gust.get("force_sigma", 0.0)),
        )
    name = f"{first.name} and {len(every) - 1} more"
    return replace(first, name=name, columns=columns, segment=segment, meta=meta)


def _each(logs: Sequence[Log]) -> list[dict[str, Any]]:
    """Return what differs between the logs: name, rows, clock, surroundings, sensors."""
    found: list[dict[str, Any]] = []
    begin = 0.0
    for log in logs:
        first = float(log.time.min())
        found.append(
            {
                "name": log.name,
                "rows": log.rows,
                "begin": begin,
                "shift": begin - first,
                "baseline": log.meta.get("baseline") or [],
                "sigma": {
                    name: float(entry["sigma"])
                    for name, entry in _channels(log).items()
                    if isinstance(entry.get("sigma"), int | float)
                },
            }
        )
        begin += float(log.time.max()) - first + GAP
    return found


def _channels(log: Log) -> Mapping[str, Any]:
    return (log.meta.get("sensors") or {}).get("channels") or {}


def _plain(key: str, value: Any) -> Any:
    """Return metadata without names and without what may differ from log to log."""
    if key == "baseline":
        return [_bare(entry) for entry in value or [] if entry.get("name") not in sea_laws()]
    if key == "sensors" and isinstance(value, Mapping):
        return _bare({k: v for k, v in value.items() if k != "channels"})
    if key == ROBOT and isinstance(value, Mapping):
        return _bare({**value, "folder": read_bytes(Path(value["folder"]) / value["urdf"])})
    return _bare(value)


def _bare(value: Any) -> Any:
    """Return metadata without names."""
    if isinstance(value, Mapping):
        return {k: _bare(v) for k, v in value.items() if k not in _LABELS}
    if isinstance(value, list | tuple):
        return [_bare(v) for v in value]
    return value
