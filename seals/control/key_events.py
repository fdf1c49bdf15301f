"""Input of a pilot over time, read from and written to small files; its keys, axes and buttons."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from seals.errors import ConfigError, LogError, suggestion
from seals.logs.atomic import write_text
from seals.schema import read
from seals.untrusted_io import plain_yaml, read_text

JOINTS = 6
"""Joints of one arm that have keys."""


class Stick(NamedTuple):
    """Stick input of a pilot, as fractions of full deflection.

    Args:
        forward: along the heading [1].
        left: across it [1].
        up: [1].
        turn: anticlockwise seen from above [1].
        joints: of the chosen arm, `JOINTS` of them [1].
        grip: closing, of all grippers [1].
        stow: whether the arms shall go to rest.
        end: whether the session shall end.
    """

    forward: float = 0.0
    left: float = 0.0
    up: float = 0.0
    turn: float = 0.0
    joints: tuple[float, ...] = (0.0,) * JOINTS
    grip: float = 0.0
    stow: bool = False
    end: bool = False

    @property
    def moves(self) -> bool:
        """Return whether the input moves the robot's body."""
        return any((self.forward, self.left, self.up, self.turn))


KEYS: Mapping[str, tuple[str, float]] = {
    "w": ("forward", 1.0),
    "s": ("forward", -1.0),
    "a": ("left", 1.0),
    "d": ("left", -1.0),
    "r": ("up", 1.0),
    "f": ("up", -1.0),
    "q": ("turn", 1.0),
    "e": ("turn", -1.0),
    "u": ("joint_1", 1.0),
    "j": ("joint_1", -1.0),
    "i": ("joint_2", 1.0),
    "k": ("joint_2", -1.0),
    "o": ("joint_3", 1.0),
    "l": ("joint_3", -1.0),
    "y": ("joint_4", 1.0),
    "h": ("joint_4", -1.0),
    "t": ("joint_5", 1.0),
    "g": ("joint_5", -1.0),
    "n": ("joint_6", 1.0),
    "b": ("joint_6", -1.0),
    "c": ("grip", 1.0),
    "v": ("grip", -1.0),
    "x": ("stow", 1.0),
    "tab": ("next arm", 1.0),
    "escape": ("end", 1.0),
}
"""Keys: what each acts on, and how much of full."""
PAD: Mapping[str, tuple[str, float]] = {
    # sticks of the usual pads count positive to the right and towards the person
    "axis_0": ("turn", -1.0),
    "axis_1": ("up", -1.0),
    "axis_2": ("left", -1.0),
    "axis_3": ("forward", -1.0),
    "button_0": ("grip", 1.0),
    "button_1": ("grip", -1.0),
    "button_2": ("joint_1", 1.0),
    "button_3": ("joint_1", -1.0),
    "button_4": ("joint_2", -1.0),
    "button_5": ("joint_2", 1.0),
    "button_6": ("stow", 1.0),
    "button_7": ("end", 1.0),
}
"""Axes and buttons of a gamepad."""
NEXT_ARM = "tab"
CONTROLS = (*KEYS, *PAD)
"""Names of all controls that do something."""
_WORDS = {
    "forward": "forward, back",
    "left": "left, right",
    "up": "up, down",
    "turn": "turn left, right",
    "grip": "close, open the grippers",
    "stow": "arms to rest",
    "next arm": "choose the next arm",
    "end": "end the session",
}


def stick_of(held: Mapping[str, float]) -> Stick:
    """Return the stick input of the held controls.

    Example:
        >>> stick_of({"w": 1.0, "q": 1.0}).forward, stick_of({"axis_3": -0.5}).forward
        (1.0, 0.5)
    """
    sums: dict[str, float] = {}
    for table in (KEYS, PAD):
        for control, (action, amount) in table.items():
            if control in held:
                sums[action] = sums.get(action, 0.0) + amount * held[control]

    def share(action: str) -> float:
        return min(max(sums.get(action, 0.0), -1.0), 1.0)

    return Stick(
        forward=share("forward"),
        left=share("left"),
        up=share("up"),
        turn=share("turn"),
        joints=tuple(share(f"joint_{k + 1}") for k in range(JOINTS)),
        grip=share("grip"),
        stow=share("stow") > 0.5,
        end=share("end") > 0.5,
    )


def table() -> str:
    """Return the keys as text, one line for each pair."""
    lines = []
    for name, controls in (("keyboard", KEYS), ("gamepad", PAD)):
        pairs: dict[str, list[str]] = {}
        for control, (action, _) in controls.items():
            pairs.setdefault(action, []).append(control)
        lines.append(f"  {name}")
        for action, keys in pairs.items():
            words = _WORDS.get(action, action.replace("_", " ") + " of the arm, up, down")
            lines.append(f"    {' '.join(keys):<22}{words}")
    return "\n".join(lines)


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
            "Write one entry per line: - {t: 0.5, hold: w, seconds: 2}"
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
            f"{where} gives {kinds or 'nothing'}.\nWrite one of: press, release, hold, set"
        )
    kind, control = kinds[0], getattr(entry, kinds[0])
    value = entry.value if kind == "set" else float(kind != "release")
    first = _event(where, entry.t, control, value)
    if kind != "hold":
        return [first]
    if entry.seconds is None:
        raise ConfigError(f"{where} hold states no duration.\nAdd: seconds: 2")
    return [first, Event(first.time + entry.seconds, control, 0.0)]


def _event(where: str, time: float, control: str, value: float) -> Event:
    # whether a name is that of a key, axis or button of a script
    if not (control in CONTROLS or bool(re.fullmatch(r"(axis|button)_\d+", control))):
        raise ConfigError(
            f"{where} there is no control '{control}'.\n{suggestion(control, CONTROLS, most=40)}"
        )
    if time < 0.0:
        raise ConfigError(f"{where} t={time:g} lies before the start.\nAllowed: 0 or later.")
    if not -1.0 <= value <= 1.0:
        raise ConfigError(f"{where} value={value:g} is not allowed.\nAllowed: -1 to 1.")
    return Event(time, control, value)
