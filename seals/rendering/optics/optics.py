"""Underwater image formation from rendered colour and distance."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from array_api_compat import device
from numpy.typing import NDArray

from seals.arrays import Array, as_like, namespace
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.rendering.optics import chain
from seals.rendering.optics.caustics import Sun
from seals.rendering.optics.path import Medium, sky, sunbeam
from seals.rendering.optics.surface import Surface
from seals.rendering.optics.waters import WAVELENGTHS, Water, backscattering, water_of
from seals.schema import check_tree, count, param, vector

_CHOSEN = "chosen"
_PETZOLD = "Petzold 1972, SIO Ref. 72-78, stations HAOCE 5 and 11, turns below 10 degrees"


class Sight(NamedTuple):
    """Rendered image without water: colour in full light, and distance.

    Args:
        colour: linear radiance, a white surface in full light being one, shape (N, H, W, 3); its
            type is that of the whole computation, float32 as a rule.
        ranges: distance along the line of sight [m], infinite where nothing was hit, shape
            (N, H, W).
        origins: where the lines of sight meet, world [m], shape (N, 3).
        directions: unit, world axes [1], shape (N, H, W, 3).
        normals: of the surfaces hit, unit, world axes [1], shape (N, H, W, 3), if known.
    """

    colour: Array
    ranges: Array
    origins: Array
    directions: Array
    normals: Array | None = None


@roles(data="water_type blur caustics surface noise")
@dataclass(kw_only=True)
class Optics:
    """Settings of the underwater image: water type, blur, caustics, surface, sensor noise.

    Equation:
        I = G[J E(D) exp(-beta_D z)] + B_inf (1 - exp(-beta_B z)), for each of red, green, blue:
        beta_D = a + (1 - f) b, beta_B = a + b_b, E(D) = exp(-K_d D),
        B_inf = b_b E / (2 beta_B), G the blur by the scattering f b into small angles.

    Args:
        water_type: Jerlov's, ``oceanic_1`` to ``oceanic_3`` and ``coastal_1`` to ``coastal_9``;
            ``none`` for no water.
        absorption: a, red, green, blue [1/m]; empty for the water type's.
        scattering: b, red, green, blue [1/m]; empty for the water type's.
        diffuse: K_d, red, green, blue [1/m]; empty for the water type's.
        forward_share: f, share of the scattering that only blurs the picture [1].
        forward_angle: root of the mean square turn of that share [rad].
        backward_share: b_b / b of the particles [1].
        sun_zenith: angle of the sun from straight up [rad].
        sun_azimuth: direction the sun stands in, from east anticlockwise [rad].
        sun_share: share of the irradiance at the surface that comes from the sun itself [1].
        sky_zenith: radiance of the sky straight up, red, green, blue; white in full light is one.
        sky_horizon: radiance of the sky at the horizon.
        port: radius of the dome in front of the camera [m]: a line of sight begins in the water
            where it leaves the dome under the surface.
        exposure: factor on the image [1].
        shot: one over the number of photons that fill a pixel [1].
        read: standard deviation of the reading in the dark, full scale being one [1].
        cells: of the caustics' pattern along an edge; twice the number shows twice the detail and
            costs four times as much.
        rays: of a cell of the pattern along an edge; two instead of one take faint stripes away,
            and cost four times as much.
        blur: whether forward scattering blurs.
        caustics: whether the surface focuses sunlight.
        surface: whether the surface mirrors and bends light, and moves; otherwise lines of sight
            are only cut at its mean level.
        noise: whether the sensor has noise.

    Assumptions:
        One water from the surface to the bottom; one wavelength for each colour; light falls with
        the mean level's depth; the veil is scattered evenly over the back hemisphere.

    Valid range:
        Lines of sight up to a few times 1 / beta_D; sun at least ten degrees up.

    Limitations:
        Lines of sight go straight through the surface: brightness changes there, shapes do not.
        No shadows in the veil, no lamps, no reflections of objects in the surface.

    References:
        Akkaynak and Treibitz 2018, CVPR, doi:10.1109/CVPR.2018.00703; Duntley 1963; McGlamery 1980,
        Proc. SPIE 208, doi:10.1117/12.958279; Gordon 1973, Appl. Opt. 12, 2803.

    Example:
        >>> import numpy as np
        >>> from seals.rendering.optics import SurfaceStill
        >>> optics = Optics(water_type="oceanic_3", blur=False, caustics=False, noise=False)
        >>> ahead = np.zeros((1, 1, 2, 3)) + [1.0, 0.0, 0.0]
        >>> five, white, eye = np.full((1, 1, 2), 5.0), np.ones((1, 1, 2, 3)), [[0.0, 0.0, -2.0]]
        >>> view = Sight(white, five, np.array(eye), ahead)
        >>> optics.look(view, SurfaceStill(), 0.0, None)[0, 0, 0].round(2).tolist()
        [0.12, 0.36, 0.34]
    """

    water_type: str = "none"
    absorption: list[float] = vector((), "1/m", bounds=(0.0, 20.0), source="the water type's")
    scattering: list[float] = vector((), "1/m", bounds=(0.0, 50.0), source="the water type's")
    diffuse: list[float] = vector((), "1/m", bounds=(0.0, 20.0), source="the water type's")
    forward_share: float = param(0.75, "1", bounds=(0.0, 0.95), tolerance=0.1, source=_PETZOLD)
    forward_angle: float = param(0.06, "rad", bounds=(0.0, 0.2), tolerance=0.01, source=_PETZOLD)
    backward_share: float = param(
        0.0183,
        "1",
        bounds=(0.0, 0.5),
        tolerance=0.005,
        source="Petzold's average particle: Mobley 1994, Light and Water, table 3.10",
    )
    sun_zenith: float = param(0.52, "rad", bounds=(0.0, 1.4), tolerance=0.05, source=_CHOSEN)
    sun_azimuth: float = param(0.9, "rad", bounds=(-7.0, 7.0), tolerance=0.05, source=_CHOSEN)
    sun_share: float = param(
        0.75,
        "1",
        bounds=(0.0, 1.0),
        tolerance=0.1,
        source="clear sky: Gregg and Carder 1990, Limnol. Oceanogr. 35, 1657",
    )
    sky_zenith: list[float] = vector((0.12, 0.24, 0.52), "1", bounds=(0.0, 10.0), source=_CHOSEN)
    sky_horizon: list[float] = vector((0.50, 0.60, 0.72), "1", bounds=(0.0, 10.0), source=_CHOSEN)
    port: float = param(0.04, "m", bounds=(0.0, 1.0), tolerance=0.01, source=_CHOSEN, fit=False)
    exposure: float = param(1.0, "1", bounds=(1e-3, 1e3), tolerance=0.1, source=_CHOSEN)
    shot: float = param(
        1e-4, "1", bounds=(0.0, 1.0), tolerance=5e-5, source="a full well of 10^4 electrons"
    )
    read: float = param(1e-3, "1", bounds=(0.0, 1.0), tolerance=5e-4, source="10 electrons of 10^4")
    cells: int = count(64, bounds=(8, 1024))
    rays: int = count(1, bounds=(1, 8))
    blur: bool = True
    caustics: bool = True
    surface: bool = True
    noise: bool = True

    def __post_init__(self) -> None:
        """Refuse unknown water types, values out of bounds and lists of a wrong length."""
        water_of(self.water_type)
        check_tree(self, where="optics")
        for name in ("absorption", "scattering", "diffuse"):
            values = getattr(self, name)
            if len(values) not in (0, 3):
                raise ConfigError(
                    f"optics.{name}={values} has {len(values)} numbers.\n"
                    "Allowed: three numbers for red, green and blue, or none for those of the "
                    "water type."
                )

    @cached_property
    def water(self) -> Water | None:
        """Coefficients of the water, with overrides; None for no water."""
        known = water_of(self.water_type)
        if known is None:
            return None
        return Water(
            absorption=self.absorption or known.absorption,
            scattering=self.scattering or known.scattering,
            diffuse=self.diffuse or known.diffuse,
            source=known.source,
        )

    @cached_property
    def medium(self) -> Medium | None:
        """Coefficients of the water in red, green and blue."""
        if self.water is None:
            return None
        a, b, f = self.water.absorption, self.water.scattering, self.forward_share
        back = [
            backscattering(s, at, self.backward_share) for s, at in zip(b, WAVELENGTHS, strict=True)
        ]
        return Medium(
            direct=tuple(x + (1.0 - f) * y for x, y in zip(a, b, strict=True)),
            veiling=tuple(x + y for x, y in zip(a, back, strict=True)),
            source=tuple(0.5 * self.entering * x for x in back),
            diffuse=tuple(self.water.diffuse),
            spread=f * b[1],
        )

    @cached_property
    def entering(self) -> float:
        """Fraction of the daylight transmitted through the surface [1]."""
        # of evenly bright sky: Preisendorfer 1976; of the sun: Fresnel
        return self.sun_share * sunbeam(self.sun_zenith)[1] + (1.0 - self.sun_share) * 0.934

    @cached_property
    def fading(self) -> float:
        """Attenuation of the caustics contrast with depth [1/m].

        What is turned beyond small angles on its way down still lights, but no longer draws.
        """
        medium = self.medium
        return max(medium.direct[1] - medium.diffuse[1], 0.0) if medium else 0.0

    @property
    def sun(self) -> Sun:
        """Direction of the sun."""
        return Sun(self.sun_zenith, self.sun_azimuth)

    def sky(self, directions: Array) -> Array:
        """Return the radiance of the sky, a background for renderers.

        Args:
            directions: unit, world axes [1], shape (N, H, W, 3).

        Returns:
            Linear radiance, shape (N, H, W, 3).
        """
        light = sky(tuple(self.sky_zenith), tuple(self.sky_horizon), directions[..., 2])
        return namespace(directions).stack([light[k] for k in range(3)], axis=-1)

    def look(self, view: Sight, surface: Surface, time: Array, rng: Any) -> Array:
        """Return the underwater image of a rendered view.

        Args:
            view: what a renderer saw.
            surface: water surface, also for still water: its level is the water's.
            time: [s]; a number, or one for each view, shape (N,).
            rng: random state of the noise; may be None where there is none.

        Returns:
            Linear radiance times the exposure, zero or more, shape (N, H, W, 3).
        """
        light = view.colour
        if self.medium is not None:
            parts = [None if part is None else as_like(part, light) for part in view]
            light = chain.seen(self, self.medium, Sight._make(parts), surface, time)
        light = light * self.exposure if self.exposure != 1.0 else light
        if not self.noise:
            return light
        if rng is None:
            raise ConfigError(
                "optics.noise is on and no random state was given.\n"
                "Allowed: a numpy.random.Generator, or optics.noise=false."
            )
        return noisy(light, rng, read=self.read, shot=self.shot)


def standard_normal(like: Array, rng: Any) -> Array:
    """Return normal random numbers of the shape, type and device of an array.

    Args:
        like: an array.
        rng: a NumPy generator, which gives the same numbers for every array library, from a table
            of 2^16 quantiles; or a torch generator on the device of a torch array, which is faster
            there.
    """
    xp = namespace(like)
    if isinstance(rng, np.random.Generator):
        count = math.prod(like.shape)
        # four numbers of 16 bits from each of the generator's words
        drawn = rng.bit_generator.random_raw(-(-count // 4)).view(np.uint16)[:count]
        normal = np.take(_quantiles(), drawn).reshape(like.shape)
        return xp.astype(xp.asarray(normal, device=device(like)), like.dtype)
    return xp.randn(*like.shape, generator=rng, dtype=like.dtype, device=device(like))


@functools.cache
def _quantiles() -> NDArray[np.float32]:
    """Quantiles of the normal distribution at the centres of 2^16 equal intervals."""
    from scipy.special import ndtri

    return np.asarray(ndtri((np.arange(1 << 16) + 0.5) / (1 << 16)), dtype=np.float32)


def noisy(light: Array, rng: Any, *, read: float, shot: float) -> Array:
    """Return light with sensor noise, not negative.

    Equation:
        variance = read^2 + shot light.

    Args:
        light: linear, zero or more, one being the sensor's full scale, any shape.
        rng: random state.
        read: standard deviation of the reading in the dark [1].
        shot: one over the number of photons that fill a pixel [1].
    """
    xp = namespace(light)
    deviation = xp.sqrt(light * shot + read * read)
    return xp.clip(light + deviation * standard_normal(light, rng), 0.0, None)
