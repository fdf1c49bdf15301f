"""Input events of a pilot over time, read from and written to small files."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from seals.control.keymap import CONTROLS, is_control
from seals.errors import ConfigError, LogError, suggestion
from seals.logs.atomic import write_text
from seals.schema import read
from seals.untrusted_io import plain_yaml, read_text

HEADER = ("t", "control", "value")


class Event(NamedTuple):
    """One change of one control.

    Args:
        time: [s].
        control: name of a key, ``axis_0`` or ``button_0``.
        value: from now on; 1 for pressed, 0 for released, -1 to 1 for an axis.
    """

    time: float
    control: str
    value: float


class _Row(NamedTuple):
    """Row of a CSV script."""

    t: float
    control: str
    value: float


class _Entry(NamedTuple):
    """Entry of a YAML script."""

    t: float
    press: str | None = None
    release: str | None = None
    hold: str | None = None
    set: str | None = None
    seconds: float | None = None
    value: float = 1.0


def read_track(path: Path) -> list[Event]:
    """Read events from a CSV or YAML file, sorted by time.

    A CSV file has the columns ``t,control,value``. A YAML file is a list of entries such as
    ``{t: 0.5, hold: w, seconds: 2}``, ``{t: 3, press: q}``, ``{t: 4, release: q}`` and
    ``{t: 5, set: axis_0, value: -0.5}``.

    Raises:
        ConfigError: the file is missing, or an entry cannot be understood; it is named.
    """
    if not path.is_file():
        folder = path.parent if path.parent.is_dir() else Path()
        beside = [str(p) for p in folder.glob("*") if p.suffix in (".csv", ".yaml", ".yml")]
        raise ConfigError(
            f"script {path} does not exist.\n{suggestion(str(path), beside, label='Files there')}"
        )
    try:
        text = read_text(path)
    except LogError as cause:
        raise ConfigError(f"script {path} cannot be read: {cause}\nIt must be text.") from cause
    rows = _csv(path, text) if path.suffix == ".csv" else _yaml(path, text)
    return sorted(rows, key=lambda event: event.time)


def write_track(path: Path, events: Iterable[Event]) -> None:
    """Write events as CSV; `read_track` gives them back exactly."""
    lines = [",".join(HEADER)]
    lines += [f"{e.time!r},{e.control},{e.value!r}" for e in events]
    write_text(path, "\n".join(lines) + "\n")


def held_after(held: Mapping[str, float], events: Sequence[Event]) -> dict[str, float]:
    """Return the values of all controls after some events; released ones are left out.

    Example:
        >>> held_after({"w": 1.0}, [Event(1.0, "w", 0.0), Event(1.5, "q", 1.0)])
        {'q': 1.0}
    """
    values = {**held, **{event.control: event.value for event in events}}
    return {control: value for control, value in values.items() if value}


def _csv(path: Path, text: str) -> list[Event]:
    try:
        rows = list(csv.reader(line for line in text.splitlines() if line.strip()))
    except csv.Error as cause:
        raise ConfigError(f"script {path} is not a table: {cause}.\nCheck the quotes.") from cause
    if not rows or tuple(cell.strip() for cell in rows[0]) != HEADER:
        raise ConfigError(
            f"script {path} begins with {rows[0] if rows else 'nothing'}.\n"
            f"The first line must be: {','.join(HEADER)}"
        )
    events = []
    for number, row in enumerate(rows[1:], start=2):
        where = f"script {path}, line {number}:"
        if len(row) != 3:
            raise ConfigError(f"{where[:-1]} has {len(row)} cells.\nAllowed: t,control,value")
        cells = [cell.strip() for cell in row]
        events.append(
            _event(where, *read(_Row, dict(zip(HEADER, cells, strict=True)), where=where))
        )
    return events


def _yaml(path: Path, text: str) -> list[Event]:
    import yaml

    try:
        entries = plain_yaml(text)
    except yaml.YAMLError as cause:
        words = " ".join(str(cause).split())
        raise ConfigError(
            f"script {path} is not valid YAML: {words}.\nCheck the brackets."
        ) from cause
    if not isinstance(entries, list):
        raise ConfigError(
            f"script {path} holds no list.\n"
            "Write one entry a line: - {t: 0.5, hold: w, seconds: 2}"
        )
    events = []
    for number, entry in enumerate(entries, start=1):
        events += _entry(f"script {path}, entry {number}:", entry)
    return events


def _entry(where: str, raw: Any) -> list[Event]:
    """Events of one entry of a YAML script."""
    if not isinstance(raw, dict) or "t" not in raw:
        raise ConfigError(f"{where} {raw!r} has no time.\nWrite: {{t: 0.5, hold: w, seconds: 2}}")
    entry = read(_Entry, raw, where=where)
    kinds = [word for word in ("press", "release", "hold", "set") if getattr(entry, word)]
    if len(kinds) != 1:
        raise ConfigError(
            f"{where} says {kinds or 'nothing'}.\nSay one of: press, release, hold, set"
        )
    kind, control = kinds[0], getattr(entry, kinds[0])
    value = entry.value if kind == "set" else float(kind != "release")
    first = _event(where, entry.t, control, value)
    if kind != "hold":
        return [first]
    if entry.seconds is None:
        raise ConfigError(f"{where} hold does not say how long.\nAdd: seconds: 2")
    return [first, Event(first.time + entry.seconds, control, 0.0)]


def _event(where: str, time: float, control: str, value: float) -> Event:
    if not is_control(control):
        raise ConfigError(
            f"{where} there is no control '{control}'.\n{suggestion(control, CONTROLS, most=40)}"
        )
    if time < 0.0:
        raise ConfigError(f"{where} t={time:g} lies before the start.\nAllowed: 0 or later.")
    if not -1.0 <= value <= 1.0:
        raise ConfigError(f"{where} value={value:g} is not allowed.\nAllowed: -1 to 1.")
    return Event(time, control, value)
