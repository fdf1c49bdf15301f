"""Locator: relative position of another body, like a camera with an object detector."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Floats
from seals.errors import refuse_unlisted
from seals.field_roles import roles
from seals.schema import param, setting
from seals.sensors.mount import MountedSensor
from seals.sensors.protocol import SensorInput


@roles(data="target")
@dataclass(kw_only=True)
class SensorLocator(MountedSensor):
    """Position of another body relative to a link, link axes.

    Equation:
        offset = R_WL^T (p_target - p_link) + sigma |offset| n, n standard normal in three
        components; seen is 1 within the range, and 0 with a zero offset beyond it.

    Args:
        target: name of the object in the run.
        rate: readings a second [Hz].
        noise: standard deviation of each component as a share of the distance [1].
        floor: standard deviation added at any distance [m].
        farthest: range [m].

    Assumptions:
        The target is in sight: nothing hides it, and the field of view is wide.

    Valid range:
        Rates up to that of the simulation.

    Limitations:
        The truth with noise in place of images; no outliers, no orientation.

    References:
        None for the numbers: a share of the distance, as that of a fiducial marker, is chosen.

    Example:
        >>> SensorLocator(target="cube").channels()
        {'offset': 3, 'seen': 1}
    """

    target: str = ""
    rate: float = setting(50.0, "Hz", bounds=(0.01, 1e5), source="chosen")
    noise: float = param(0.01, "1", bounds=(0.0, 1.0), tolerance=0.005, source="chosen: 1 %")
    floor: float = param(0.001, "m", bounds=(0.0, 1.0), tolerance=0.001, source="chosen")
    farthest: float = setting(20.0, "m", bounds=(1e-3, 1e5), source="chosen")

    idles: ClassVar[bool] = True

    def channels(self) -> dict[str, int]:
        """Return the channels."""
        return {"offset": 3, "seen": 1}

    def start(self, rng: np.random.Generator) -> Any:
        """Return an empty state."""
        return ()

    def sense(
        self, felt: SensorInput, memory: Any, rng: np.random.Generator, *, due: bool
    ) -> tuple[dict[str, Floats] | None, Any]:
        """Return a reading when due.

        Raises:
            ConfigError: a target is named that is not in the scene.
        """
        if not due:
            return None, memory
        noise = rng.standard_normal(3)
        if self.target:
            refuse_unlisted(
                self.target,
                felt.others,
                f"a locator looks for '{self.target}', which is not in the scene",
                label="Objects",
            )
        offset = np.zeros(3)
        if self.target:
            offset = (felt.others[self.target] - felt.position) @ felt.rotation
        distance = math.sqrt(float(offset @ offset))
        seen = bool(self.target) and distance <= self.farthest
        read = offset + math.hypot(self.noise * distance, self.floor) * noise
        return {"offset": read if seen else np.zeros(3), "seen": np.array([float(seen)])}, memory
