"""Added mass of ellipsoids against closed forms of spheroids, discs and strips."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.errors import RobotError
from seals.frames import matrix_of, quaternion_of_rpy
from seals.scaffold.hydrodynamics import (
    Ellipsoid,
    ellipsoid_of_moments,
)

Floats = NDArray[np.float64]
RHO = 1000.0


def own(*axes: float) -> Floats:
    """Return the added mass about the ellipsoid's own centre and axes."""
    return Ellipsoid(np.array(axes), np.zeros(3), np.eye(3)).added_mass(RHO)


def mass(*axes: float) -> float:
    """Return the displaced mass [kg]."""
    return RHO * 4.0 / 3.0 * np.pi * float(np.prod(axes))


def test_sphere_carries_half_of_what_it_displaces() -> None:
    """A sphere: half of the displaced mass along every axis, nothing when it turns."""
    found = own(0.2, 0.2, 0.2)
    assert np.allclose(found, np.diag([0.5 * mass(0.2, 0.2, 0.2)] * 3 + [0.0] * 3), atol=1e-12)


@pytest.mark.parametrize("slenderness", [1.5, 3.0, 8.0, 20.0])
def test_prolate_spheroid(slenderness: float) -> None:
    """A prolate spheroid: Lamb's elementary integrals (art. 114 and 115), 1e-10."""
    b = 0.1
    a = slenderness * b
    e = np.sqrt(1.0 - (b / a) ** 2)
    log = np.log((1.0 + e) / (1.0 - e))
    alpha = 2.0 * (1.0 - e**2) / e**3 * (0.5 * log - e)
    beta = 1.0 / e**2 - (1.0 - e**2) / (2.0 * e**3) * log
    moment = mass(a, b, b) * (a**2 + b**2) / 5.0
    turning = e**4 * (beta - alpha) / ((2.0 - e**2) * (2.0 * e**2 - (2.0 - e**2) * (beta - alpha)))
    expected = [
        alpha / (2.0 - alpha) * mass(a, b, b),
        *[beta / (2.0 - beta) * mass(a, b, b)] * 2,
        0.0,
        *[turning * moment] * 2,
    ]
    assert np.allclose(own(a, b, b), np.diag(expected), rtol=1e-10, atol=1e-12)


def test_flat_ellipsoid_is_a_disc() -> None:
    """An ellipsoid of no thickness: broadside 8/3 rho r^3, turning 16/45 rho r^5 (Lamb 108)."""
    found = np.diag(own(0.3, 0.3, 0.3e-6))
    assert found[2] == pytest.approx(8.0 / 3.0 * RHO * 0.3**3, rel=1e-5)
    assert found[3:5] == pytest.approx(16.0 / 45.0 * RHO * 0.3**5, rel=1e-5)


def test_long_ellipsoid_is_a_row_of_strips() -> None:
    """A strip turned has rho pi / 8 (b^2 - c^2)^2, moved along b rho pi c^2."""
    a, b, c = 30.0, 0.2, 0.1
    found = np.diag(own(a, b, c))
    # the square of a section shrinks as 1 - x^2 / a^2, its fourth power as the square of that
    assert found[3] == pytest.approx(np.pi / 8 * RHO * (b**2 - c**2) ** 2 * 16 / 15 * a, rel=1e-3)
    assert found[1] == pytest.approx(np.pi * RHO * c**2 * 4.0 / 3.0 * a, rel=1e-3)


def test_energy_is_that_of_the_body_turned_and_shifted() -> None:
    """The water's energy is the same from another link origin and in other axes."""
    rng = np.random.default_rng(1)
    axes, centre = np.array([0.3, 0.2, 0.1]), np.array([0.4, -0.2, 0.1])
    turn = matrix_of(quaternion_of_rpy(np.array([[0.3, -0.8, 1.2]])))[0]
    here = Ellipsoid(axes, centre, turn).added_mass(RHO)
    for twist in rng.normal(size=(5, 6)):
        at_centre = twist[:3] + np.cross(twist[3:], centre)
        moved = np.concatenate((turn.T @ at_centre, turn.T @ twist[3:]))
        assert twist @ here @ twist == pytest.approx(moved @ own(*axes) @ moved, rel=1e-12)
    assert np.array_equal(here, here.T)
    assert np.linalg.eigvalsh(here)[0] > 0.0


def test_ellipsoid_of_its_own_moments() -> None:
    """An ellipsoid's volume and moments give it back; a box gets one of equal volume."""
    body = ellipsoid_of_moments(1.0, np.zeros(3), np.diag([0.09, 0.04, 0.01]) / 5.0)
    assert np.sort(body.semi_axes) / body.semi_axes.min() == pytest.approx([1.0, 2.0, 3.0])
    assert 4.0 / 3.0 * np.pi * body.semi_axes.prod() == pytest.approx(1.0)
    with pytest.raises(RobotError, match="closed shape"):
        ellipsoid_of_moments(1.0, np.zeros(3), np.diag([0.1, 0.1, 0.0]))
