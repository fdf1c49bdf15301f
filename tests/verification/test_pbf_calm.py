"""What keeps particle water calm takes no smooth flow out of it."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

with warnings.catch_warnings():
    warnings.simplefilter("ignore", DeprecationWarning)
    pytest.importorskip("taichi")

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.pbf.engine import Engine
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.plugins.fluids.solvers.pbf.solver import SolverPbf

SPACING = 0.025


def afloat_in_nothing(counts: int, **settings: float) -> tuple[SolverPbf, np.ndarray]:
    """A cube of water without gravity or walls, and which of its particles are far inside."""
    axis = SPACING * (np.arange(counts) + 4.5)
    places = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    water = SolverPbf(
        Domain(
            spacing=SPACING,
            lower=np.zeros(3),
            upper=np.full(3, (counts + 8) * SPACING),
            capacity=len(places),
            boundary_capacity=1,
            bodies=0,
        ),
        settings=PbfSettings(gravity=0.0, sound_speed=5.0, **settings),
        engine=Engine(),
    )
    water.add_particles(places)
    middle = np.abs(places - places.mean(axis=0)).max(axis=1)
    return water, middle < (0.5 * counts - 4.5) * SPACING


def kept(flow: str, **settings: float) -> float:
    """Share of a flow that is left inside the cube after twenty substeps of 1 ms."""
    water, inside = afloat_in_nothing(16, **settings)
    places = water.positions()
    rows = np.round(places / SPACING - 0.5).astype(int)
    across = places[:, 2] - places[:, 2].mean()
    speed = np.zeros_like(places)
    # so slow that nothing moves by more than a hundredth of a spacing
    speed[:, 0] = 0.01 * (across / (8 * SPACING) if flow == "shear" else (-1.0) ** rows.sum(axis=1))
    water.set_particles(velocities=speed)
    before = water.momentum()
    water.advance(0.02, substeps=20)
    found = water.velocities()
    assert np.abs(water.momentum() - before).max() < 1e-6 * np.abs(speed).sum() * SPACING**3 * 1e3
    water.close()
    return float((found[inside, 0] @ speed[inside, 0]) / (speed[inside, 0] @ speed[inside, 0]))


def test_calming_takes_out_what_alternates_and_leaves_shear() -> None:
    """Of motion against the neighbours nearly nothing is left, of a smooth shear nearly all."""
    assert kept("alternating", artificial_viscosity=400.0) < 0.05
    assert kept("shear", artificial_viscosity=400.0) == pytest.approx(1.0, abs=0.01)
