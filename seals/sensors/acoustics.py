"""Sound in water: absorption, beam patterns, spreading."""

from __future__ import annotations

import math

import numpy as np

from seals.arrays import Floats

HALF_POWER = 0.44294647
"""x at which sinc(x)^2 = 1/2, sinc(x) = sin(pi x) / (pi x) [1]."""


def absorption(
    frequency: float,
    *,
    temperature: float,
    salinity: float,
    depth: float = 0.0,
    acidity: float = 8.0,
) -> float:
    """Return the absorption of sound in water [dB/m].

    Equation:
        alpha = A1 P1 f1 f^2 / (f1^2 + f^2) + A2 P2 f2 f^2 / (f2^2 + f^2) + A3 P3 f^2: boric acid,
        magnesium sulphate and pure water, f in kHz, alpha in dB/km.

    Args:
        frequency: [Hz].
        temperature: [degC].
        salinity: [g/kg].
        depth: [m].
        acidity: pH [1].

    Valid range:
        200 Hz to 1 MHz, -2 to 22 degC, 30 to 35 g/kg, to 3500 m: within 5 % of the
        measurements from 10 to 500 kHz, 10 % elsewhere. Without salt only pure water is left.

    References:
        Francois and Garrison 1982, J. Acoust. Soc. Am. 72(3), 896 and 72(6), 1879.

    Example:
        >>> round(1e3 * absorption(50e3, temperature=0.0, salinity=35.0, acidity=6.0), 2)
        13.95
    """
    f, t, s, z = 1e-3 * frequency, temperature, salinity, depth
    speed = 1412.0 + 3.21 * t + 1.19 * s + 0.0167 * z
    boric = 8.86 / speed * 10.0 ** (0.78 * acidity - 5.0)
    relaxing_b = 2.8 * math.sqrt(s / 35.0) * 10.0 ** (4.0 - 1245.0 / (273.0 + t))
    sulphate = 21.44 * s / speed * (1.0 + 0.025 * t) * (1.0 - 1.37e-4 * z + 6.2e-9 * z * z)
    relaxing_s = 8.17 * 10.0 ** (8.0 - 1990.0 / (273.0 + t)) / (1.0 + 0.0018 * (s - 35.0))
    if t <= 20.0:
        pure = 4.937e-4 - 2.59e-5 * t + 9.11e-7 * t**2 - 1.50e-8 * t**3
    else:
        pure = 3.964e-4 - 1.146e-5 * t + 1.45e-7 * t**2 - 6.5e-10 * t**3
    pure *= 1.0 - 3.83e-5 * z + 4.9e-10 * z * z
    square = f * f
    total = pure * square + sulphate * relaxing_s * square / (relaxing_s**2 + square)
    total += boric * relaxing_b * square / (relaxing_b**2 + square)
    return 1e-3 * float(total)


def sound_speed(*, temperature: float, salinity: float, depth: float = 0.0) -> float:
    """Return the speed of sound in water [m/s].

    Equation:
        The nine terms of Mackenzie 1981.

    Args:
        temperature: [degC].
        salinity: [g/kg].
        depth: [m].

    Valid range:
        2 to 30 degC, 25 to 40 g/kg, to 8000 m: 0.07 m/s. Fresh water at 20 degC comes out 0.6 m/s
        low.

    References:
        Mackenzie 1981, J. Acoust. Soc. Am. 70, 807.

    Example:
        >>> round(sound_speed(temperature=25.0, salinity=35.0, depth=1000.0), 3)
        1550.744
    """
    t, s, z = temperature, salinity - 35.0, depth
    warm = 1448.96 + 4.591 * t - 5.304e-2 * t**2 + 2.374e-4 * t**3
    salt = 1.340 * s - 1.025e-2 * t * s
    return warm + salt + 1.630e-2 * z + 1.675e-7 * z**2 - 7.139e-13 * t * z**3


def mirrored(
    source: Floats, receiver: Floats, reflection: tuple[float, float], levels: tuple[float, float]
) -> tuple[Floats, Floats]:
    """Return the lengths of sound paths by surface and bottom, and their levels.

    Equation:
        d_e = |p - p'|, p' the image of the source in the levels, in turn; level 20 log10(R d / d_e)
        relative to the direct path d, R the product of the reflection coefficients.

    Args:
        source: world [m], shape (3,).
        receiver: likewise.
        reflection: coefficients of surface and bottom, as magnitudes [1].
        levels: heights of surface and bottom, world z [m]; minus infinity for no bottom.

    Returns:
        Lengths [m] and levels [dB] of the paths by the surface, the bottom, the surface and then
        the bottom, the bottom and then the surface, shape (4,) each; NaN for paths that are not
        there.

    References:
        Urick 1983, Principles of Underwater Sound, ch. 5.

    Example:
        >>> ends = np.array([0.0, 0.0, -3.0]), np.array([8.0, 0.0, -3.0])
        >>> mirrored(*ends, (1.0, 0.5), (0.0, -7.5))[0].tolist()
        [10.0, 12.041594578792296, 17.0, 17.0]
    """
    direct = float(np.linalg.norm(receiver - source))
    lengths, factors = [], []
    for order in ((0,), (1,), (0, 1), (1, 0)):
        height, factor = float(source[2]), 1.0
        for side in order:
            height, factor = 2.0 * levels[side] - height, factor * reflection[side]
        across = float(np.hypot(*(receiver - source)[:2]))
        lengths.append(math.hypot(across, height - float(receiver[2])))
        factors.append(factor)
    ways = np.where(np.isfinite(lengths), lengths, np.nan)
    with np.errstate(divide="ignore"):
        return ways, 20.0 * np.log10(np.array(factors) * direct / ways)


def line_pattern(angles: Floats, width: float) -> Floats:
    """Return the one-way power pattern of a uniform line array.

    Equation:
        b = sinc(u)^2 with u = HALF_POWER sin(angle) / sin(width / 2); one half at width / 2, first
        side lobes at -13.3 dB.

    Args:
        angles: off the axis [rad].
        width: between the half-power angles [rad].

    References:
        Urick 1983, Principles of Underwater Sound, ch. 3.

    Example:
        >>> line_pattern(np.array([0.0, 0.05]), 0.1).round(6).tolist()
        [1.0, 0.5]
    """
    scale = HALF_POWER / math.sin(0.5 * min(width, math.pi))
    pattern: Floats = np.sinc(scale * np.sin(angles)) ** 2
    # sin() folds back behind the array, which hears nothing there
    pattern[np.abs(angles) >= 0.5 * math.pi] = 0.0
    return pattern


def linear(level: float) -> float:
    """Return a power ratio of a level in decibels.

    Example:
        >>> round(linear(3.0103), 4)
        2.0
    """
    return math.pow(10.0, 0.1 * level)
