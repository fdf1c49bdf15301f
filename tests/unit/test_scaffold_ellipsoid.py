"""Added mass of ellipsoids against closed forms, and its place on a link."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seals.scaffold.ellipsoid import added_mass_of_ellipsoid
from seals.scaffold.estimates import added_mass
from seals.scaffold.shapes import Box, LinkHull


def prolate(ratio: float) -> tuple[float, float, float]:
    """Return Lamb's factors of a spheroid of revolution, art. 114: along, across, turning."""
    e = math.sqrt(1.0 - 1.0 / ratio**2)
    log = math.log((1.0 + e) / (1.0 - e))
    alpha = 2.0 * (1.0 - e**2) / e**3 * (0.5 * log - e)
    beta = 1.0 / e**2 - (1.0 - e**2) / (2.0 * e**3) * log
    turning = e**4 * (beta - alpha) / ((2.0 - e**2) * (2.0 * e**2 - (2.0 - e**2) * (beta - alpha)))
    return alpha / (2.0 - alpha), beta / (2.0 - beta), turning


@pytest.mark.parametrize("ratio", [1.5, 4.0, 10.0])
def test_prolate_spheroids(ratio: float) -> None:
    """Along, across and about the short axes as in closed form; none about the long one."""
    a, b, density = 0.7, 0.7 / ratio, 1025.0
    mass = density * 4.0 / 3.0 * math.pi * a * b**2
    along, across, turning = prolate(ratio)
    moment = mass * (a**2 + b**2) / 5.0
    wanted = [along * mass, across * mass, across * mass, 0.0, turning * moment, turning * moment]
    found = added_mass_of_ellipsoid(np.array([a, b, b]), density)
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-12)


def test_a_flat_disc_carries_eight_thirds_of_its_radius_cubed() -> None:
    """The limit of a thin disc across its face: 8/3 rho r^3, to the order of its thickness."""
    found = added_mass_of_ellipsoid(np.array([0.5, 0.5, 1e-4]), 1000.0)
    assert found[2] == pytest.approx(8.0 / 3.0 * 1000.0 * 0.5**3, rel=1e-3)


def test_axes_may_come_in_any_order() -> None:
    """Exchanging axes exchanges the numbers."""
    first = added_mass_of_ellipsoid(np.array([0.3, 0.2, 0.1]), 1000.0)
    second = added_mass_of_ellipsoid(np.array([0.1, 0.3, 0.2]), 1000.0)
    assert second == pytest.approx(first[[2, 0, 1, 5, 3, 4]])


def test_a_slender_hull_is_no_sphere() -> None:
    """Along a hull of 1.4 m by 0.12 m the water weighs little, across nearly what it displaces."""
    edges = np.array([1.4, 0.12, 0.12])
    volume = math.pi / 6.0 * float(edges.prod())
    hull = LinkHull([], [Box(np.zeros(3), edges, np.eye(3))], [volume])
    matrix = added_mass(hull)
    assert matrix[0, 0] < 0.03 * 1000.0 * volume
    assert matrix[1, 1] == pytest.approx(1000.0 * volume, rel=0.05)


def test_a_shape_off_the_origin_couples_force_and_moment() -> None:
    """The momentum of a moving link passes through the shape, and the matrix stays definite."""
    volume, place = 4.0 / 3.0 * math.pi * 0.05**3, np.array([0.0, 0.0, -0.2])
    hull = LinkHull([], [Box(place, np.full(3, 0.1), np.eye(3))], [volume])
    matrix = added_mass(hull)
    carried = 0.5 * 1000.0 * volume
    # moving along x: momentum m v at z = -0.2, moment r x p = -0.2 m v about y
    assert matrix[4, 0] == pytest.approx(-0.2 * carried)
    assert matrix[3, 1] == pytest.approx(0.2 * carried)
    assert np.linalg.eigvalsh(matrix)[0] >= 0.0
