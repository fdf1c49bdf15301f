"""Map of columns of a foreign file to channels: scale, offset, unit and sign of each."""

from __future__ import annotations

import typing
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, refuse_unlisted
from seals.logs.channels import stem_of, unit_of
from seals.logs.units import find_unit, to_si
from seals.schema import read

_PULSES = "motor_pwm"


@dataclass(frozen=True, kw_only=True)
class ColumnMap:
    """What becomes of the columns of a file.

    Equation:
        value = s (scale * number + offset) in the stated unit, then to SI; s = -1 where negated.

    Args:
        columns: column of the file -> column of the log.
        units: column of the file -> unit of ``scale * number + offset``; left out, SI.
        scale: column of the file -> factor of its numbers; left out, 1.
        offset: column of the file -> what is added after the factor, in the unit; left out, 0.
        negate: columns of the file whose sign is turned.

    Raises:
        LogError: two columns have one target, a name is no text, or a factor is zero or not finite.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    scale: Mapping[str, float] = field(default_factory=dict)
    offset: Mapping[str, float] = field(default_factory=dict)
    negate: Collection[str] = ()

    def __post_init__(self) -> None:
        for name, kind in typing.get_type_hints(ColumnMap).items():
            read(kind, getattr(self, name), where=name, error=LogError)
        targets = list(self.columns.values())
        twice = sorted({ours for ours in targets if targets.count(ours) > 1})
        if twice:
            raise LogError(f"columns: two are mapped to {', '.join(twice)}.\nKeep one of them.")
        for theirs, factor in self.scale.items():
            if factor == 0.0:
                raise LogError(f"scale of '{theirs}' is 0.\nAllowed: any other number.")

    def refuse_stray(self) -> None:
        """Refuse units, factors and signs of columns that are not mapped.

        Raises:
            LogError: there is one.
        """
        for entry in ("units", "scale", "offset", "negate"):
            for theirs in getattr(self, entry):
                refuse_unlisted(
                    str(theirs),
                    self.columns,
                    f"{entry} names '{theirs}', which is not mapped",
                    label="Mapped",
                    error=LogError,
                )

    def converted(self, values: Floats, theirs: str, ours: str, *, where: str = "column") -> Floats:
        """Return the values of one column in SI, with their sign.

        Widths of motor pulses stay in microseconds, as an autopilot logs them.

        Args:
            values: numbers of the file, shape (rows,).
            theirs: column of the file.
            ours: column of the log.
            where: what a column is called in messages.

        Raises:
            LogError: the unit is unknown, measures another quantity than the channel, or a finite
                number becomes too large.

        Example:
            >>> gyro = ColumnMap(units={"g": "deg/s"}, scale={"g": 1 / 16.4}, offset={"g": -2.0})
            >>> rate = gyro.converted(np.array([1640.0]), "g", "angular_velocity_x")[0]
            >>> round(float(np.degrees(rate)), 6)
            98.0
        """
        with np.errstate(over="ignore"):
            ready = self._in_si(values, theirs, ours, where)
        if np.any(np.isfinite(values) & ~np.isfinite(ready)):
            raise LogError(
                f"{where} '{theirs}': scale, offset and unit give numbers that are too "
                "large.\nGive smaller ones."
            )
        return ready

    def _in_si(self, values: Floats, theirs: str, ours: str, where: str) -> Floats:
        """Return the values after factor, offset, unit and sign."""
        if theirs in self.scale:
            values = values * float(self.scale[theirs])
        if theirs in self.offset:
            values = values + float(self.offset[theirs])
        if theirs in self.units:
            name, place = self.units[theirs], f"{where} '{theirs}'"
            pulse = stem_of(ours) == _PULSES and find_unit(name, where=place).si == "s"
            expected = "s" if pulse else unit_of(ours)
            values = to_si(values, name, expected=expected, where=place) * (1e6 if pulse else 1.0)
        return -values if theirs in self.negate else values
