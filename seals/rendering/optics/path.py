"""Light along a ray: clear sky, interface of water and air, attenuation, backscattered veil."""

from __future__ import annotations

import math
from typing import NamedTuple

from seals.arrays import Array, as_like, namespace

INDEX = 1.333
"""Refractive index of water [1], at 589 nm and 20 degC; sea water has 1.339."""


def fresnel(cosine: Array, ratio: float) -> Array:
    """Return the share of unpolarised light that a smooth surface reflects [1].

    Equation:
        R = (r_s^2 + r_p^2) / 2, r_s = (m c_i - c_t) / (m c_i + c_t),
        r_p = (c_i - m c_t) / (c_i + m c_t), c_t^2 = 1 - m^2 (1 - c_i^2); one where c_t^2 < 0.

    Args:
        cosine: c_i of the angle of incidence [1], 0 to 1, any shape.
        ratio: m, refractive index on the light's side over the one behind [1].

    References:
        Born and Wolf 1999, Principles of Optics, sec. 1.5.

    Example:
        >>> import numpy as np
        >>> fresnel(np.array([1.0, 0.5]), 1.333).round(4).tolist()  # from the water
        [0.0204, 1.0]
    """
    xp = namespace(cosine)
    inside = 1.0 - ratio * ratio * (1.0 - cosine * cosine)
    onward = xp.sqrt(xp.clip(inside, 0.0, None))
    # a cosine of zero in both terms would divide zero by zero
    near, far = ratio * cosine, ratio * onward
    across = (near - onward) / xp.clip(near + onward, 1e-12, None)
    along = (cosine - far) / xp.clip(cosine + far, 1e-12, None)
    return xp.where(inside <= 0.0, 1.0, 0.5 * (across * across + along * along))


def sunbeam(zenith: float) -> tuple[float, float]:
    """Return the angle of a sunbeam in the water, and the transmitted fraction.

    Args:
        zenith: angle of the sun from straight up [rad].

    Returns:
        Angle from the vertical under still water [rad], and 1 - R [1].

    Example:
        >>> angle, share = sunbeam(math.radians(60.0))
        >>> round(math.degrees(angle), 1), round(share, 3)
        (40.5, 0.94)
    """
    lean = math.asin(math.sin(zenith) / INDEX)
    into, under = math.cos(zenith), math.cos(lean)
    across = (into - INDEX * under) / (into + INDEX * under)
    along = (INDEX * into - under) / (INDEX * into + under)
    return lean, 1.0 - 0.5 * (across**2 + along**2)


def sky(zenith: tuple[float, ...], horizon: tuple[float, ...], rise: Array) -> Array:
    """Return the radiance of the sky.

    Equation:
        L = L_zenith + (L_horizon - L_zenith) (1 - u)^4.

    Args:
        zenith: radiance straight up, red, green, blue; white in full light is one.
        horizon: radiance at the horizon.
        rise: u, upward component of the direction [1], shape (N, H, W).

    Returns:
        Radiance, shape (3, N, H, W).

    Limitations:
        The sun itself is not in it; no direction but up counts.
    """
    xp = namespace(rise)
    low = 1.0 - xp.clip(rise, 0.0, 1.0)
    share = (low * low) * (low * low)
    top = channels(zenith, rise)
    return top + (channels(horizon, rise) - top) * share[None]


class Medium(NamedTuple):
    """Coefficients of the water in red, green and blue.

    Args:
        direct: beta_D, loss of direct light along the line of sight [1/m].
        veiling: beta_B, at which the veil along a level line of sight fills up [1/m].
        source: radiance that a metre of water in full light sends back, per irradiance over pi
            [1/m].
        diffuse: K_d, fall of the light with depth [1/m].
        spread: scattering into the blur about the green wavelength [1/m].
    """

    direct: tuple[float, ...]
    veiling: tuple[float, ...]
    source: tuple[float, ...]
    diffuse: tuple[float, ...]
    spread: float

    def transmission(self, length: Array, depth: Array) -> Array:
        """Return the fraction of an object's radiance that arrives directly.

        Equation:
            exp(-K_d D) exp(-beta_D z): light falls to the depth of the object, and on its way to
            the camera.

        Args:
            length: z, wet part of the line of sight [m], shape (N, H, W).
            depth: D of the object [m], zero or more, shape (N, H, W).

        Returns:
            Shares [1], shape (3, N, H, W).
        """
        xp = namespace(length)
        loss = channels(self.direct, length) * length[None]
        return xp.exp(-(loss + channels(self.diffuse, length) * depth[None]))

    def veil(self, length: Array, depth: Array, rise: Array) -> Array:
        """Return the light backscattered by the water along a ray.

        Equation:
            B = s E(D) (1 - exp(-e z)) / e, e = beta_B - K_d u, E(D) = exp(-K_d D): the light
            scattered towards the camera all along the path, brighter where the path leads up. Along
            a level path it is B_inf (1 - exp(-beta_B z)) with B_inf = s E / beta_B.

        Args:
            length: z, wet part of the line of sight [m], shape (N, H, W).
            depth: D where that part begins [m], zero or more, shape (N or 1, H or 1, W or 1).
            rise: u, upward component of the line of sight [1], shape (N, H, W).

        Returns:
            Radiance, full light on white being one; shape (3, N, H, W).

        References:
            Duntley 1963, J. Opt. Soc. Am. 53, 214, doi:10.1364/JOSA.53.000214; Akkaynak and
            Treibitz 2018, CVPR, doi:10.1109/CVPR.2018.00703.
        """
        xp = namespace(length)
        fall = channels(self.diffuse, length)
        rate = channels(self.veiling, length) - fall * rise[None]
        steepest = min(v / max(k, 1e-9) for v, k in zip(self.veiling, self.diffuse, strict=True))
        if bool(xp.any(rise > 0.99 * steepest)):
            # an upward path may gain as much light as it loses: the limit of a rate of zero
            rate = rate + 1e-4 * xp.astype(xp.abs(rate) < 5e-5, rate.dtype)
        lit = channels(self.source, length) * xp.exp(-fall * depth[None])
        return lit / rate * (1.0 - xp.exp(-rate * length[None]))

    def far_veil(self, depth: Array, rise: Array) -> Array:
        """Return the veil B_inf of an infinitely long ray that does not point upwards.

        Args:
            depth: where it begins [m], shape (N or 1, H or 1, W or 1).
            rise: u, upward component of the line of sight [1], zero or less, shape (N, H, W).
        """
        xp = namespace(rise)
        fall = channels(self.diffuse, rise)
        lit = channels(self.source, rise) * xp.exp(-fall * depth[None])
        return lit / (channels(self.veiling, rise) - fall * xp.clip(rise, None, 0.0)[None])


def channels(values: tuple[float, ...], like: Array) -> Array:
    """Return three numbers as an array that broadcasts against planes (3, N, H, W)."""
    return namespace(like).reshape(as_like(values, like), (3, 1, 1, 1))
