"""Lidar: ranges over one plane or over several rings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.schema import check_order, check_tree, count, param
from seals.sensors.casting import MOST_RAYS, Scan, cast, counts
from seals.sensors.mount import Mount, PicturingSensor
from seals.sensors.protocol import SensorInput

_VLP = "Velodyne VLP-16 data sheet"
_CHOSEN = "chosen"


@dataclass(kw_only=True)
class SensorLidar(PicturingSensor):
    """Lidar in air: first return of every ray; x ahead, z up, rays from left to right.

    Equation:
        The range is the distance to the first thing hit plus normal noise. A return is lost by
        chance, and where r > farthest sqrt(cos i), i the incidence: light from a diffuse surface
        larger than the beam falls with cos(i) / r^2.

    Args:
        position: of the sensor in link axes [m].
        rpy: turn of its axes (x ahead, z up) against those of the link [rad].
        rate: turns a second [Hz].
        points: rays of a ring.
        rings: number of rings; 1 for a plane.
        sector: between the first and the last ray of a ring, 6.2832 for all around [rad].
        vertical_width: between the lowest and the highest ring [rad].
        nearest: least range [m].
        farthest: largest range, at normal incidence [m].
        noise: standard deviation of a range [m].
        missed: share of the returns that are lost by chance [1].
        sectors: number of equal parts of the sector whose nearest ranges are logged.

    Assumptions:
        A turn is one instant. Surfaces are diffuse and equally bright. Water swallows the light;
        its surface is level, in waves at its height below the sensor.

    Valid range:
        Clear air.

    Limitations:
        No second returns, no edges hit by half; other bodies are seen by their hulls, the robot
        itself not at all. Under water nothing is read.

    References:
        Velodyne VLP-16 data sheet: 16 rings over 30 deg, 100 m, +-3 cm, 5 to 20 Hz.

    Example:
        >>> SensorLidar(rings=16).channels()
        {'picture': 1, 'lidar_range': 8}
    """

    rate: float = param(10.0, "Hz", bounds=(0.01, 1e4), tolerance=0.0, source=_VLP, fit=False)
    points: int = count(360, bounds=(1, 65_536))
    rings: int = count(1, bounds=(1, 1024))
    sector: float = param(
        2.0 * math.pi, "rad", bounds=(0.0, 6.2832), tolerance=0.0, source=_VLP, fit=False
    )
    vertical_width: float = param(
        0.5236, "rad", bounds=(0.0, 3.1), tolerance=0.0, source=f"{_VLP}: 30 deg", fit=False
    )
    nearest: float = param(0.1, "m", bounds=(0.0, 1e4), tolerance=0.0, source=_CHOSEN, fit=False)
    farthest: float = param(100.0, "m", bounds=(1e-2, 1e4), tolerance=0.0, source=_VLP, fit=False)
    noise: float = param(0.03, "m", bounds=(0.0, 10.0), tolerance=0.02, source=f"{_VLP}: 3 cm")
    missed: float = param(0.005, "1", bounds=(0.0, 1.0), tolerance=0.005, source=_CHOSEN)
    sectors: int = count(8, bounds=(1, 65_536))

    records: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Check the numbers and lay out the rays."""
        check_tree(self, where="lidar")
        if self.points * self.rings > MOST_RAYS or self.sectors > self.points:
            raise ConfigError(
                f"lidar: points={self.points} in rings={self.rings}, sectors={self.sectors}.\n"
                f"Allowed: {MOST_RAYS:,} together, and at most as many sectors as points."
            )
        check_order(self, "nearest", "farthest", where="lidar")
        self.mount = Mount("lidar", self.position, self.rpy)
        self.unit = 0.001 if self.farthest <= 65.0 else 0.001 * math.ceil(self.farthest / 65.0)
        whole = self.sector > 2.0 * math.pi - 1e-3
        self.bearings = 0.5 * self.sector * np.linspace(1.0, -1.0, self.points, endpoint=not whole)
        if self.points == 1:
            self.bearings = np.zeros(1)
        rise = 0.5 * self.vertical_width * np.linspace(1.0, -1.0, self.rings)
        self.elevations = rise if self.rings > 1 else np.zeros(1)
        phi, psi = np.meshgrid(self.elevations, self.bearings, indexing="ij")
        ahead = [np.cos(phi) * np.cos(psi), np.cos(phi) * np.sin(psi), np.sin(phi)]
        self._rays = np.stack(ahead, axis=-1).reshape(-1, 3)

    def channels(self) -> dict[str, int]:
        """Return the channels: number of the image, nearest range of every sector."""
        return {"picture": 1, "lidar_range": self.sectors}

    def described(self) -> dict[str, Any]:
        """Return the directions of the rays and the unit of the images."""
        return {
            "what": ["range"],
            "bearings": self.bearings.tolist(),
            "elevations": self.elevations.tolist(),
            "range_unit": self.unit,
        }

    def sense(
        self, felt: SensorInput, memory: Any, rng: np.random.Generator, *, due: bool
    ) -> tuple[dict[str, Floats] | None, Any]:
        """Scan when due, out of the water."""
        here = self.mount.felt(felt)
        if not due or felt.around.wet(felt.time, here.position):
            return None, memory
        ranges = self.scan(here, rng)
        if felt.camera is not None:
            images = {".png": self.shown(ranges), "_range.png": counts(ranges, self.unit)}
            scan = Scan(memory, felt.time, images, here.position, here.rotation)
            felt.camera.keep(scan)
        known = np.where(np.isfinite(ranges), ranges, self.farthest).min(axis=0)
        parts = [float(part.min()) for part in np.array_split(known, self.sectors)]
        reading = {"picture": np.array([float(memory)]), "lidar_range": np.array(parts)}
        return reading, memory + 1

    def scan(self, felt: SensorInput, rng: np.random.Generator) -> Floats:
        """Return the ranges of one turn [m], not a number for none, shape (rings, points).

        Args:
            felt: the instant at the sensor, in its axes.
            rng: random state of noise and losses.
        """
        around, here = felt.around, felt.position
        ways = self._rays @ felt.rotation.T
        hits = cast([*around.ground, *around.bodies()], here, ways, self.farthest)
        short = np.minimum(hits.distance, self.farthest)
        crossing = around.water(felt.time, here, ways, short, level=True)
        facing = np.abs(np.sum(hits.normal * ways, axis=1))
        seen = hits.distance <= self.farthest * np.sqrt(facing)
        seen &= (hits.distance >= self.nearest) & ~(crossing < hits.distance)
        seen &= rng.random(len(ways)) >= self.missed
        noisy = hits.distance + self.noise * rng.standard_normal(len(ways))
        ranges = np.where(seen, np.maximum(noisy, 0.0), np.nan)
        return ranges.reshape(self.rings, self.points)

    def shown(self, ranges: Floats) -> NDArray[np.uint8]:
        """Return a picture: nearer is brighter, black for nothing; rings from the top."""
        near = 1.0 - np.clip(ranges / self.farthest, 0.0, 1.0) ** 0.5
        grey = np.where(np.isfinite(ranges), 30.0 + 225.0 * near, 0.0)
        tall = max(1, 64 // self.rings)
        return np.repeat(grey.astype(np.uint8), tall, axis=0)
