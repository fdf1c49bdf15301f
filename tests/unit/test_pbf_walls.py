"""Skin friction of walls: a slab of water that slides over a floor."""

from __future__ import annotations

import numpy as np
import pytest

from seals.plugins.fluids.sampling import box_walls
from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.device_settings import DeviceSettings
from seals.plugins.fluids.solvers.dfsph.settings import DfsphOptions, DfsphSettings
from seals.plugins.fluids.solvers.pbf.engine import Engine
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.plugins.fluids.solvers.pbf.solver import SolverPbf

pytestmark = pytest.mark.filterwarnings("ignore:.*getdefaultlocale:DeprecationWarning")
SPACING, STEP, STEPS = 0.05, 0.002, 25
SIZE = np.array([1.6, 0.4, 0.2])


def slid(friction: float) -> tuple[float, float, float]:
    """Return momentum of the slab before and after, and what the floor took, along x [N s]."""
    walls = box_walls(np.zeros(3), SIZE, SPACING, closed=("z_low",))
    physics = PbfSettings(wall_friction=friction, viscosity=0.0)
    water = SolverPbf(
        Domain(
            spacing=SPACING,
            lower=-0.4 * np.ones(3),
            upper=SIZE + 0.4,
            capacity=4096,
            boundary_capacity=len(walls.points),
            bodies=0,
        ),
        settings=physics,
        engine=Engine(),
    )
    water.add_boundary(body=0, points=walls.points)
    # one layer, away from the edges of the floor
    axes = [np.arange(0.4, 0.8, SPACING), np.arange(0.1, 0.3, SPACING), [0.5 * SPACING]]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    water.add_particles(places, np.tile([2.0, 0.0, 0.0], (len(places), 1)))
    before, taken = water.momentum()[0], 0.0
    for _ in range(STEPS):
        taken += float(water.advance(STEP, substeps=1).walls[0])
    after = float(water.momentum()[0])
    water.close()
    return float(before), after, taken


@pytest.mark.thorough
def test_a_floor_takes_what_its_skin_friction_says() -> None:
    """One layer: speed decays as 1 / (1 + friction speed time / (2 spacing)), momentum is kept."""
    before, after, taken = slid(0.05)
    expected = 1.0 / (1.0 + 0.5 * 0.05 * 2.0 * STEPS * STEP / SPACING)
    assert after / before == pytest.approx(expected, abs=0.2 * (1.0 - expected))
    assert taken == pytest.approx(before - after, rel=1e-4)


def test_walls_slide_without_friction() -> None:
    """Nothing is taken along a floor of fine samples but what its own roughness takes."""
    before, after, _ = slid(0.0)
    assert after / before > 0.998


@pytest.mark.thorough
@pytest.mark.parametrize("method", ["pbf", pytest.param("dfsph", marks=pytest.mark.slow)])
def test_a_body_takes_water_along_and_pays_for_it(method: str) -> None:
    """A plate moves under a layer at rest: the layer follows as on a floor, momentum is kept."""
    plate = box_walls(np.zeros(3), SIZE, SPACING, closed=("z_low",))
    physics: DeviceSettings = PbfSettings(body_friction=0.05, viscosity=0.0, gravity=0.0)
    if method == "dfsph":
        physics = DfsphSettings.of(physics, DfsphOptions())
    domain = Domain(
        spacing=SPACING,
        lower=-0.6 * np.ones(3),
        upper=SIZE + 0.6,
        capacity=4096,
        boundary_capacity=len(plate.points),
        bodies=1,
    )
    water = physics.build(domain, device="cpu", threads=1)
    water.add_boundary(body=1, points=plate.points)
    axes = [np.arange(0.4, 0.8, SPACING), np.arange(0.1, 0.3, SPACING), [0.5 * SPACING]]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    water.add_particles(places, trusted=True)
    given = 0.0
    for k in range(STEPS):
        water.place_bodies(
            position=np.array([[2.0 * k * STEP, 0.0, 0.0]]),
            rotation=np.eye(3)[None],
            velocity=np.array([[2.0, 0.0, 0.0]]),
            spin=np.zeros((1, 3)),
            inverse_mass=np.zeros(1),
            inverse_inertia=np.zeros((1, 3, 3)),
            acceleration=np.zeros((1, 3)),
        )
        given -= float(water.advance(STEP, substeps=1).impulses[0, 0])
    got = float(water.momentum()[0])
    most = 2.0 * len(places) * 1000.0 * SPACING**3
    water.close()
    expected = 1.0 - 1.0 / (1.0 + 0.5 * 0.05 * 2.0 * STEPS * STEP / SPACING)
    assert got / most == pytest.approx(expected, rel=0.2)
    assert given == pytest.approx(got, rel=1e-4)
