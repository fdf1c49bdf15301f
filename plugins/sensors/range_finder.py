"""Range finder or altimeter: distance to the nearest object along a ray or in a cone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.effects.effect import MediumKind
from seals.field_roles import roles
from seals.schema import check_order, param, setting
from seals.sensors.instrument import Instrument, TrueValues
from seals.sensors.noise import Noise
from seals.sensors.protocol import SensorInput

RINGS, SPOKES = 2, 8
"""Rays of a cone: rings about the axis, rays of a ring."""


@roles(data="meets_surface")
@dataclass(kw_only=True)
class SensorRangeFinder(Instrument):
    """Distance along the sensor's x axis to ground, shore, obstacles, bodies and water surface.

    Equation:
        range = min over the rays of the distance to the first thing hit, times (1 + gain_error),
        plus bias and noise. range_valid is 1 between ``nearest`` and ``farthest``; otherwise it is
        0 and there is not a range.

    Args:
        rate: readings a second [Hz].
        nearest: least distance [m].
        farthest: largest distance [m].
        beam_width: full angle of the cone; 0 for one ray [rad].
        noise: standard deviation at no distance [m].
        noise_share: standard deviation that grows with the distance, added in squares [1].
        bias: constant error [m].
        gain_error: error of the scale, as from a wrong speed of sound [1].
        resolution: quantisation, 0 for none [m].
        medium: in which it works: ``water`` (an altimeter), ``air``, or ``any``.
        meets_surface: whether the water surface returns the beam, as it does sound; without it a
            beam that crosses the surface is lost.

    Assumptions:
        Everything returns the beam, at any angle. Of a cone the nearest return counts.

    Valid range:
        Surroundings that are smooth over the width of the beam.

    Limitations:
        A cone is seventeen rays: what lies between them is not seen. Other bodies are seen by their
        hulls, those without a hull, and the robot itself, not at all.

    References:
        Blue Robotics Ping user manual: up to 100 m, 25 deg. Benewake TFmini Plus data sheet: 0.1 to
        12 m, 5 cm up to 6 m and 1 % beyond, 3.6 deg, steps of 5 mm. Its 5 cm are the bound of all
        errors; the noise of single readings is chosen.

    Example:
        >>> SensorRangeFinder(rpy=[0.0, 1.5708, 0.0]).channels()
        {'range': 1, 'range_valid': 1}
    """

    rate: float = setting(20.0, "Hz", bounds=(0.01, 1e4), source="chosen")
    nearest: float = setting(0.1, "m", bounds=(0.0, 1e4), source="TFmini")
    farthest: float = setting(12.0, "m", bounds=(1e-3, 1e4), source="TFmini")
    beam_width: float = setting(0.0, "rad", bounds=(0.0, 3.0), source="chosen: one ray")
    noise: float = param(0.01, "m", bounds=(0.0, 100.0), tolerance=0.01, source="chosen")
    noise_share: float = param(0.005, "1", bounds=(0.0, 1.0), tolerance=0.005, source="chosen")
    bias: float = param(0.0, "m", bounds=(-100.0, 100.0), tolerance=0.02, source="chosen")
    gain_error: float = param(0.0, "1", bounds=(-0.5, 0.5), tolerance=0.01, source="chosen")
    resolution: float = setting(0.005, "m", bounds=(0.0, 100.0), source="TFmini: 5 mm")
    medium: MediumKind = MediumKind.any
    meets_surface: bool = True

    def __post_init__(self) -> None:
        """Compute the directions of the rays."""
        super().__post_init__()
        check_order(self, "nearest", "farthest", where="range_finder")
        self._rays = _cone(self.beam_width)

    def channels(self) -> dict[str, int]:
        """Return the channels."""
        return {"range": 1, "range_valid": 1}

    def look(self, felt: SensorInput, own: Any) -> tuple[TrueValues | None, Any]:
        """Return the distance, infinite where nothing returns the beam."""
        way = math.inf
        works = self.medium is MediumKind.any
        if not works:
            wet = felt.around.wet(felt.time, felt.position)
            works = wet == (self.medium is MediumKind.water)
        if works:
            way = float(self._ways(felt).min())
        if not self.nearest <= way <= self.farthest:
            return {"range_valid": np.zeros(1)}, own
        return {"range": np.array([way]), "range_valid": np.ones(1)}, own

    def noise_laws(self) -> Mapping[str, Noise]:
        """Return the error models of the range."""
        law = Noise(
            sigma=self.noise,
            share=self.noise_share,
            bias=self.bias,
            gain=self.gain_error,
            step=self.resolution,
        )
        return {"range": law}

    def _ways(self, felt: SensorInput) -> Floats:
        """Distances along all rays."""
        around, here = felt.around, felt.position
        rays = self._rays @ felt.rotation.T
        found = np.minimum(around.ground_ahead(here, rays), around.bodies_ahead(here, rays))
        crossing = around.water(felt.time, here, rays, np.minimum(found, self.farthest))
        if self.meets_surface:
            return np.minimum(found, crossing)
        return np.where(crossing < found, math.inf, found)


def _cone(width: float) -> Floats:
    """Rays of a cone about x, shape (n, 3)."""
    rays = [np.array([[1.0, 0.0, 0.0]])]
    turn = 2.0 * math.pi * np.arange(SPOKES) / SPOKES
    for k in range(1, RINGS + 1 if width > 0.0 else 1):
        angle = 0.5 * width * k / RINGS
        flat = math.sin(angle)
        along = np.full(SPOKES, math.cos(angle))
        rays.append(np.stack([along, flat * np.cos(turn), flat * np.sin(turn)], axis=1))
    return np.concatenate(rays)
