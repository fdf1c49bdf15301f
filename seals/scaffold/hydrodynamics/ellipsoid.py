"""Added mass of an ellipsoid deep under water, in closed form."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import elliprd

from seals.arrays import Floats
from seals.errors import RobotError
from seals.multibody.spatial import twist_map

_ROUND = 1e-4
"""Difference of two semi-axes, by their size, below which turning about the third moves nothing."""


class Ellipsoid(NamedTuple):
    """An ellipsoid in the axes of a link.

    Args:
        semi_axes: [m], shape (3,).
        centre: [m], shape (3,).
        turn: its own axes as columns, shape (3, 3).
    """

    semi_axes: Floats
    centre: Floats
    turn: Floats

    def added_mass(self, density: float) -> Floats:
        """Return the added mass of an ellipsoid about the link origin, link axes.

        Equation:
            A_11 = rho V a_0 / (2 - a_0), a_0 = a b c int_0^inf dl / ((a^2 + l) D(l)),
            D^2 = (a^2 + l)(b^2 + l)(c^2 + l);
            A_44 = rho V / 5 (b^2 - c^2)^2 (g_0 - b_0) / (2 (b^2 - c^2) + (b^2 + c^2)(b_0 - g_0)),
            and so on in turn. The integrals are Carlson's: a_0 = 2/3 a b c R_D(b^2, c^2, a^2).

        Args:
            density: of the water [kg/m^3].

        Returns:
            Symmetric, positive semi-definite matrix, order [linear, angular], shape (6, 6)
            [kg, kg m, kg m^2].

        Raises:
            RobotError: a semi-axis is not positive and finite.

        Assumptions: ideal flow without a free surface, walls or bottom.

        References: Lamb 1932, Hydrodynamics, art. 114 and 115; Carlson 1995, Numer. Algorithms 10.

        Example:
            >>> ball = Ellipsoid(np.full(3, 0.1), np.zeros(3), np.eye(3))
            >>> half = 0.5 * 1000.0 * 4.0 / 3.0 * np.pi * 0.1**3
            >>> bool(np.allclose(np.diag(ball.added_mass(1000.0))[:3], half))
            True
        """
        axes = np.asarray(self.semi_axes, dtype=float)
        if not (np.all(np.isfinite(axes)) and np.all(axes > 0.0)):
            raise RobotError(
                f"an ellipsoid of semi-axes {axes.tolist()} m is not allowed.\nAllowed: positive."
            )
        mass = density * 4.0 / 3.0 * math.pi * float(axes.prod())
        # relative to the longest: Carlson's integral is the same, numbers stay near one
        shape = axes / axes.max()
        integrals = np.array([_integral(np.roll(shape, -k)) for k in range(3)])
        diagonal = np.concatenate(
            (
                mass * integrals / (2.0 - integrals),
                [_turning(np.roll(axes, -k), np.roll(integrals, -k), mass) for k in range(3)],
            )
        )
        return moved(np.diag(diagonal), self.centre, self.turn)


def _integral(axes: Floats) -> float:
    """Lamb's integral of the first of three semi-axes [1]."""
    a, b, c = axes
    return float(2.0 / 3.0 * a * b * c * elliprd(b * b, c * c, a * a))


def _turning(axes: Floats, integrals: Floats, mass: float) -> float:
    """Added moment of inertia about the first of three semi-axes [kg m^2]."""
    _, b, c = axes
    _, beta, gamma = integrals
    if abs(b - c) < _ROUND * (b + c):
        return 0.0
    apart, both = b * b - c * c, b * b + c * c
    return float(mass / 5.0 * apart**2 * (gamma - beta) / (2.0 * apart + both * (beta - gamma)))


def moved(matrix: Floats, centre: Floats, turn: Floats) -> Floats:
    """Transform a 6 x 6 matrix from a body's centre and axes to the origin and axes of its link.

    Args:
        matrix: order [linear, angular], own axes about the centre, shape (6, 6).
        centre: in link axes [m], shape (3,).
        turn: own axes as columns, shape (3, 3).
    """
    change = twist_map(np.asarray(centre, dtype=float), np.asarray(turn, dtype=float))
    out = change.T @ matrix @ change
    return np.asarray(0.5 * (out + out.T))


def ellipsoid_of_moments(volume: float, centre: Floats, spread: Floats) -> Ellipsoid:
    """Return the ellipsoid that has the volume, centre and principal axes of a body.

    Its semi-axes are in the ratio of the body's radii of gyration: a solid ellipsoid has the second
    moments a^2 / 5.

    Args:
        volume: [m^3].
        centre: of the volume [m], shape (3,).
        spread: second moments about the centre, by the volume [m^2], shape (3, 3).

    Raises:
        RobotError: the volume is zero, or the body is flat.
    """
    moments, turn = np.linalg.eigh(np.asarray(spread, dtype=float))
    if not (volume > 0.0 and np.all(np.isfinite(moments)) and moments[0] > 0.0):
        raise RobotError(
            f"a body of {volume:.3g} m^3 with second moments {moments.tolist()} m^2 has no "
            "equivalent ellipsoid.\nGive it a closed shape with a thickness."
        )
    # no body has two radii of gyration further apart than those of a needle of its volume
    ratio = np.sqrt(np.maximum(moments, 1e-8 * moments[-1]))
    axes = ratio * (volume / (4.0 / 3.0 * math.pi * ratio.prod())) ** (1.0 / 3.0)
    if np.linalg.det(turn) < 0.0:
        turn[:, 0] *= -1.0
    return Ellipsoid(axes, np.asarray(centre, dtype=float), turn)
