"""Compliance from the speed of sound, and Chebyshev weights of the Jacobi iterations."""

from __future__ import annotations

import math

from seals.plugins.fluids.solvers.pbf.lattice import Calibration

# bound of the spectrum from below where water is meant to be incompressible
STIFF = 1 / 30
_MARGIN = 1.1
"""Safety on the top of the spectrum: water at rest is not a lattice [1]."""


def compliance(sound_speed: float, step: float) -> float:
    """Compliance of the density constraint [1/m^2]: pressure = density c^2 (compression)."""
    return 0.0 if math.isinf(sound_speed) else 1 / (sound_speed * step) ** 2


def weights(
    sweeps: int,
    *,
    softness: float,
    lattice: Calibration,
    margin: float = _MARGIN,
    stiff: float = STIFF,
) -> list[tuple[float, float]]:
    """Return (gain, momentum) of each iteration of the Chebyshev semi-iteration.

    Args:
        sweeps: how many.
        softness: compliance over the diagonal of the constraint.
        lattice: kernel constants; ``top`` bounds the spectrum from above.
        margin: on that bound [1].
        stiff: smallest share of the spectrum that is damped at the full rate [1].

    Example:
        >>> from seals.plugins.fluids.solvers.pbf.lattice import Calibration
        >>> from seals.plugins.fluids.solvers.device_settings import Kernel
        >>> round(weights(1, softness=1e9, lattice=Calibration.of(Kernel.wendland))[0][0], 6)
        1.0
    """
    # spectrum of Jacobi's matrix (A + alpha) / (diagonal + alpha): compliance lifts its low end
    high = (margin * lattice.top + softness) / (1 + softness)
    low = max(softness / (1 + softness), stiff * high)
    middle, half = (high + low) / 2, max((high - low) / 2, 1e-6)
    ratio = middle / half
    rho = 1 / ratio
    # Saad, Iterative Methods for Sparse Linear Systems, 2003, algorithm 12.1:
    # rho' = 1 / (2 sigma - rho), d' = rho' rho d + 2 rho' / delta r
    found = [(1 / middle, 0.0)]
    for _ in range(sweeps - 1):
        following = 1 / (2 * ratio - rho)
        found.append((2 * following / half, following * rho))
        rho = following
    return found
