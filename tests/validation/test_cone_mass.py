"""The mass of the water-entry impactor, told by its drops with a cone."""

from __future__ import annotations

import numpy as np
import pytest

from seals.experiments.water_validation.entry import MASS, mass_of_cone, measured

pytestmark = [pytest.mark.validation, pytest.mark.usefixtures("measurements")]


def test_six_drops_at_two_speeds_tell_one_mass() -> None:
    """Drag over speed squared is the same at 4 and 6 m/s: 1 % between drops, 1.5 % within one."""
    found = np.array([mass_of_cone(d) for v in (4, 6) for d in measured(v, "150degcone")])
    assert found.shape == (6, 2)
    assert found[:, 0] == pytest.approx(MASS, rel=0.01)
    assert (found[:, 1] < 0.015 * MASS).all()


def test_speeds_at_the_entry_are_the_nominal_ones() -> None:
    """Summed up from the release, within 2 %; drops of one kind within 0.3 %."""
    for nose, nominal in (("150degcone", 4), ("150degcone", 6), ("sphere", 2), ("sphere", 6)):
        speeds = np.array([drop.speed for drop in measured(nominal, nose)])
        assert speeds == pytest.approx(nominal, rel=0.02)
        assert np.ptp(speeds) < 0.003 * nominal
