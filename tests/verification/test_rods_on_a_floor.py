"""Thin parts beside a wall: lifted by what they displace, whatever particles lie beside them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seals.experiments.water_validation.box import solver_of
from seals.experiments.water_validation.case import Grade
from seals.plugins.fluids.coupling import Method
from seals.plugins.fluids.coupling.bodies import add_samples, clear_of
from seals.plugins.fluids.sampling import ALL, box_walls, sample_pieces
from seals.plugins.fluids.solver import Domain
from seals.robot.pieces import Piece

SPACING, COUNTS = 0.03, np.array([10, 8, 8])
LENGTH, RADIUS = 6 * SPACING, 0.5 * SPACING
STEP, STEPS = 0.004, 50
ALONG_X = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


@pytest.mark.parametrize("method", list(Method))
@pytest.mark.parametrize("height", [0.5, 1.0])
def test_a_rod_on_or_near_the_floor_is_lifted_by_what_it_displaces(
    height: float, method: Method
) -> None:
    """Lying on the floor, and half a spacing over it, where no particle fits under it."""
    size = COUNTS * SPACING
    axes = [SPACING * (np.arange(n) + 0.5) for n in COUNTS]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    rod = [Piece("cylinder", (RADIUS, LENGTH), np.zeros(3), ALONG_X)]
    middle = np.array([0.5 * size[0], 0.5 * size[1], height * SPACING])
    samples, whole = sample_pieces(rod, SPACING), sample_pieces(rod, SPACING, layers=ALL)
    places = clear_of(places, whole.placed(middle, np.eye(3)), SPACING)
    walls = box_walls(np.zeros(3), size, SPACING)
    water = solver_of(
        Domain(
            spacing=SPACING,
            lower=np.full(3, -3 * SPACING),
            upper=size + SPACING * np.array([3.0, 3.0, 8.0]),
            capacity=len(places),
            boundary_capacity=len(walls.points) + len(samples.points),
            bodies=1,
        ),
        grade=Grade(quick=True, solver=method),
    )
    water.add_boundary(body=0, points=walls.points)
    add_samples(water, 1, samples)
    water.add_particles(places)
    still, found = np.zeros((1, 3)), []
    for _ in range(STEPS):
        water.place_bodies(
            position=middle[None],
            rotation=np.eye(3)[None],
            velocity=still,
            spin=still,
            inverse_mass=np.zeros(1),
            inverse_inertia=np.zeros((1, 3, 3)),
            acceleration=still,
        )
        found.append(water.advance(STEP, substeps=water.substeps(STEP)))
    water.close()
    for e in found:
        gross = np.abs(e.gravity).sum() + np.abs(e.walls).sum()
        assert np.abs(e.external).max() < 1e-5 * gross
    weight = water.settings.density * water.settings.gravity * math.pi * RADIUS**2 * LENGTH
    assert float(np.mean([e.impulses[0, 2] for e in found[-20:]]) / STEP / weight) == pytest.approx(
        1.0, abs=0.03
    )
