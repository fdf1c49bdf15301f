"""What inertial readings go through after the sensor: delay, then errors in their order."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from seals.arrays import Floats
from seals.effects.binding import EffectSet
from seals.motion import Reading
from seals.world.drivetrain import INSTANT, timing_of

CHANNELS = ("angular_velocity", "specific_force")
"""Channels that make a reading an inertial one."""

Past: TypeAlias = tuple[tuple[float, Floats], ...]
"""Readings that a delay still needs: time [s], and both channels of shape (2, 3)."""


class ReadingChain:
    """Delay and errors of the inertial sensors of one robot.

    A late reading is that of t - d, between two readings on the line through them. Before the first
    reading is d old, that one is reported.

    Args:
        effects: of the robot; those with ``measure`` act in the order of their ``order``.
    """

    def __init__(self, effects: EffectSet) -> None:
        """Sort the errors and sum the delays."""
        self.errors = sorted(effects.measures, key=lambda b: getattr(b.effect, "order", 0))
        self.delay = max(float(timing_of(effects).sensor_delay), 0.0)

    def report(
        self, time: float, reading: dict[str, Floats], past: Past
    ) -> tuple[dict[str, Floats], Past]:
        """Return what is reported at ``time`` and the readings to keep.

        Args:
            time: [s].
            reading: by channel; left alone unless it holds both inertial channels.
            past: from the last call, empty at first.
        """
        if not (self.errors or self.delay) or not reading.keys() >= set(CHANNELS):
            return reading, past
        both = np.array([reading[channel] for channel in CHANNELS])
        if self.delay:
            past = (*past, (time, both))
            both, past = _at(time - self.delay, past)
        out = Reading(both[0:1], both[1:2])
        for b in self.errors:
            out = b.hooks.measure(out, b.params)
        return {**reading, **{c: getattr(out, c)[0] for c in CHANNELS}}, past


def _at(time: float, past: Past) -> tuple[Floats, Past]:
    """Value at a time on the line through the past readings, and those still needed."""
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
