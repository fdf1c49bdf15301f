"""Wetting: a drop on a floor has the contact angle of Young and Dupre."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings

TENSION, SPACING, ACROSS = 0.25, 5e-4, 6
GRAVITY = 3.0
"""Holds the drop on the floor; flattens it by a hundredth, rho g R^2 / gamma = 0.1 [m/s^2]."""
STEPS, EACH = 60, 20
"""Steps of a run, and those in a period of Rayleigh's [1]."""


def angle(work: float) -> float:
    """Contact angle of a drop that began as half of a sphere [degrees].

    A cap of volume V and height H has the radius r of V = pi H^2 (3 r - H) / 3.

    Args:
        work: of adhesion [N/m].
    """
    radius = ACROSS * SPACING
    side = SPACING * (np.arange(-ACROSS - 1, ACROSS + 1) + 0.5)
    places = np.stack(np.meshgrid(side, side, side[side > 0], indexing="ij"), -1).reshape(-1, 3)
    places = places[(places**2).sum(axis=1) < radius**2]
    half = 2.6 * radius
    floor_axis = np.arange(-half, half, SPACING) + 0.5 * SPACING
    floor = np.stack(np.meshgrid(floor_axis, floor_axis, [-0.5 * SPACING]), -1).reshape(-1, 3)
    drop = PbfSettings(
        gravity=GRAVITY, sound_speed=8.0, cohesion=TENSION, adhesion=work, artificial_viscosity=20.0
    ).build(
        Domain(
            spacing=SPACING,
            lower=np.array([-half, -half, -2 * SPACING]),
            upper=np.array([half, half, 5 * radius]),
            capacity=len(places),
            boundary_capacity=len(floor),
            bodies=0,
        ),
        device="cpu",
        threads=0,
    )
    drop.add_boundary(body=0, points=floor)
    drop.add_particles(places)
    step = 2.0 * math.pi * math.sqrt(PbfSettings().density * radius**3 / (8.0 * TENSION)) / EACH
    weight = drop.pipeline.mass * len(places) * GRAVITY
    found = []
    for k in range(STEPS):
        passed = drop.advance(step, substeps=drop.substeps(step))
        # what the floor pulls, the drop is pulled
        assert abs(passed.external).max() < 1e-4 * weight * step
        if k >= STEPS - 20:
            top = np.sort(drop.positions()[:, 2])[-3:].mean() + 0.5 * SPACING
            volume = len(places) * SPACING**3
            sphere = (3.0 * volume / (math.pi * top**2) + top) / 3.0
            found.append(math.degrees(math.acos(1.0 - top / sphere)))
    drop.close()
    return float(np.mean(found))


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.5, 0.7, 1.0, 1.2])
def test_a_drop_has_the_angle_of_young_and_dupre(share: float) -> None:
    """W = gamma (1 + cos theta), within six degrees from 75 to 120."""
    exact = math.degrees(math.acos(share - 1.0))
    found = angle(share * TENSION)
    print(f"W = {share} gamma: {found:.1f} degrees, Young and Dupre {exact:.1f}")
    assert found == pytest.approx(exact, abs=6.0)
