"""Reader of flights of Betaflight, as the program blackbox_decode writes them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

from seals.errors import LogError
from seals.logs.content import BLACKBOX, DECODE
from seals.logs.csv import log_of_columns
from seals.logs.log import Log
from seals.logs.table import header, read_csv_columns
from seals.logs.units import find_unit
from seals.plugins.readers.mapped import ReaderMapped
from seals.schema import check_tree, count, setting
from seals.untrusted_io import read_bytes

_FIRST_LINES = 400
_COUNTED = re.compile(r"(?P<stem>\w+)\[(?P<k>\d)\]")
_ONCE = {"time": "t", "vbatLatest": "battery_voltage", "amperageLatest": "battery_current"}
_AXES = {"gyroADC": "angular_velocity", "accSmooth": "specific_force"}
_UNITS = {"m/s2": "m/s^2", "m/s/s": "m/s^2"}


@dataclass(kw_only=True)
class ReaderBetaflight(ReaderMapped):
    """Tables that ``blackbox_decode`` makes of logs of Betaflight, Cleanflight and INAV.

    Channels:
        ``gyroADC``, ``accSmooth``, ``motor``, ``eRPM``, ``vbatLatest``, ``amperageLatest``; others
        by ``columns``.
    Units:
        Those in the header of the table; gyroscope and accelerometer without one are counts, whose
        size is stated by ``gyro_scale`` and ``acc_1g``. The axes of Betaflight are FLU already:
        roll to the right, pitch nose down and yaw to the left are positive, and +1 g at rest.
        ``motor`` stays as it is written: ``motor_pwm`` of 1000 to 2000, or DShot of 48 to 2047.
    Limitations:
        No pose: the log holds inertial sensors and commands. A log itself (``.bbl``, ``.bfl``) is
        not read, decode it first. The gyroscope is filtered, and late by its filters.

    Args:
        path: the table, plain or ``.gz``.
        columns: further columns of the table, without their unit -> column of the log.
        gyro_scale: size of a count of the gyroscope [deg/s]: 1 for Betaflight; 0 takes the unit of
            the header.
        acc_1g: counts of 1 g, ``acc_1G`` of the log (2048 as a rule); 0 as above.
        poles: of a motor's magnets, of which ``eRPM`` counts pairs.
    """

    kind: ClassVar[str] = "Betaflight"

    gyro_scale: float = setting(0.0, "deg/s", bounds=(0.0, 1e3), source="not set")
    acc_1g: float = setting(0.0, "1", bounds=(0.0, 1e6), source="not set")
    poles: int = count(14, bounds=(2, 1000))

    def __post_init__(self) -> None:
        """Refuse what the fields do not allow, as the reading of a configuration does."""
        check_tree(self, where="reader")

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the one log of the table.

        Raises:
            LogError: nothing was given, the table cannot be used, or a unit is not known.
        """
        given, chosen = self.given(source), self.chosen()
        content = read_bytes(given)
        if content.startswith(BLACKBOX):
            raise LogError(f"'{given}' is a raw log of Betaflight.\nDecode it: {DECODE}")
        skipped = _lines_before(content, given)
        titles = _titles(header(given, content, skip_lines=skipped))
        known = {name: ours for name in titles if (ours := _column(name)) is not None}
        taken = set(self.columns.values())
        columns = {k: v for k, v in known.items() if v not in taken} | dict(self.columns)
        units, scale = self._units(titles, columns, given)
        units, scale = units | dict(self.units), scale | dict(self.scale)
        missing = [name for name in columns if name not in titles]
        raw = read_csv_columns(
            given,
            skip_lines=skipped,
            wanted=[titles[k][0] if k in titles else k for k in (*missing, *columns)],
            clock="",
        )
        chosen = replace(chosen, columns=columns, units=units, scale=scale)
        numbers = {name: raw[titles[name][0]] for name in columns}
        return [
            log_of_columns(
                given, numbers, chosen, meta=self.meta, name=self.name, licence=self.licence
            )
        ]

    def _units(
        self, titles: Mapping[str, tuple[str, str]], columns: Mapping[str, str], given: Path
    ) -> tuple[dict[str, str], dict[str, float]]:
        """Return unit and factor of the known columns."""
        units: dict[str, str] = {}
        scale: dict[str, float] = {}
        counts = {"gyroADC": ("deg/s", self.gyro_scale),
                  "accSmooth": ("g", 1.0 / self.acc_1g if self.acc_1g else 0.0)}  # fmt: skip
        for name in set(columns) & set(titles):
            unit, stem = titles[name][1], name.partition("[")[0]
            if name in self.columns:
                continue
            if stem in counts and not unit:
                units[name], scale[name] = counts[stem]
                if not scale[name]:
                    raise LogError(
                        f"'{given}': '{name}' has no unit: its numbers are counts.\nDecode it by "
                        f"{DECODE}; or give reader.gyro_scale=1 reader.acc_1g=2048 (acc_1G of the "
                        "log)"
                    )
            elif stem == "eRPM":
                # hundreds of turns of the field a minute, of which poles/2 are one of the rotor
                units[name], scale[name] = "rpm", 200.0 / self.poles
            elif name == "time" and not unit:
                units[name] = "us"
            elif unit:
                units[name] = _UNITS.get(unit, unit)
        for name, unit in units.items():
            find_unit(unit, where=f"'{given}', column '{name}'")
        return units, scale


def _lines_before(content: bytes, given: Path) -> int:
    """Return the number of lines above the header; the viewer of logs writes some."""
    for number, line in enumerate(content[: 1 << 20].split(b"\n")[:_FIRST_LINES]):
        if line.lstrip(b'\xef\xbb\xbf" ').startswith(b"loopIteration"):
            return number
    raise LogError(
        f"'{given}' is not a table of blackbox_decode: no line begins with loopIteration.\n"
        f"To make one from a log of Betaflight: {DECODE}"
    )


def _titles(names: list[str]) -> dict[str, tuple[str, str]]:
    """Return column without unit -> column as it is written, and its unit."""
    found: dict[str, tuple[str, str]] = {}
    for whole in names:
        # by position: a pattern takes the square of the length of a title of blanks
        start = whole.rfind("(") if whole.endswith(")") else -1
        bare, unit = (whole[:start], whole[start + 1 : -1]) if start >= 0 else (whole, "")
        named, unit = (whole, "") if ")" in unit else (bare.rstrip(), unit)
        found.setdefault(named, (whole, "" if unit == "raw" else unit))
    return found


def _column(name: str) -> str | None:
    """Return the column of the log that a known column becomes."""
    match = _COUNTED.fullmatch(name)
    if match is None:
        return _ONCE.get(name)
    stem, k = match["stem"], int(match["k"])
    if stem in _AXES and k < 3:
        return f"{_AXES[stem]}_{'xyz'[k]}"
    numbered = {"motor": "motor_pwm", "eRPM": "rotor_speed"}.get(stem)
    return f"{numbered}_{k + 1}" if numbered else None
