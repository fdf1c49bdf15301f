"""Closed forms of a sphere's entry, and a coarse entry against their range."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from seals.experiments.water_validation import slam


def test_raised_disc_meets_wagners_condition() -> None:
    """Near the pole, Wagner's condition solved by quadrature gives the circle of the law."""

    def way(c: float) -> float:
        return quad(lambda t: (1 - np.sqrt(1 - (c * np.sin(t)) ** 2)) * np.sin(t), 0, np.pi / 2)[0]

    depth = 1e-3
    c = brentq(lambda x: way(x) - depth, 1e-4, 0.5)
    # f = r^2 / 2 + r^4 / 8: the next term is of the order of the depth
    assert float(slam.raised(depth)) == pytest.approx(4 / 3 * c**3, rel=5 * depth)


def test_line_between_the_discs_judges() -> None:
    """An impulse below the disc of undisturbed water, or above the raised one, is missed."""
    assert slam.between("x", 0.54, 0.0).passed
    assert not slam.between("x", 0.473, 0.0).passed
    assert not slam.between("x", 1.2, 0.0).passed


def test_coarse_entry_has_the_impulse_of_a_slam() -> None:
    """Eight spacings across, the impulse at 0.3 R lies between the two discs."""
    found = slam.slam(8, slam.Grade(quick=True, threads=2))
    assert slam.between("8 across", found.at(0.3), 0.0).passed
    # it grows monotonically but for the scatter of single steps
    assert found.at(0.1) < found.at(0.3) < found.at(0.5) < float(slam.raised(0.5))
