"""Stated waves of one or several logs, each with its own clock."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol

import numpy as np

from seals.arrays import Array, Floats
from seals.effects.derived import strengths_of
from seals.effects.effect import Effect
from seals.environment.settings import EnvironmentSettings
from seals.environment.waves import Sea
from seals.sysid.data.installed import loaded

GAP = 10.0
"""Time between two logs on the clock of all of them [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _SeaOfLogs:
    """Waves of several concatenated logs on their common clock.

    Args:
        law: waves of one log.
        values: of its fields: a number or an array over the points given to `at`, or a tuple of
            these, one for each log.
        begins: clock at the first row of each log [s], increasing, shape (n,).
        shift: clock less the time of each log [s], shape (n,).
    """

    law: Any
    values: Mapping[str, Any]
    begins: Floats
    shift: Floats

    def at(self, position: Array, time: Array, level: float) -> Sea:
        """Return the sea at points and times; the time chooses the log whose waves apply."""
        count = len(position)
        clock = np.broadcast_to(np.asarray(time), (count, 1))
        # a step may look a little past the last row of a log
        log = np.clip(
            np.searchsorted(self.begins - 0.5 * GAP, clock[:, 0], side="right") - 1, 0, None
        )
        here = copy.copy(self.law)
        for name, value in self.values.items():
            chosen = value
            if isinstance(value, tuple):
                each = np.array([np.broadcast_to(v, count) for v in value])
                chosen = each[log, np.arange(count)]
            setattr(here, name, chosen)
        found: Sea = here.at(position, clock - self.shift[log][:, None], level)
        return found


class Span(Protocol):
    """Position of one log on the common clock of all logs."""

    @property
    def begin(self) -> float:
        """Common clock at the first row [s]."""

    @property
    def shift(self) -> float:
        """Common clock less the log's own time [s]."""


def sea_of(calm: Any, values: Mapping[str, Any], logs: Sequence[Span]) -> Any:
    """Return waves with given parameter values, for one log or several.

    Args:
        calm: waves of no strength.
        values: of their fields, arrays over the points; of several logs each may have its own of a
            field in ``per_log``, that of log k under the name with ``_k`` behind it.
        logs: places of the logs on one clock; fewer than two for the time of the log itself.
    """
    if len(logs) < 2:
        here = copy.copy(calm)
        for name, value in values.items():
            setattr(here, name, value)
        return here
    whole = {name: v for name, v in values.items() if hasattr(calm, name)}
    for name in calm.per_log:
        every = [name, *(own_key(name, k) for k in range(1, len(logs)))]
        whole[name] = tuple(values.get(key, getattr(calm, name)) for key in every)
    return _SeaOfLogs(
        law=calm,
        values=whole,
        begins=np.array([log.begin for log in logs]),
        shift=np.array([log.shift for log in logs]),
    )


def own_key(name: str, log: int) -> str:
    """Return the name of a per-log parameter; that of the first log has no suffix."""
    return f"{name}_{log + 1}" if log else name


def sea_laws() -> dict[str, Any]:
    """Return the wave classes by the name that the metadata of a log use."""
    laws = (law for law in loaded("wave").values() if hasattr(law, "candidate"))
    return {str(law.candidate): law for law in laws}


def known_sea(
    meta: Mapping[str, Any], environment: EnvironmentSettings
) -> tuple[Any, dict[str, Effect]]:
    """Return the waves that the metadata state, and the effects that go with them.

    Args:
        meta: of a log, or of several joined ones with their entry ``logs``.
        environment: of the logs.
    """
    parts = meta.get("logs") or [{"baseline": meta.get("baseline"), "begin": 0.0, "shift": 0.0}]
    laws = sea_laws()
    stated = [_waves(part.get("baseline") or [], laws) for part in parts]
    name = next((name for name, _ in stated if name), "")
    if not name or environment.water_level is None:
        return None, {}
    law = laws[name]
    off = dict.fromkeys(strengths_of(law), 0.0)
    each = [
        law.of_log(
            **{**off, **given},
            **{f.name: environment.gravity for f in fields(law) if f.name == "gravity"},
        )
        for _, given in stated
    ]
    beside: dict[str, Effect] = law.beside()
    if len(each) == 1:
        return each[0], beside
    numeric = [f.name for f in fields(law) if isinstance(getattr(each[0], f.name), float)]
    return (
        _SeaOfLogs(
            law=each[0],
            values={n: tuple(getattr(one, n) for one in each) for n in numeric},
            begins=np.array([float(part["begin"]) for part in parts]),
            shift=np.array([float(part["shift"]) for part in parts]),
        ),
        beside,
    )


def _waves(
    entries: Sequence[Mapping[str, Any]], laws: Mapping[str, Any]
) -> tuple[str, dict[str, float]]:
    """Name and parameters of the waves among the entries of a stated model."""
    for entry in entries:
        if str(entry["name"]) in laws:
            given = {k: float(v) for k, v in (entry.get("parameters") or {}).items()}
            return str(entry["name"]), given
    return "", {}
