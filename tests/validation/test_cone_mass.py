"""The mass of the water-entry impactor, told by its drops with a cone."""

from __future__ import annotations

import numpy as np
import pytest

from seals.experiments.water_validation.entry import MASS, impulses, measured
from seals.experiments.water_validation.slam import CONE_DROPS
from seals.sysid.data.robot_description import describe_robot

pytestmark = [pytest.mark.validation, pytest.mark.usefixtures("measurements")]


def test_six_drops_at_two_speeds_tell_one_mass() -> None:
    """Drag over speed squared is the same at 4 and 6 m/s: 1 % between drops, 1.5 % within one."""
    found = np.array([d.mass_of_cone() for v in (4, 6) for d in measured(v, "150degcone")])
    assert found.shape == (6, 2)
    assert found[:, 0] == pytest.approx(MASS, rel=0.01)
    assert (found[:, 1] < 0.015 * MASS).all()


def test_speeds_at_the_entry_are_the_nominal_ones() -> None:
    """Summed up from the release, within 2 %; drops of one kind within 0.3 %."""
    for nose, nominal in (("150degcone", 4), ("150degcone", 6), ("sphere", 2), ("sphere", 6)):
        speeds = np.array([drop.speed for drop in measured(nominal, nose)])
        assert speeds == pytest.approx(nominal, rel=0.02)
        assert np.ptp(speeds) < 0.003 * nominal


def test_drops_tell_the_impulse_of_the_cone() -> None:
    """At one radius, by the mass that the drag tells: 4 % between six drops at two speeds."""
    each = []
    for drop in (d for v in (4, 6) for d in measured(v, "150degcone")):
        felt = 0.5 * (drop.felt[1:] + drop.felt[:-1])
        each.append(MASS * impulses(drop.time, felt, drop.speed)[1])
    assert np.mean(each) == pytest.approx(CONE_DROPS, rel=0.005)
    assert np.array(each) == pytest.approx(CONE_DROPS, rel=0.045)


def test_the_robot_weighs_what_the_drops_tell() -> None:
    """One mass of the impactor: that of the experiment and that of the robot's folder."""
    assert float(describe_robot("impactor").robot.mass.sum()) == pytest.approx(MASS)
