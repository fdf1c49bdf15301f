"""The flight tasks of the paper keep their bounds, with noise and rotor lag."""

from __future__ import annotations

import numpy as np
import pytest

from seals.experiments import hover_arm, oval_crossing
from seals.run.build import run_settings
from seals.run.simulation import Record, simulate

pytestmark = [pytest.mark.slow, pytest.mark.validation]


def flown(*overrides: str) -> Record:
    """Simulate a recipe."""
    record = simulate(run_settings(overrides))
    assert record.error is None
    return record


@pytest.mark.parametrize("motion", ["sweep", "random"])
def test_hover_with_a_moving_arm_follows_the_centre_of_gravity(motion: str) -> None:
    """Deviations stay within 10, 3 and 20 mm; about a fixed centre they are three times worse."""
    words = ["experiment=hover_arm", f"guide.arm={motion}"]
    aware = hover_arm.largest(flown(*words).log)
    unaware = hover_arm.largest(flown(*words, hover_arm.UNAWARE, "time.duration=14").log)
    assert (aware <= hover_arm.WITHIN).all()
    assert np.linalg.norm(unaware) > 3.0 * np.linalg.norm(aware)


@pytest.mark.parametrize("case", list(oval_crossing.CASES))
def test_an_oval_through_the_surface_is_followed(case: str) -> None:
    """Two laps within 5 cm rms, also with less thrust and more mass; the crossing is felt."""
    words = ["experiment=oval_crossing", "guide.laps=2", "time.duration=58"]
    settings = run_settings([*words, *oval_crossing.CASES[case]])
    found = oval_crossing.score(simulate(settings).log, settings.guide)
    assert found.laps == 2
    assert found.rms <= oval_crossing.WITHIN
    assert found.jump > 1.0


def test_the_arm_swings_under_water_as_well() -> None:
    """The same controller holds the place under water while the arm swings through the water."""
    log = flown(
        "robot=aam",
        "water=fossen",
        "guide=hover",
        "guide.arm=sweep",
        "initial.position=[0,0,-1.5]",
        "time.duration=14",
    ).log
    away = log.channel("position")[log.time > 6.0] - [0.0, 0.0, -1.5]
    assert np.abs(away).max() < 0.06
