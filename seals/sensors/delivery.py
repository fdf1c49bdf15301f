"""Delivery of readings: dropouts, delay by faults, and the sensor's latency."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from seals.arrays import Floats
from seals.plugin_options import options_of
from seals.sensors.options import SensorOptions
from seals.state_records import state_record

INSTANT = 1e-9
"""Times closer than this are one [s]: ten thousand steps of 0.1 ms stay on their grid."""

Values: TypeAlias = Mapping[str, Floats]


@state_record
class Line(NamedTuple):
    """State of the delivery of one sensor; immutable.

    Args:
        lost: whether the last reading was lost.
        late: readings held back by a fault, with the time they were taken [s].
        coming: readings on their way, with the time they stand for [s].
    """

    lost: bool = False
    late: tuple[tuple[float, Values], ...] = ()
    coming: tuple[tuple[float, Values], ...] = ()


NEW = Line()


class Delivery:
    """Delivery of one sensor's readings, with dropouts and delays.

    Losses follow a chain of two states (Gilbert 1960, Bell System Technical Journal 39): the share
    ``dropout`` of all readings is lost, in runs of the mean length ``outage``; runs of single
    readings when that is 0. A fault holds readings back, and the log does not know: a row holds
    what was taken earlier. The stated ``latency`` keeps the row and delays what guide and
    controller hear, who know for which time it stands.

    Args:
        sensor: with its rate, and its fields of `MountedSensor` where it has them.
        delay: by which a fault holds it back, below zero for nothing [s].

    Attributes:
        plain: whether all readings arrive at once.
    """

    def __init__(self, sensor: Any, *, delay: float = 0.0) -> None:
        own = options_of(sensor, SensorOptions)
        self.latency, self.delay = float(own.latency), max(delay, 0.0)
        share = float(own.dropout)
        length = float(own.outage) * sensor.rate
        self._first = self._next = share
        if 0.0 < share < 1.0 and length > 0.0:
            # neither chance may be above one
            leave = min(1.0, 1.0 / length, (1.0 - share) / share)
            self._first, self._next = leave * share / (1.0 - share), 1.0 - leave
        self.plain = not (self.latency or self.delay or share)

    def report(
        self, time: float, step: float, reading: Values | None, line: Line, rng: np.random.Generator
    ) -> tuple[Values | None, Line]:
        """Return the reading to be logged at a time, and the new state.

        Args:
            time: [s].
            step: of the world; a fault's delay is rounded to whole ones [s].
            reading: taken now, None for none.
            line: memory.
            rng: random state; one draw for each reading of a sensor that loses some.
        """
        if reading is not None and self._first:
            lost = bool(rng.random() < (self._next if line.lost else self._first))
            line = line._replace(lost=lost)
            reading = None if lost else reading
        if self.delay:
            kept = line.late if reading is None else (*line.late, (time, reading))
            reading = None
            while kept and kept[0][0] + self.delay <= time + 0.5 * step:
                reading, kept = kept[0][1], kept[1:]
            line = line._replace(late=kept)
        if reading is not None and self.latency:
            line = line._replace(coming=(*line.coming, (time, reading)))
        return reading, line

    def arrivals(
        self, time: float, reading: Values | None, line: Line
    ) -> tuple[tuple[tuple[float, Values], ...], Line]:
        """Return the readings that arrive by a time, with their time stamps, and the new state."""
        if not self.latency:
            return (() if reading is None else ((time, reading),)), line
        count = sum(1 for taken, _ in line.coming if taken + self.latency <= time + INSTANT)
        return line.coming[:count], line._replace(coming=line.coming[count:])
