"""Water in tension: a cube that is jerked away carries the water behind it along."""

from __future__ import annotations

import numpy as np
import pytest

from seals.plugins.fluids.solvers.device_settings import DeviceSettings
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from tests.verification.test_dfsph_water import cube, tank_of
from tests.verification.test_pbf_balance import SIDE, SPACING

STEP, REST, JERK = 2e-3, 40, 8
ALLOWED = 2e4
"""Tension that is allowed [Pa]; a jerk of 100 m/s^2 asks for some thousands behind the cube."""


def added_mass(settings: DeviceSettings, rate: float) -> float:
    """Added mass over that of the displaced water of a cube under water, jerked sideways.

    Args:
        settings: of the solver.
        rate: acceleration [m/s^2].
    """
    water = tank_of(settings)
    cube(water, 1.0, 8.0)
    centre, forces = SPACING * np.array([8.0, 8.0, 8.0]), []
    for k in range(REST + JERK):
        speed = max(k + 1 - REST, 0) * STEP * rate
        water.place_bodies(
            position=centre[None],
            rotation=np.eye(3)[None],
            velocity=np.array([[speed, 0.0, 0.0]]),
            spin=np.zeros((1, 3)),
            inverse_mass=np.zeros(1),
            inverse_inertia=np.zeros((1, 3, 3)),
            acceleration=np.zeros((1, 3)),
        )
        found = water.advance(STEP, substeps=water.substeps(STEP))
        centre = centre + np.array([STEP * speed, 0.0, 0.0])
        forces.append(-found.impulses[0, 0] / STEP)
    water.close()
    # the same before the jerk: what a disordered lattice pushes sideways
    still = np.mean(forces[REST - 15 : REST])
    return float(np.mean(forces[REST:]) - still) / (rate * 1e3 * SIDE**3)


@pytest.mark.slow
def test_a_strong_jerk_carries_more_of_the_water_along() -> None:
    """A part of the added mass that a strong jerk loses by tearing is held."""
    gentle = added_mass(PbfSettings(), 8.0)
    torn, held = added_mass(PbfSettings(), 100.0), added_mass(PbfSettings(suction=ALLOWED), 100.0)
    print(f"gentle {gentle:.3f}, torn {torn:.3f}, held {held:.3f}")
    assert torn < 0.85 * gentle
    assert 1.08 * torn < held < 1.05 * gentle
