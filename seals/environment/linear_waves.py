"""Linear waves on water of finite depth: dispersion, wave makers, spectra."""

from __future__ import annotations

import math

import numpy as np

from seals.arrays import Floats


def wavenumber(omega: float, depth: float, gravity: float) -> float:
    """Return the wave number k [rad/m] of omega^2 = g k tanh(k h).

    Args:
        omega: angular frequency [rad/s], above zero.
        depth: h [m]; infinite for deep water.
        gravity: g [m/s^2].

    Example:
        >>> k = wavenumber(2.0, 0.5, 9.81)
        >>> round(9.81 * k * math.tanh(k * 0.5), 9)
        4.0
    """
    deep = omega * omega / gravity
    if math.isinf(depth):
        return deep
    # Guo 2002, within 0.75 %; Newton's method does the rest
    x = omega * math.sqrt(depth / gravity)
    kh = x * x * (1.0 - math.exp(-(x**2.4901))) ** -0.4016
    for _ in range(20):
        tanh = math.tanh(kh)
        change = (kh * tanh - x * x) / (tanh + kh * (1.0 - tanh * tanh))
        kh -= change
        if abs(change) < 1e-13 * kh:
            break
    return float(kh / depth)


def piston_gain(kh: float) -> float:
    """Return wave height over stroke of a piston [1].

    Equation:
        H/S = 2 (cosh 2kh - 1) / (sinh 2kh + 2kh).

    Example:
        >>> round(piston_gain(0.01), 4)
        0.01
    """
    # both divided by cosh 2kh, which overflows in deep water
    cosh = 1.0 / math.cosh(2.0 * kh) if kh < 350.0 else 0.0
    return 2.0 * (1.0 - cosh) / (math.tanh(2.0 * kh) + 2.0 * kh * cosh)


def flap_gain(kh: float) -> float:
    """Return wave height over stroke at the still surface, of a flap hinged at the bottom [1].

    Equation:
        H/S = 4 (sinh kh / kh) (kh sinh kh - cosh kh + 1) / (sinh 2kh + 2kh).

    References:
        Dean and Dalrymple 1991, Water Wave Mechanics for Engineers and Scientists, eq. 6.26.

    Example:
        >>> round(flap_gain(0.01) / piston_gain(0.01), 2)
        0.5
    """
    if kh > 300.0:
        return 2.0 * (1.0 - 1.0 / kh)
    sinh, cosh = math.sinh(kh), math.cosh(kh)
    return 4.0 * (sinh / kh) * (kh * sinh - cosh + 1.0) / (math.sinh(2.0 * kh) + 2.0 * kh)


def spread(exponent: float, components: int) -> Floats:
    """Return directions of waves about the mean one [rad], ascending, shape (components,).

    Equation:
        D(b) ~ cos^{2s}(b / 2) between -pi and pi; the directions share it evenly. The mean of cos b
        is s / (s + 1), that of cos 2b is s (s - 1) / ((s + 1) (s + 2)).

    Args:
        exponent: s [1].
        components: number of waves.

    References:
        Longuet-Higgins, Cartwright and Smith 1963, in Ocean Wave Spectra, p. 111.

    Example:
        >>> round(float(np.cos(spread(4.0, 1000)).mean()), 3)
        0.8
    """
    angle = np.linspace(-math.pi, math.pi, 20001)
    density = np.cos(0.5 * angle) ** (2.0 * exponent)
    whole = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    return np.interp((np.arange(components) + 0.5) / components, whole / whole[-1], angle)


def jonswap(
    height: float, period: float, *, peakedness: float = 3.3, components: int = 40
) -> tuple[Floats, Floats]:
    """Return angular frequencies [rad/s] and amplitudes [m] of an irregular sea.

    Equation:
        S(w) ~ w^-5 exp(-1.25 (w_p/w)^4) gamma^exp(-(w - w_p)^2 / (2 sigma^2 w_p^2)), sigma 0.07
        below the peak and 0.09 above; scaled so that the variance is (height / 4)^2. The
        frequencies share the variance evenly, so that the sum does not repeat itself.

    Args:
        height: significant height [m].
        period: of the peak [s].
        peakedness: gamma [1].
        components: number of waves.

    References:
        Hasselmann et al. 1973, Ergaenzungsheft 8-12 der Deutschen Hydrographischen Zeitschrift.

    Example:
        >>> omega, amplitude = jonswap(1.0, 8.0)
        >>> round(4.0 * float(np.sqrt(0.5 * (amplitude**2).sum())), 6)
        1.0
    """
    peak = 2.0 * math.pi / period
    w = np.linspace(0.5 * peak, 4.0 * peak, 20001)
    sigma = np.where(w <= peak, 0.07, 0.09)
    rise = np.exp(-((w - peak) ** 2) / (2.0 * sigma**2 * peak**2))
    density = w**-5.0 * np.exp(-1.25 * (peak / w) ** 4) * peakedness**rise
    whole = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    shares = (np.arange(components) + 0.5) / components
    omega = np.interp(shares, whole / whole[-1], w)
    return omega, np.full(components, height / 4.0 * math.sqrt(2.0 / components))
