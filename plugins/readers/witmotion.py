"""Reader of text files recorded from WitMotion inertial sensors."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError
from seals.field_roles import roles
from seals.logs.log import Log
from seals.logs.units import to_si
from seals.schema import setting
from seals.untrusted_io import read_bytes

_MOST_BYTES = 1 << 26
_DAY = 86_400.0
_LETTERS = "xyz"
_NAMES = (
    (re.compile(r"(?:a|acc|acceleration ?)(?P<k>[xyz])\((?P<unit>g)\)"), "specific_force_{}"),
    (
        re.compile(r"(?:w|gyro|as|angular velocity ?)(?P<k>[xyz])\((?P<unit>deg/s)\)"),
        "angular_velocity_{}",
    ),
    (re.compile(r"(?:q|quaternions? ?)(?P<k>[0-3])(?:\((?P<unit>)\))?"), "orientation_{}"),
)
_TIME = re.compile(r"(?:chip ?)?time(?:\(s\))?")
_CLOCKS = ("%Y-%m-%d %H:%M:%S.%f", "%H:%M:%S.%f", "%Y/%m/%d %H:%M:%S.%f", "%H:%M:%S:%f")


@roles(data="axes meta name licence", read="path")
@dataclass(kw_only=True)
class ReaderWitmotion:
    """Text files of WitMotion sensors (WT901 and similar), as written by their programs.

    Channels:
        ``specific_force_x/y/z``, ``angular_velocity_x/y/z``; ``orientation_w/x/y/z`` where the file
        has quaternions. Each new heading or ``StartTime`` begins a segment.
    Units:
        g with 9.80665, degrees per second; times as seconds or as time of day.
    Source:
        WT901 data sheet v20-0702: acceleration in g, +1 along an axis that points up at rest.
    Limitations:
        Angles and magnetic field are left out: their reference and units differ by program. The
        orientation is the device's own; without its magnetometer the heading starts at zero. The
        sensor's place off the body origin is not corrected: state it in ``meta``.

    Args:
        path: the file, plain or ``.gz``.
        axes: axes of the sensor that point forward, left and up: ``[x, y, z]``, ``[-y, x, z]`` ...
        rate: samples a second as set in the device; rows are then spaced by it, because programs
            write whole milliseconds and repeat them. 0 takes the stamps as they are [Hz].
        meta: what is known of vehicle and sensors, as in ``meta.yaml``.
        name: name of the log.
        licence: licence of the data.
    """

    path: str = ""
    axes: list[str] = field(default_factory=lambda: ["x", "y", "z"])
    rate: float = setting(0.0, "Hz", bounds=(0.0, 1e5), source="not set")
    meta: dict[str, Any] = field(default_factory=dict)
    name: str = ""
    licence: str = ""

    def __post_init__(self) -> None:
        turn = np.array(
            [[_sign(axis) * (axis[-1:] == one) for one in _LETTERS] for axis in self.axes]
        )
        if turn.shape != (3, 3) or round(float(np.linalg.det(turn))) != 1:
            raise LogError(
                f"axes={self.axes} is not allowed.\n"
                "Allowed: the sensor's axes forward, left and up, right-handed, such as [-y, x, z]"
            )

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the one log of the file.

        Raises:
            LogError: nothing was given, or the file cannot be used.
        """
        given = source or self.path
        if not given:
            raise LogError(
                "the WitMotion reader needs a file.\nGive it: log=FILE, in Python path=FILE."
            )
        names, rows, segment = _rows(_text(read_bytes(given, most=_MOST_BYTES)), str(given))
        try:
            table = np.array(rows, dtype=np.float64)
        except ValueError as error:
            raise LogError(f"'{given}': a cell is not a number ({error}).") from error
        columns = {name: table[:, k] for k, name in enumerate(names)}
        columns["t"] = self._time(columns["t"], np.array(segment))
        return [
            Log(
                name=self.name or Path(given).name.split(".")[0],
                columns=_turned(columns, self.axes),
                segment=np.array(segment, dtype=np.int64),
                meta=dict(self.meta),
                source=str(given),
                licence=self.licence,
            )
        ]

    def _time(self, time: Floats, segment: Any) -> Floats:
        # a clock without a date starts anew at midnight
        days = np.cumsum(np.append(0.0, np.diff(time) < -_DAY / 2))
        time = time + _DAY * days - time[0]
        if self.rate > 0.0:
            for number in np.unique(segment):
                mine = segment == number
                time[mine] = time[mine][0] + np.arange(mine.sum()) / self.rate
        return time


