"""Added mass of an ellipsoid in unbounded fluid."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats


def added_mass_of_ellipsoid(semi_axes: Floats, density: float) -> Floats:
    """Return the diagonal of the added-mass matrix about the centre, shape (6,).

    Equation:
        m_x = alpha / (2 - alpha) rho V, and likewise along y and z with beta and gamma;
        I_x = (b^2 - c^2)^2 (gamma - beta) / (2 (b^2 - c^2) + (b^2 + c^2) (beta - gamma)) rho V / 5,
        and likewise about y and z; alpha = a b c R_D(b^2, c^2, a^2) 2/3 with Carlson's integral
        R_D, V = 4/3 pi a b c.

    Args:
        semi_axes: a, b, c along x, y, z, all above zero [m], shape (3,).
        density: of the fluid [kg/m^3].

    Returns:
        Added masses along x, y, z [kg] and added moments of inertia about x, y, z [kg m^2].

    References:
        Lamb 1932, Hydrodynamics, art. 114 and 121, 121a.

    Example:
        A sphere carries half of what it displaces.

        >>> added_mass_of_ellipsoid(np.ones(3), 3.0 / (4.0 * np.pi)).round(9).tolist()
        [0.5, 0.5, 0.5, 0.0, 0.0, 0.0]
    """
    from scipy.special import elliprd

    axes = np.asarray(semi_axes, dtype=float)
    square, mass = axes**2, density * 4.0 / 3.0 * np.pi * float(axes.prod())
    x, y, z = (float(value) for value in square)
    integrals = [elliprd(y, z, x), elliprd(z, x, y), elliprd(x, y, z)]
    factor = 2.0 / 3.0 * axes.prod() * np.array(integrals)
    turning = np.zeros(3)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        less, more = square[i] - square[j], square[i] + square[j]
        bias = factor[j] - factor[i]
        if abs(less) > 1e-9 * more:
            turning[k] = 0.2 * less**2 * bias / (2.0 * less - more * bias)
    return np.concatenate((factor / (2.0 - factor), turning)) * mass
