"""Density and viscosity of fresh and sea water from temperature and salinity."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats

# Millero and Poisson 1981 (UNESCO 36), one standard atmosphere; t in degC (IPTS-68), s in g/kg.
_PURE = (6.536332e-9, -1.120083e-6, 1.001685e-4, -9.095290e-3, 6.793952e-2, 999.842594)
_A = (5.3875e-9, -8.2467e-7, 7.6438e-5, -4.0899e-3, 8.24493e-1)
_B = (-1.6546e-6, 1.0227e-4, -5.72466e-3)
_C = 4.8314e-4


def density_of(temperature: Floats, salinity: Floats) -> Floats:
    """Density of water at atmospheric pressure.

    Equation:
        Millero and Poisson 1981, one-atmosphere equation of state of sea water.

    Args:
        temperature: [degC], 0 to 40.
        salinity: [g/kg], 0 to 42.

    Returns:
        Density [kg/m^3].

    Example:
        >>> float(np.round(density_of(np.array(5.0), np.array(35.0)), 5))
        1027.67547
    """
    return np.asarray(
        np.polyval(_PURE, temperature)
        + np.polyval(_A, temperature) * salinity
        + np.polyval(_B, temperature) * salinity**1.5
        + _C * salinity**2
    )


def viscosity_of(temperature: Floats, salinity: Floats) -> Floats:
    """Dynamic viscosity of water.

    Equation:
        Sharqawy, Lienhard, Zubair 2010 (Desalination and Water Treatment 16), eq. 22 and 23.

    Args:
        temperature: [degC], 0 to 180.
        salinity: [g/kg], 0 to 150.

    Returns:
        Dynamic viscosity [Pa s].

    Example:
        >>> float(np.round(viscosity_of(np.array(20.0), np.array(0.0)) * 1e3, 3))
        1.002
    """
    share = salinity * 1e-3
    pure = 4.2844e-5 + 1.0 / (0.157 * (temperature + 64.993) ** 2 - 91.296)
    first = 1.541 + 1.998e-2 * temperature - 9.52e-5 * temperature**2
    second = 7.974 - 7.561e-2 * temperature + 4.724e-4 * temperature**2
    return np.asarray(pure * (1.0 + first * share + second * share**2))


FRESH_WATER = float(density_of(np.array(20.0), np.array(0.0)))
"""Density of water where nothing else is stated: fresh, at 20 degC, 998.2 kg/m^3."""
