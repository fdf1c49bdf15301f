"""Base of sensors that sample true values at their rate and add errors."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.sensors.mount import Mount, PlacedSensor
from seals.sensors.noise import Noise
from seals.sensors.protocol import SensorInput
from seals.state_records import state_record

TrueValues = Mapping[str, Floats]
"""Quantities without sensor errors, by name, each of shape (k,)."""


@state_record
class InstrumentState(NamedTuple):
    """State of an instrument; immutable.

    Args:
        time: of the last reading [s].
        own: what `Instrument.look` keeps.
        drift: of every quantity, None before the first reading.
    """

    time: float
    own: Any
    drift: Mapping[str, Floats | None]


@dataclass(kw_only=True)
class Instrument(PlacedSensor, ABC):
    """Base of mounted sensors: true values, error models, conversion to readings.

    A subclass declares ``rate``, ``channels`` and ``look``; `noise_laws` gives the errors of what
    ``look`` sees and `solve` makes readings of it. Mounting, errors and their memory are here,
    latency and lost readings in the world.

    Args:
        position: mounting point in link axes [m].
        rpy: turn of the sensor's axes against those of the link [rad].

    Example:
        >>> from seals.plugins.sensors.pressure import SensorPressure
        >>> issubclass(SensorPressure, Instrument), SensorPressure(latency=0.05).latency
        (True, 0.05)
    """

    idles: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Turn mounting and errors into arrays."""
        self._mount = Mount("sensor", self.position, self.rpy)
        self._noise = dict(self.noise_laws())

    @abstractmethod
    def look(self, felt: SensorInput, own: Any) -> tuple[TrueValues | None, Any]:
        """Return the true quantities, and the sensor's own state.

        None is silence: there is no reading. A quantity may be left out.

        Args:
            felt: the instant at the mounting point, in the sensor's axes.
            own: from the last reading, None at the start.
        """

    def noise_laws(self) -> Mapping[str, Noise]:
        """Return the error models of the quantities of `look`."""
        return {}

    def solve(self, seen: TrueValues, felt: SensorInput) -> dict[str, Floats]:
        """Return the readings by channel.

        Args:
            seen: with errors.
            felt: motion of the link, exact.
        """
        return dict(seen)

    def sigmas(self) -> dict[str, float]:
        """Return the standard deviation by white noise and quantisation, by channel."""
        return {name: law.spread for name, law in self._noise.items() if law.spread > 0.0}

    def start(self, rng: np.random.Generator) -> Any:
        """Return the initial state."""
        return InstrumentState(0.0, None, {})

    def sense(
        self, felt: SensorInput, memory: Any, rng: np.random.Generator, *, due: bool
    ) -> tuple[dict[str, Floats] | None, Any]:
        """Return a reading when due."""
        if not due:
            return None, memory
        seen, own = self.look(self._mount.felt(felt), memory.own)
        if seen is None:
            return None, memory._replace(own=own)
        read, drift = dict(seen), dict(memory.drift)
        for name, law in self._noise.items():
            if name in read:
                read[name], drift[name] = law.read(
                    read[name], drift.get(name), felt.time - memory.time, rng
                )
        return self.solve(read, felt), InstrumentState(felt.time, own, drift)