def _sign(axis: str) -> float:
    return {"": 1.0, "+": 1.0, "-": -1.0}.get(axis[:-1], 0.0)


def _text(raw: bytes) -> str:
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        # the maker's program writes the code page of its machine
        return raw.decode("gb18030", errors="replace")


def _rows(text: str, where: str) -> tuple[list[str], list[list[str]], list[int]]:
    """Return the names of the columns taken, their values as text, and the segment of each row."""
    taken: dict[str, int] = {}
    split, rows, segment, number = "\t", [], list[int](), -1
    lines = text.splitlines()
    for place, line in enumerate(lines):
        if not line.strip() or line.lstrip().lower().startswith("starttime"):
            continue
        delimiter = "\t" if "\t" in line else ","
        heading = _heading(line.split(delimiter))
        if heading:
            if taken and list(heading) != list(taken):
                raise LogError(
                    f"'{where}', line {place + 1}: a second heading.\nCut the file there."
                )
            taken, split, number = heading, delimiter, number + 1
            continue
        words = line.split(split)
        if not taken:
            break
        if len(words) <= max(taken.values()):
            if place == len(lines) - 1:
                # the last line of a recording that was cut off
                break
            raise LogError(
                f"'{where}', line {place + 1} has {len(words)} values, which are too few."
            )
        rows.append([words[k] for k in taken.values()])
        segment.append(number)
    if not rows:
        raise LogError(
            f"'{where}' is not a table of a WitMotion sensor.\n"
            "Needed: a heading with a time and ax(g) ... or wx(deg/s) ...; else use reader=csv"
        )
    clock = list(taken).index("t")
    # counted from the first one: as seconds since a calendar's start they lose microseconds
    first = _moment(rows[0][clock].strip(), where)
    for row in rows:
        word = row[clock].strip()
        row[clock] = repr((_moment(word, where) - first).total_seconds()) if ":" in word else word
    return list(taken), rows, segment


def _heading(words: list[str]) -> dict[str, int]:
    """Return the index of each known column; empty if the line is not a header."""
    found: dict[str, int] = {}
    for place, word in enumerate(words[:256]):
        name = word.strip().strip('"').lower().replace("°", "deg").replace("º", "deg")
        if _TIME.fullmatch(name):
            found.setdefault("t", place)
        for pattern, column in _NAMES:
            match = pattern.fullmatch(name)
            if match:
                key = "wxyz"[int(match["k"])] if match["k"].isdigit() else match["k"]
                found.setdefault(column.format(key), place)
    return found if "t" in found and len(found) > 1 else {}


def _moment(word: str, where: str) -> datetime:
    if ":" not in word:
        return datetime(1900, 1, 1)
    full = word if "." in word or word.count(":") == 3 else f"{word}.0"
    for clock in _CLOCKS:
        try:
            return datetime.strptime(full, clock)
        except ValueError:
            continue
    raise LogError(f"'{where}': '{word[:40]}' is not a time of day.\nAllowed: 14:03:22.518")


def _turned(columns: dict[str, Floats], axes: list[str]) -> dict[str, Floats]:
    ready = {"t": columns["t"]}
    for stem, unit in (("specific_force", "g"), ("angular_velocity", "deg/s")):
        for ours, theirs in zip(_LETTERS, axes, strict=True):
            values = columns.get(f"{stem}_{theirs[-1]}")
            if values is not None:
                ready[f"{stem}_{ours}"] = _sign(theirs) * to_si(values, unit)
    if axes in (["x", "y", "z"], ["+x", "+y", "+z"]):
        ready |= {key: value for key, value in columns.items() if key.startswith("orientation")}
    return ready
