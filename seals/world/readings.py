"""Sensor faults: delay and errors of inertial readings, and their assignment to sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from seals.arrays import Floats
from seals.effects.binding import BoundEffect, EffectSet
from seals.errors import ConfigError, suggestion
from seals.frames import matrix_of, quaternion_of_rpy
from seals.motion import Reading
from seals.plugin_options import options_of
from seals.sensors.delivery import INSTANT
from seals.sensors.options import SensorOptions
from seals.sensors.protocol import Sensor, SensorInput

CHANNELS = ("angular_velocity", "specific_force")
"""Channels that make a reading an inertial one."""

Past: TypeAlias = tuple[tuple[float, Floats], ...]
"""Readings that a delay still needs: time [s], and the fields of a `Reading`, shape (4, 3)."""


EVERY = "*"
"""In place of names: every sensor."""


class ReadingChain:
    """Delay and errors of an inertial sensor of one robot.

    A late reading is that of t - d, between two readings on the line through them. Before the first
    reading is d old, that one is reported.

    Args:
        effects: of the robot; those with ``measure`` act in the order of their ``order``.
        name: of the sensor; empty for one that no fault names.
        rpy: turn of the sensor's axes against those of its link [rad]; None for none.
    """

    def __init__(
        self, effects: EffectSet, name: str = "", rpy: Sequence[float] | None = None
    ) -> None:
        acting = [b for b in effects.measures if acts_on(b, name, inertial=True)]
        self.errors = sorted(acting, key=lambda b: b.effect.order)
        self.delay = max(_delay(effects, name, inertial=True), 0.0)
        self.turn = np.eye(3) if rpy is None else matrix_of(quaternion_of_rpy(np.array([rpy])))[0]

    def report(
        self, felt: SensorInput, reading: dict[str, Floats], past: Past
    ) -> tuple[dict[str, Floats], Past]:
        """Return the reading reported at the time of ``felt``, and the readings to store.

        Args:
            felt: motion of the sensor's link.
            reading: by channel, both inertial channels among them.
            past: from the last call, empty at first.
        """
        if not (self.errors or self.delay):
            return reading, past
        spin = felt.angular_velocity if felt.turning is None else felt.turning
        turned = np.array([felt.angular_acceleration, spin]) @ self.turn
        all_four = np.concatenate([[reading[channel] for channel in CHANNELS], turned])
        if self.delay:
            past = (*past, (felt.time, all_four))
            all_four, past = _at(felt.time - self.delay, past)
        out = Reading(*(row[None] for row in all_four))
        for b in self.errors:
            out = b.hooks.measure(out, b.params)
        return {**reading, **{c: getattr(out, c)[0] for c in CHANNELS}}, past


def _at(time: float, past: Past) -> tuple[Floats, Past]:
    """Interpolate past readings at a time; also return the readings still needed."""
    first = sum(1 for t, _ in past if t <= time + INSTANT)
    if first == 0:
        return past[0][1], past
    past = past[first - 1 :]
    before, value = past[0]
    if len(past) == 1 or time <= before:
        return value, past
    after, following = past[1]
    share = (time - before) / (after - before)
    return value + share * (following - value), past


class Faults:
    """Assignment of sensor faults to sensors.

    A fault without names acts on the inertial sensors, as its law says. With names, or with ``*``
    for all, it acts on those: every sensor can be late, and what is mounted can be turned.

    Args:
        effects: of the robot.
        sensors: by name.

    Attributes:
        chains: of the inertial sensors, by name.
        delays: of all other sensors [s].
        turns: of their axes, None for none, shape (3, 3).

    Raises:
        ConfigError: a fault names a sensor that is not there, or one without axes.
    """

    def __init__(self, effects: EffectSet, sensors: Mapping[str, Sensor]) -> None:
        named = [b for b in effects.bound if b.effect.sensors]
        for b in named:
            for wrong in _chosen(b):
                if wrong != EVERY and wrong not in sensors:
                    raise ConfigError(
                        f"effects.{b.name}.sensors: there is no sensor '{wrong}'.\n"
                        f"{suggestion(wrong, [*sensors, EVERY], label='Sensors')}"
                    )
        inertial = {n for n, s in sensors.items() if s.channels().keys() >= set(CHANNELS)}
        self.chains = {
            n: ReadingChain(effects, n, options_of(s, SensorOptions).rpy)
            for n, s in sensors.items()
            if n in inertial
        }
        self.delays = {
            n: 0.0 if n in inertial else _delay(effects, n, inertial=False) for n in sensors
        }
        self.turns: dict[str, Floats | None] = dict.fromkeys(sensors)
        for b in named:
            for name in sensors.keys() - inertial:
                if hasattr(b.effect, "axis_misalignment") and acts_on(b, name, inertial=False):
                    self._turn(b, name, sensors[name])

    def _turn(self, b: BoundEffect, name: str, sensor: Sensor) -> None:
        """Rotate the axes of one sensor; a sensor without axes is skipped if all were meant."""
        if options_of(sensor, SensorOptions).rpy is None:
            if name in _chosen(b):
                raise ConfigError(
                    f"effects.{b.name}.sensors: '{name}' has no axes of its own to turn.\n"
                    "Allowed: sensors with a mounting (position, rpy)."
                )
            return
        turn, before = b.hooks.axis_misalignment(b.params)[0], self.turns[name]
        self.turns[name] = turn if before is None else before @ turn


def acts_on(b: BoundEffect, name: str, *, inertial: bool) -> bool:
    """Return whether a fault acts on the sensor of that name."""
    chosen = _chosen(b)
    return (name in chosen or EVERY in chosen) if chosen else inertial


def _chosen(b: BoundEffect) -> list[str]:
    return list(b.effect.sensors)


def _delay(effects: EffectSet, name: str, *, inertial: bool) -> float:
    """Sum of the delays of one sensor [s]."""
    acting = [b for b in effects.timings if acts_on(b, name, inertial=inertial)]
    late: list[Any] = [b.hooks.timing(b.params).sensor_delay for b in acting]
    return float(sum(float(np.reshape(d, -1)[0]) for d in late))
