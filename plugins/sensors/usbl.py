"""Acoustic positioning: range and direction of a transponder."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.errors import refuse_unlisted
from seals.field_roles import roles
from seals.schema import param, vector
from seals.sensors.instrument import Instrument, TrueValues
from seals.sensors.noise import Noise
from seals.sensors.protocol import SensorInput

_EVOLOGICS = "class of EvoLogics S2C R 18/34: 0.1 deg, 1 cm"


@roles(data="target")
@dataclass(kw_only=True)
class SensorUsbl(Instrument):
    """Range, bearing and elevation of a transponder by sound (ultra-short baseline).

    Equation:
        range = r c_0 / c plus noise, c the speed of sound (Mackenzie 1981) half-way and c_0 the
        one that the receiver takes; bearing atan2(y, x) and elevation asin(z / r) in its axes.
        acoustic_valid is 1 where both are under water, nothing stands between them, and r is below
        ``farthest``; otherwise it is 0 and there is nothing else.

    Args:
        rate: interrogations a second [Hz].
        target: object that carries the transponder, at its origin; empty for one at ``place``.
        place: of the transponder, world [m].
        farthest: largest range [m].
        assumed_speed: speed of sound that the receiver takes [m/s].
        noise: standard deviation of the range [m].
        angle_noise: standard deviation of bearing and elevation [rad].

    Assumptions:
        Straight rays; the transponder stands still while sound travels.

    Valid range:
        Ranges far above the receiver's own size.

    Limitations:
        The time of travel does not delay a reading: state it as ``latency``; ``modem`` does. No
        echoes.

    References:
        Mackenzie 1981, J. Acoust. Soc. Am. 70, 807.

    Example:
        >>> list(SensorUsbl().channels())
        ['acoustic_range', 'acoustic_bearing', 'acoustic_elevation', 'acoustic_valid']
    """

    rate: float = param(1.0, "Hz", bounds=(0.001, 1e3), tolerance=0.0, source="chosen", fit=False)
    target: str = ""
    place: list[float] = vector((3.0, 0.0, -4.0), "m", bounds=(-1e5, 1e5), source="chosen")
    farthest: float = param(
        3500.0, "m", bounds=(0.1, 1e5), tolerance=0.0, source=_EVOLOGICS, fit=False
    )
    assumed_speed: float = param(
        1500.0, "m/s", bounds=(1300.0, 1700.0), tolerance=0.0, source="usual", fit=False
    )
    noise: float = param(0.01, "m", bounds=(0.0, 100.0), tolerance=0.01, source=_EVOLOGICS)
    angle_noise: float = param(0.0017, "rad", bounds=(0.0, 1.0), tolerance=0.001, source=_EVOLOGICS)

    def channels(self) -> dict[str, int]:
        """Return the channels."""
        names = ("range", "bearing", "elevation", "valid")
        return {f"acoustic_{name}": 1 for name in names}

    def look(self, felt: SensorInput, own: Any) -> tuple[TrueValues | None, Any]:
        """Return range and direction.

        Raises:
            ConfigError: a target is named that is not in the scene.
        """
        if self.target:
            refuse_unlisted(
                self.target,
                felt.others,
                f"usbl needs the target '{self.target}', which is not in the scene",
                label="Objects",
            )
        there = felt.others[self.target] if self.target else np.asarray(self.place, dtype=float)
        offset = there - felt.position
        way = float(np.linalg.norm(offset))
        speed = felt.around.sound(felt.time, felt.position, there, self.farthest)
        if speed is None:
            return {"acoustic_valid": np.zeros(1)}, own
        x, y, z = (offset @ felt.rotation).tolist()
        seen = {
            "acoustic_range": way * self.assumed_speed / speed,
            "acoustic_bearing": math.atan2(y, x),
            "acoustic_elevation": math.asin(max(-1.0, min(1.0, z / way))),
            "acoustic_valid": 1.0,
        }
        return {name: np.array([value]) for name, value in seen.items()}, own

    def noise_laws(self) -> Mapping[str, Noise]:
        """Return the error models."""
        angle = Noise(sigma=self.angle_noise)
        laws = {"acoustic_bearing": angle, "acoustic_elevation": angle}
        return {"acoustic_range": Noise(sigma=self.noise), **laws}
