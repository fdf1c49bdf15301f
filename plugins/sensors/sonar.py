"""Sonar: forward-looking, multibeam or side-scan, in one model."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.schema import check_order, check_tree, count, param
from seals.sensors.acoustics import absorption, line_pattern, linear
from seals.sensors.casting import MOST_RAYS, Hits, Scan, cast, counts, fan
from seals.sensors.echoes import Echoes, scattered
from seals.sensors.mount import Mount, PicturingSensor
from seals.sensors.protocol import SensorInput
from seals.sensors.surroundings import Surroundings
from seals.sensors.tensor_echoes import PingLayout, TensorEchoes

CENTIBEL = 0.01
"""Unit of a file of levels [dB]."""
_FINE = 4.0
"""Columns of rays in the width of a beam."""
_BEYOND = 2.0
"""Length of the rays over the largest range [1]."""
_SHOWN = 45.0
"""Levels between black and white of a picture [dB]."""
_WHITE = 0.995
"""Share of a picture's pixels that are below white [1]."""
_BOTTOM = ("tank_bottom", "ground_level", "slope", "land")
_OCULUS = "Blueprint Subsea, Oculus M750d data sheet"
_CHOSEN = "chosen"
_DEVICES = ("numpy", "cpu", "cuda")


@roles(data="strengths speckle multipath profile device")
@dataclass(kw_only=True)
class SensorSonar(PicturingSensor):
    """Sonar: echo level over bearing and range; looks along its x axis, beams fan out about z.

    Equation:
        E = S + 10 lg(sum over the rays of b_t b_r m cos(i) W / r^2) - 2 a r, the sonar equation
        with spherical spreading, absorption a (Francois and Garrison) and Lambert's law; W is the
        solid angle of a ray, i its incidence, m the scattering strength of what it meets. Vertical
        patterns of transmitter and receiver are those of line arrays, likewise the receiver's
        across the beams; the transmitter lights the sector evenly. Speckle and noise: intensity is
        (echo + noise) times a standard exponential variate, so amplitude is Rayleigh distributed.

    Args:
        position: of the sensor in link axes [m].
        rpy: turn of its axes (x ahead, z up) against those of the link [rad].
        rate: pings a second [Hz].
        frequency: of the sound [Hz].
        beams: number of beams, from left to right.
        bins: number of range bins.
        rays: rays in a column, over twice the vertical width.
        sector: between the axes of the outer beams [rad].
        beam_width: half-power width of a beam across the sector, one way [rad].
        vertical_width: half-power width of transmitter and of receiver, one way each [rad].
        nearest: range where the first bin begins [m].
        farthest: range where the last bin ends [m].
        pulse: length of the pulse in range, c tau / 2 or c / (2 B); 0 for one bin [m].
        source_level: at 1 m on the axis [dB re 1 uPa].
        noise: level at the receiver's output [dB re 1 uPa].
        bottom: Lambert strength of bottom, slope and land [dB].
        obstacles: Lambert strength of obstacles [dB].
        bodies: Lambert strength of other robots and objects [dB].
        surface: Lambert strength of the water surface from below [dB].
        strengths: Lambert strengths of single obstacles by name [dB].
        acidity: pH of the water [1].
        speckle: whether echoes and noise fluctuate.
        multipath: whether echoes by way of the surface arrive as well.
        surface_loss: lost at each reflection by the surface [dB].
        profile: whether the first strong return of each beam is logged as ``sonar_range``.
        threshold: of a return over the noise level [dB].
        device: ``numpy``, or ``cpu`` or ``cuda`` for PyTorch in double precision: echoes are those
            of NumPy to rounding, speckle has other random numbers; without multipath.

    Assumptions:
        Straight rays at one speed of sound; the ping is one instant; echoes add without phase. The
        water surface is smooth and level, in waves at its height above the sensor.

    Valid range:
        Targets in the far field, larger than the distance between rays. Absorption: 200 Hz to
        1 MHz.

    Limitations:
        Other bodies are seen by their hulls, the robot itself not at all. Echoes by way of the
        bottom, by way of bodies, and of volume reverberation are left out. What pierces the surface
        hides nothing behind it from reflected rays.

    References:
        Urick 1983, Principles of Underwater Sound; Mackenzie 1961, J. Acoust. Soc. Am. 33, 1498
        (bottom, -27 dB); Mellen 1952, J. Acoust. Soc. Am. 24, 478 (thermal noise); Goodman 1985,
        Statistical Optics (speckle).

    Example:
        >>> SensorSonar(beams=64, profile=True).channels()
        {'picture': 1, 'sonar_range': 64}
    """

    rate: float = param(10.0, "Hz", bounds=(0.01, 1e4), tolerance=0.0, source=_CHOSEN, fit=False)
    frequency: float = param(
        750e3, "Hz", bounds=(200.0, 5e6), tolerance=0.0, source=_OCULUS, fit=False
    )
    beams: int = count(256, bounds=(1, 4096))
    bins: int = count(256, bounds=(2, 2048))
    rays: int = count(32, bounds=(1, 1024))
    sector: float = param(
        2.269, "rad", bounds=(0.0, 3.1), tolerance=0.0, source=f"{_OCULUS}: 130 deg", fit=False
    )
    beam_width: float = param(
        0.01745, "rad", bounds=(1e-4, 1.5), tolerance=0.0, source=f"{_OCULUS}: 1 deg", fit=False
    )
    vertical_width: float = param(
        0.349, "rad", bounds=(1e-4, 1.5), tolerance=0.0, source=f"{_OCULUS}: 20 deg", fit=False
    )
    nearest: float = param(0.2, "m", bounds=(0.0, 1e4), tolerance=0.0, source=_CHOSEN, fit=False)
    farthest: float = param(20.0, "m", bounds=(1e-2, 1e4), tolerance=0.0, source=_CHOSEN, fit=False)
    pulse: float = param(0.0, "m", bounds=(0.0, 100.0), tolerance=0.0, source=_CHOSEN, fit=False)
    source_level: float = param(190.0, "dB", bounds=(0.0, 250.0), tolerance=5.0, source=_CHOSEN)
    noise: float = param(
        60.0,
        "dB",
        bounds=(0.0, 250.0),
        tolerance=10.0,
        source="Mellen 1952: -15 + 20 lg(f / kHz) + 10 lg(60 kHz / Hz) - 30 dB of directivity",
    )
    bottom: float = param(-27.0, "dB", bounds=(-80.0, 0.0), tolerance=5.0, source="Mackenzie 1961")
    obstacles: float = param(-15.0, "dB", bounds=(-80.0, 0.0), tolerance=10.0, source=_CHOSEN)
    bodies: float = param(-10.0, "dB", bounds=(-80.0, 0.0), tolerance=10.0, source=_CHOSEN)
    surface: float = param(-40.0, "dB", bounds=(-80.0, 0.0), tolerance=10.0, source=_CHOSEN)
    strengths: dict[str, float] = field(default_factory=dict)
    acidity: float = param(8.0, "1", bounds=(6.0, 9.0), tolerance=0.2, source="ocean water")
    speckle: bool = True
    multipath: bool = False
    surface_loss: float = param(1.0, "dB", bounds=(0.0, 60.0), tolerance=1.0, source=_CHOSEN)
    profile: bool = False
    threshold: float = param(
        13.0, "dB", bounds=(0.0, 100.0), tolerance=0.0, source=_CHOSEN, fit=False
    )
    device: str = "numpy"

    records: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Check the numbers; lay out rays and patterns."""
        check_tree(self, where="sonar")
        check_order(self, "nearest", "farthest", where="sonar")
        if self.device not in _DEVICES or (self.multipath and self.device != "numpy"):
            allowed = "numpy" if self.multipath else ", ".join(_DEVICES)
            raise ConfigError(
                f"sonar.device={self.device} is not allowed"
                f"{' with multipath' if self.multipath else ''}.\nAllowed: {allowed}"
            )
        self.mount = Mount("sonar", self.position, self.rpy)
        self.size = (self.farthest - self.nearest) / self.bins
        many = np.linspace(0.5, -0.5, self.beams) * self.sector
        self.bearings = many if self.beams > 1 else np.zeros(1)
        self._lay_out()
        self._fan = fan(self.bearings, self.nearest, self.farthest, self.bins)
        self._there: TensorEchoes | None = None

    def _lay_out(self) -> None:
        """Directions of the rays, row by row, their weights, and the beams' patterns."""
        spacing = self.sector / max(self.beams - 1, 1) or self.beam_width
        widest = 0.5 * self.sector + self.beam_width
        count = max(math.ceil(2.0 * widest / min(spacing, self.beam_width / _FINE)), 1)
        tables = max(self.rays, self.beams, self.bins) * count
        if tables > MOST_RAYS:
            raise ConfigError(
                f"sonar: beams={self.beams}, bins={self.bins} and rays={self.rays} in {count:,} "
                f"columns of a quarter of beam_width are {tables:,} values.\n"
                f"Allowed: {MOST_RAYS:,}; use fewer, a narrower sector or wider beams."
            )
        self.columns, self.step = count, min(2.0 * self.vertical_width, math.pi) / self.rays
        psi = widest * (1.0 - (2.0 * np.arange(count) + 1.0) / count)
        phi = self.step * (np.arange(self.rays) + 0.5 - 0.5 * self.rays)
        phi, azimuth = (x.ravel() for x in np.meshgrid(phi, psi, indexing="ij"))
        flat = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros_like(phi)], axis=1)
        up = np.array([0.0, 0.0, 1.0])
        self._rays = np.cos(phi)[:, None] * flat + np.sin(phi)[:, None] * up
        self._across = -np.sin(phi)[:, None] * flat + np.cos(phi)[:, None] * up
        self._vertical = line_pattern(phi, self.vertical_width)
        self._solid = np.cos(phi) * self.step * 2.0 * widest / count
        off = psi[None, :] - self.bearings[:, None]
        self._beams = line_pattern(off, self.beam_width).astype(np.float32)

    def channels(self) -> dict[str, int]:
        """Return the channels: the number of the image, and the profile."""
        return {"picture": 1} | ({"sonar_range": self.beams} if self.profile else {})

    def described(self) -> dict[str, Any]:
        """Return bearings, ranges and units of the images."""
        return {
            "what": ["level"],
            "bearings": self.bearings.tolist(),
            "nearest": self.nearest,
            "bin": self.size,
            "level_unit": CENTIBEL,
        }

    def sense(
        self, felt: SensorInput, memory: Any, rng: np.random.Generator, *, due: bool
    ) -> tuple[dict[str, Floats] | None, Any]:
        """Ping when due and under water."""
        here = self.mount.felt(felt)
        if not due or not felt.around.wet(felt.time, here.position):
            return None, memory
        level = self.ping(here, rng)
        if felt.camera is not None:
            images = {".png": self.shown(level), "_level.png": counts(level.T, CENTIBEL)}
            scan = Scan(memory, felt.time, images, here.position, here.rotation)
            felt.camera.keep(scan)
        reading = {"picture": np.array([float(memory)])}
        if self.profile:
            reading["sonar_range"] = self.first_returns(level)
        return reading, memory + 1

    def ping(self, felt: SensorInput, rng: np.random.Generator) -> Floats:
        """Return the levels of one ping [dB re 1 uPa], shape (beams, bins).

        Args:
            felt: the instant at the sensor, in its axes.
            rng: random state of speckle and noise.
        """
        source, noise = linear(self.source_level), linear(self.noise)
        if self.device != "numpy":
            seed = int(rng.integers(2**62)) if self.speckle else None
            return self._tensors().levels(
                self._tensor_echo(felt), source=source, noise=noise, seed=seed
            )
        mean = source * self.echo(felt) + noise
        if self.speckle:
            mean *= rng.standard_exponential(mean.shape)
        return 10.0 * np.log10(np.maximum(mean, 1e-3))

    def echo(self, felt: SensorInput) -> Floats:
        """Return mean intensities relative to the source's at 1 m, shape (beams, bins)."""
        if self.device != "numpy":
            there: Floats = self._tensor_echo(felt).cpu().numpy().astype(float)
            return there
        columns = sum(
            echoes.over_range(
                self.columns,
                self.bins,
                nearest=self.nearest,
                size=self.size,
                pulse=self.pulse or self.size,
            )
            for echoes in self._echoes(felt)
        )
        return (self._beams @ np.asarray(columns, dtype=np.float32)).astype(float)

    def _echoes(self, felt: SensorInput) -> list[Echoes]:
        """Echoes of all rays: direct ones, and those by way of the surface."""
        around, here = felt.around, felt.position
        ways, across = self._rays @ felt.rotation.T, self._across @ felt.rotation.T
        shapes = [*around.ground, *around.bodies()]
        strengths = self._strengths(around, len(shapes))
        # cells that are met beyond the last bin may begin before it
        reach = _BEYOND * self.farthest
        hits = cast(shapes, here, ways, reach)
        short = np.minimum(hits.distance, reach)
        crossing = around.water(felt.time, here, ways, short, level=True)
        out = crossing < hits.distance
        met = Hits(
            np.where(out, crossing, hits.distance),
            np.where(out[:, None], np.array([0.0, 0.0, -1.0]), hits.normal),
            np.where(out, len(shapes), hits.shape),
        )
        loss = self._loss(felt)
        found = scattered(met, ways, across, strengths[met.shape], loss=loss, step=self.step)
        weight = self._solid * self._vertical**2
        echoes = [found._replace(power=found.power * weight)]
        if self.multipath and out.any():
            echoes += self._reflected(felt, shapes, strengths, (ways, across, crossing), loss)
        return echoes

    def _loss(self, felt: SensorInput) -> float:
        """Absorption in the water at the sensor [dB/m]."""
        around = felt.around
        level = float(around.surface(felt.time, felt.position[None])[0])
        depth = max(level - float(felt.position[2]), 0.0)
        return absorption(
            self.frequency,
            temperature=around.temperature(depth),
            salinity=around.salinity(depth),
            depth=depth,
            acidity=self.acidity,
        )

    def _tensors(self) -> TensorEchoes:
        """The layout of rays on the device, made at the first ping."""
        if self._there is None:
            weight = self._solid * self._vertical**2
            layout = PingLayout(
                *(self._rays, self._across, weight, self._beams, self.bins, self.nearest),
                *(self.size, self.pulse or self.size, self.step, _BEYOND * self.farthest),
            )
            self._there = TensorEchoes(layout, self.device)
        return self._there

    def _tensor_echo(self, felt: SensorInput) -> Any:
        """Mean intensities as a tensor on the device."""
        around = felt.around
        shapes = [*around.ground, *around.bodies()]
        return self._tensors().intensities(
            shapes,
            self._strengths(around, len(shapes)),
            (felt.position, felt.rotation),
            surface=float(around.surface(felt.time, felt.position[None])[0]),
            loss=self._loss(felt),
        )

    def _strengths(self, around: Surroundings, count: int) -> Floats:
        """Lambert's strength of every shape, of the surface, and zero for nothing (the last)."""
        ground = [
            self.strengths.get(name, self.bottom if name in _BOTTOM else self.obstacles)
            for name in around.ground_names
        ]
        levels = [*ground, *[self.bodies] * (count - len(ground)), self.surface]
        return np.append(10.0 ** (0.1 * np.array(levels)), 0.0)

    def _reflected(
        self,
        felt: SensorInput,
        shapes: list[Any],
        strengths: Floats,
        rays: tuple[Floats, Floats, Floats],
        loss: float,
    ) -> list[Echoes]:
        """Echoes out and back by way of the surface, and one way by it and the other direct.

        Equation:
            The image of the sonar in the surface sends the reflected ray, of length l; the straight
            way to what it meets is d. Both ways reflected: as a direct echo from l, less twice the
            loss. Mixed: at (l + d) / 2, 2 b_l b_d m cos(i_d) W / d^2 10^(-a (l + d) / 10), less the
            loss once; 2 for the two orders.
        """
        ways, across, crossing = rays
        up = np.flatnonzero(np.isfinite(crossing))
        level = float(felt.around.surface(felt.time, felt.position[None])[0])
        flip = np.array([1.0, 1.0, -1.0])
        image = felt.position * flip + np.array([0.0, 0.0, 2.0 * level])
        hits = cast(shapes, image, ways[up] * flip, _BEYOND * self.farthest)
        below = hits.distance > crossing[up]
        hits = hits._replace(distance=np.where(below, hits.distance, math.inf))
        lost, strength = linear(-self.surface_loss), strengths[hits.shape]
        both = scattered(
            hits, ways[up] * flip, across[up] * flip, strength, loss=loss, step=self.step
        )
        weight, pattern = self._solid[up], self._vertical[up]
        out = self._whole(up, both._replace(power=both.power * weight * (pattern * lost) ** 2))
        met = np.isfinite(hits.distance)
        straight = image + np.where(met, hits.distance, 0.0)[:, None] * ways[up] * flip
        straight = straight - felt.position
        way = np.maximum(np.linalg.norm(straight, axis=1), 1e-6)
        straight /= way[:, None]
        seen = cast(shapes, felt.position, straight, 2.0 * way.max()).distance > way * (1.0 - 1e-5)
        facing = np.maximum(-np.sum(hits.normal * straight, axis=1), 0.0)
        rise = np.arcsin(np.clip(straight @ felt.rotation[:, 2], -1.0, 1.0))
        heard = pattern * line_pattern(rise, self.vertical_width)
        length = np.where(met, hits.distance, 1.0)
        power = 2.0 * lost * heard * strength * facing * weight / (way * way)
        power *= 10.0 ** (-0.1 * loss * (length + way))
        mixed = Echoes(0.5 * (length + way), both.extent, np.where(met & seen, power, 0.0))
        return [out, self._whole(up, mixed)]

    def _whole(self, rays: Any, part: Echoes) -> Echoes:
        """Echoes of some rays among those of all."""
        whole = Echoes(*(np.zeros(len(self._rays)) for _ in range(3)))
        for into, values in zip(whole, part, strict=True):
            into[rays] = values
        return whole

    def first_returns(self, level: Floats) -> Floats:
        """Return the range of the first bin within 3 dB of each beam's maximum [m].

        It is not a number where the maximum is less than the threshold above the noise.

        Args:
            level: of a ping, shape (beams, bins).
        """
        top = level.max(axis=1)
        first = np.argmax(level >= top[:, None] - 3.0, axis=1)
        return np.where(
            top >= self.noise + self.threshold, self.nearest + (first + 0.5) * self.size, np.nan
        )

    def shown(self, level: Floats) -> Any:
        """Return a picture of a ping from above, brightness corrected for spreading, 8 bits."""
        way = self.nearest + (np.arange(self.bins) + 0.5) * self.size
        even = level + (30.0 * np.log10(way))[None, :]
        # a mirror-like wall is far above all else: it saturates, and the floor stays visible
        white = float(np.quantile(even, _WHITE))
        grey = np.clip((even - (white - _SHOWN)) * (255.0 / _SHOWN), 0.0, 255.0)
        return np.append(grey.astype(np.uint8).ravel(), np.uint8(0))[self._fan]
