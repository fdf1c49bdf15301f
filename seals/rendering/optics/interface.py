"""Refraction and transmission of light at the interface of water and air."""

from __future__ import annotations

import math

from seals.arrays import Array, namespace

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
