"""Still water, floating bodies and the momentum account of the particle water."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from seals.plugins.fluids.solver import Domain, Exchange
from seals.plugins.fluids.solvers.pbf.engine import Engine
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.plugins.fluids.solvers.pbf.solver import SolverPbf

GRAVITY = 9.81
SPACING = 0.025
SIDE = 0.2  # of the floating cube: 8 spacings


def lattice(counts: tuple[int, int, int], first: float) -> np.ndarray:
    """Return a lattice that starts ``first`` spacings from the origin."""
    axes = [SPACING * (np.arange(n) + first) for n in counts]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def shell(counts: tuple[int, int, int], first: float) -> np.ndarray:
    """Return the outer layer of a lattice."""
    points = lattice(counts, first)
    steps = np.round(points / SPACING - first)
    return points[((steps == 0) | (steps == np.array(counts) - 1)).any(axis=1)]


def tank(counts: tuple[int, int, int], bodies: int, **settings: float) -> SolverPbf:
    """Return an empty tank with room for twice the height."""
    inside = (counts[0], counts[1], 2 * counts[2])
    samples = shell(tuple(n + 2 for n in inside), -0.5)  # type: ignore[arg-type]
    water = SolverPbf(
        Domain(
            spacing=SPACING,
            lower=np.full(3, -SPACING),
            upper=SPACING * (np.array(inside) + 1.0),
            capacity=int(np.prod(counts)),
            boundary_capacity=len(samples) + 600,
            bodies=bodies,
        ),
        settings=PbfSettings(**settings),  # type: ignore[arg-type]
        engine=Engine(),
    )
    water.add_boundary(body=0, points=samples)
    return water


@pytest.fixture(scope="module")
def column() -> Iterator[SolverPbf]:
    """A column of 8 x 8 x 20 spacings, after one second and a half."""
    water = tank((8, 8, 20), 0, viscosity=20.0)
    points = lattice((8, 8, 20), 0.5)
    rng = np.random.default_rng(0)
    water.add_particles(points + rng.uniform(-0.1, 0.1, points.shape) * SPACING)
    water.advance(1.5, substeps=500)
    yield water
    water.close()


@pytest.mark.thorough
def test_column_keeps_its_height(column: SolverPbf) -> None:
    """The pressure vanishes at the height that was filled, within two per cent."""
    where, pressure = column.positions()[:, 2], column.pressures()
    middle = (where > 3 * SPACING) & (where < 17 * SPACING)
    slope, offset = np.polyfit(where[middle], pressure[middle], 1)
    # p = rho g (H - z)
    assert -offset / slope == pytest.approx(20 * SPACING, rel=0.02)
    assert slope == pytest.approx(-1000 * GRAVITY, rel=0.05)


def test_column_comes_to_rest(column: SolverPbf) -> None:
    """Kinetic energy is far below that of a fall by one spacing."""
    mass = column.count * 1000 * SPACING**3
    assert column.kinetic_energy() < 0.02 * mass * GRAVITY * SPACING


def test_floor_carries_the_column(column: SolverPbf) -> None:
    """The walls receive the weight of the water, averaged over a tenth of a second."""
    weight = column.count * 1000 * SPACING**3 * GRAVITY
    assert column.advance(0.1, substeps=33).walls[2] == pytest.approx(-0.1 * weight, rel=0.02)


class Float:
    """A cube that moves by its own symplectic Euler steps."""

    def __init__(self, water: SolverPbf, ratio: float, centre: np.ndarray) -> None:
        self.water, self.mass = water, ratio * 1000 * SIDE**3
        self.centre, self.velocity = centre, np.zeros(3)
        self.rotation, self.spin = np.eye(3), np.zeros(3)
        n = round(SIDE / SPACING)
        water.add_boundary(body=1, points=shell((n, n, n), -(n - 1) / 2))

    def step(self, step: float, substeps: int) -> Exchange:
        """Advance body and water by one step."""
        fall = np.array([0.0, 0.0, -GRAVITY])
        inverse = np.eye(3) * 6 / (self.mass * SIDE**2)
        self.water.place_bodies(
            position=self.centre[None],
            rotation=self.rotation[None],
            velocity=self.velocity[None],
            spin=self.spin[None],
            inverse_mass=np.array([1 / self.mass]),
            inverse_inertia=inverse[None],
            acceleration=fall[None],
        )
        found = self.water.advance(step, substeps=substeps)
        self.velocity = self.velocity + step * fall + found.impulses[0, :3] / self.mass
        self.spin = self.spin + inverse @ found.impulses[0, 3:]
        placed = self.water.placed()
        self.centre, self.rotation = placed[0][0], placed[1][0]
        # what the water made of the body is what its impulse makes of it; substeps are single
        # precision, and so is the share of gravity in them
        assert placed[2][0] == pytest.approx(self.velocity, abs=1e-8)
        u, _, v = np.linalg.svd(self.rotation)
        self.rotation = u @ v
        return found


def floating(ratio: float, sunk: float, *, seconds: float) -> tuple[Float, list[Exchange]]:
    """Let a cube float, started ``sunk`` of its height deep; return it and the exchanges."""
    counts = (16, 16, 14)
    water = tank(counts, 1, viscosity=10.0)
    level = counts[2] * SPACING
    centre = np.array([8 * SPACING, 8 * SPACING, level + (0.5 - sunk) * SIDE])
    points = lattice(counts, 0.5)
    free = (np.abs(points - centre) > 0.5 * SIDE + 0.45 * SPACING).any(axis=1)
    water.add_particles(points[free])
    body = Float(water, ratio, centre)
    return body, [body.step(4e-3, 1) for _ in range(round(seconds / 4e-3))]


@pytest.mark.thorough
def test_a_cube_floats_at_its_density_ratio() -> None:
    """A cube of ratio 0.8 floats upright with 0.8 of its height wet, within five per cent."""
    body, found = floating(0.8, 0.85, seconds=1.2)
    try:
        lift = np.mean([e.impulses[0, 2] for e in found[-75:]]) / 4e-3
        assert lift == pytest.approx(body.mass * GRAVITY, rel=0.02)
        water = body.water
        where, pressure = water.positions(), water.pressures()
        z = where[:, 2]
        edge = np.abs(where[:, :2] - 8 * SPACING).max(axis=1) > 0.5 * SIDE + 2 * SPACING
        open_water = edge & (z > 3 * SPACING) & (z < 10 * SPACING)
        slope, offset = np.polyfit(z[open_water], pressure[open_water], 1)
        draught = float(-offset / slope) - (body.centre[2] - 0.5 * SIDE)
        assert draught / SIDE == pytest.approx(0.8, abs=0.05)
    finally:
        body.water.close()


@pytest.mark.slow
def test_a_light_cube_rises_stays_whole_and_balances() -> None:
    """A tenth of the displaced mass, released under water: stable, and momentum adds up."""
    body, found = floating(0.1, 0.9, seconds=0.8)
    try:
        assert body.centre[2] > 12 * SPACING
        assert np.abs(body.velocity).max() < 1.0
        for exchange in found:
            # gross: everything exchanged in the step, gravity on the water included
            gross = np.abs(exchange.gravity).sum() + np.abs(exchange.walls).sum()
            assert np.abs(exchange.external).max() < 1e-4 * gross
    finally:
        body.water.close()
