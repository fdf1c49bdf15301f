"""Contact sensor of a link, such as the pad of a finger-tip."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Floats
from seals.schema import param, setting
from seals.sensors.mount import MountedSensor
from seals.sensors.protocol import SensorInput


@dataclass(kw_only=True)
class SensorContact(MountedSensor):
    """Contact sensor of a link: the normal force, and whether it exceeds a threshold.

    Equation:
        pressing = N (1 + gain_error) + noise while N >= threshold, and 0 below it; contact is 1
        from the threshold on. N is the mean, over the time since the last reading, of the sum of
        the normal forces of all contacts of the link.

    Args:
        rate: readings a second [Hz].
        threshold: least normal force that counts as contact [N].
        noise: standard deviation of the force while there is contact [N].
        gain_error: error of the scale [1].
        largest: force at which the reading saturates [N].

    Assumptions:
        The whole link is the pad: what touches elsewhere on it is felt, too.

    Valid range:
        Rates up to that of the simulation.

    Limitations:
        No spatial resolution, no hysteresis, no drift; shear is not read.

    References:
        Jamali et al. 2015, A new design of a fingertip for the iCub hand, IROS: forces from 0.05 N
        on are felt. Noise and scale are chosen.

    Example:
        >>> SensorContact(threshold=0.1).channels()
        {'contact': 1, 'pressing': 1}
    """

    rate: float = setting(250.0, "Hz", bounds=(0.01, 1e5), source="chosen")
    threshold: float = param(
        0.05, "N", bounds=(1e-9, 1e4), tolerance=0.01, source="Jamali et al. 2015", fit=False
    )
    noise: float = param(0.02, "N", bounds=(0.0, 1e3), tolerance=0.01, source="chosen")
    gain_error: float = param(0.0, "1", bounds=(-0.9, 0.9), tolerance=0.05, source="chosen")
    largest: float = setting(50.0, "N", bounds=(1e-6, 1e6), source="chosen")

    late: ClassVar[bool] = True

    def channels(self) -> dict[str, int]:
        """Return the channels."""
        return {"contact": 1, "pressing": 1}

    def start(self, rng: np.random.Generator) -> Any:
        """Return impulse and time since the last reading, both zero."""
        return 0.0, 0.0

    def draws(self) -> int:
        """Return how many numbers a reading draws."""
        return 1

    def passed(self, memory: Any, noise: Floats) -> Any:
        """Return impulse and time since the last reading, both zero."""
        return 0.0, 0.0

    def taken(self, felt: SensorInput, memory: Any, noise: Floats) -> tuple[dict[str, Floats], Any]:
        """Return readings without contact; the first one has what was left from before."""
        found = {name: np.zeros((len(noise), 1)) for name in self.channels()}
        first = self._reading(memory[0] / (memory[1] + felt.step), noise.item(0))
        for name, values in first.items():
            found[name][0] = values
        return found, (0.0, 0.0)

    def sense(
        self, felt: SensorInput, memory: Any, rng: np.random.Generator, *, due: bool
    ) -> tuple[dict[str, Floats] | None, Any]:
        """Return a reading when due; one draw of noise, contact or not."""
        impulse, span = memory[0] + felt.pressing * felt.step, memory[1] + felt.step
        if not due:
            return None, (impulse, span)
        force = impulse / span if span > 0.0 else felt.pressing
        return self._reading(force, float(rng.standard_normal())), (0.0, 0.0)

    def _reading(self, force: float, noise: float) -> dict[str, Floats]:
        """Reading of a mean force [N] with a draw of noise."""
        touches = force >= self.threshold
        read = min(max(force * (1.0 + self.gain_error) + self.noise * noise, 0.0), self.largest)
        pressing = read if touches and math.isfinite(read) else 0.0
        return {"contact": np.array([float(touches)]), "pressing": np.array([pressing])}
