"""Tank and moving domain run on any solver that fulfils the protocol of particle solvers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.environment.settings import EnvironmentSettings
from seals.errors import ConfigError
from seals.fluid import BodyStates, FluidBody, Surrounding
from seals.plugins.fluids.coupling import ParticleFluid
from seals.plugins.fluids.moving_domain import FluidWindow
from seals.plugins.fluids.solver import Domain, Exchange, ParticleSolver, Snapshot
from seals.plugins.fluids.solvers.device_settings import Kernel
from seals.plugins.fluids.solvers.dfsph.settings import DfsphSettings
from seals.plugins.fluids.tank import FluidParticles
from seals.plugins.waves.still import WaveStill
from seals.robot.pieces import Piece

Floats = NDArray[np.float64]
STEP, PUSH = 0.01, 3.0
BALL = FluidBody("robot/ball", (Piece("sphere", (0.1,), np.zeros(3), np.eye(3)),))


class FallingSolver:
    """Free fall of all particles, without pressure; every body gets the same push upwards."""

    def __init__(self, options: FallingSettings, given: Domain) -> None:
        """Start empty."""
        self.options, self.given = options, given
        self.spacing, self.capacity = given.spacing, given.capacity
        self.origin = np.array(given.lower, dtype=float)
        self.x, self.v = np.zeros((0, 3)), np.zeros((0, 3))
        self.boundary: dict[int, Floats] = {}
        self.sound = options.sound_speed
        self.closed = False

    @property
    def count(self) -> int:
        """Particles."""
        return len(self.x)

    @property
    def boundary_count(self) -> int:
        """Boundary samples."""
        return sum(map(len, self.boundary.values()))

    def add_particles(
        self, positions: Any, velocities: Any = None, *, trusted: bool = False
    ) -> None:
        """Append."""
        self.x = np.concatenate([self.x, positions])
        new = np.zeros_like(positions) if velocities is None else velocities
        self.v = np.concatenate([self.v, new])

    def remove_particles(self, chosen: Any) -> int:
        """Delete."""
        self.x, self.v = self.x[~chosen], self.v[~chosen]
        return int(chosen.sum())

    def set_particles(self, *, positions: Any = None, velocities: Any = None) -> None:
        """Overwrite."""
        self.x = self.x if positions is None else positions
        self.v = self.v if velocities is None else velocities

    def positions(self) -> Floats:
        """Copy."""
        return self.x.copy()

    def velocities(self) -> Floats:
        """Copy."""
        return self.v.copy()

    def shift_domain(self, spacings: Any) -> None:
        """Move the corner."""
        self.origin = self.origin + spacings * self.spacing

    def add_boundary(self, *, body: int, points: Any, **rest: Any) -> None:
        """Keep."""
        self.boundary[body] = points

    def move_boundary(self, *, body: int, points: Any) -> None:
        """Keep."""
        self.boundary[body] = points

    def place_bodies(self, **state: Any) -> None:
        """Check the number of bodies."""
        assert len(state["position"]) == self.given.bodies

    def substeps(self, step: float) -> int:
        """Two."""
        return 2

    def advance(self, step: float, *, substeps: int) -> Exchange:
        """Fall freely, push every body."""
        impulses = np.zeros((self.given.bodies, 6))
        impulses[:, 2] = PUSH * step
        self.v = self.v - np.array([0.0, 0.0, self.options.gravity * step])
        self.x = self.x + step * self.v
        mass = self.options.density * self.spacing**3
        gravity = np.array([0.0, 0.0, -self.options.gravity * step * mass * self.count])
        none = np.zeros(3)
        return Exchange(impulses, none, gravity, none, float(substeps), 0.0, 0.0, 0)

    def momentum(self) -> Floats:
        """Sum."""
        return np.asarray(self.options.density * self.spacing**3 * self.v.sum(axis=0))

    def kinetic_energy(self) -> float:
        """Sum."""
        return float(0.5 * self.options.density * self.spacing**3 * (self.v**2).sum())

    def snapshot(self) -> Snapshot:
        """Keep the arrays."""
        return Snapshot({"x": self.x, "v": self.v, "origin": self.origin})

    def restore(self, snapshot: Snapshot) -> None:
        """Put the arrays back."""
        self.x, self.v, self.origin = (snapshot.arrays[name] for name in ("x", "v", "origin"))

    def close(self) -> None:
        """Note it."""
        self.closed = True


@dataclass(kw_only=True)
class FallingSettings:
    """Options of the falling solver."""

    density: float = 1000.0
    gravity: float = 9.81
    sound_speed: float = 0.0
    outflow: bool = False
    built: list[FallingSolver] = field(default_factory=list)

    def build(self, domain: Domain, *, device: str, threads: int) -> FallingSolver:
        """Allocate and remember the solver."""
        self.built.append(FallingSolver(self, domain))
        return self.built[-1]


def states() -> BodyStates:
    """Return a body that is held at the origin."""
    z, turn = np.zeros((1, 3)), np.eye(3)[None]
    return BodyStates(z, turn, z, z, np.zeros(1), np.zeros((1, 3, 3)), z)


@pytest.mark.parametrize("kind", [FluidParticles, FluidWindow])
def test_a_domain_runs_on_another_solver(kind: type[ParticleFluid]) -> None:
    """Filling, exchange, momentum of a free fall, snapshot and close by the protocol alone."""
    physics = FallingSettings()
    fluid: Any = kind(spacing=0.05, size=[1.0, 1.0, 0.4], physics=physics, look=0.0)
    environment = EnvironmentSettings(water_level=0.0, water_density=1000.0)
    fluid.open(Surrounding(environment, WaveStill(), (), STEP), [BALL])
    (solver,) = physics.built
    assert isinstance(solver, ParticleSolver)
    fluid.initialise(states())
    filled = fluid.diagnostics()["particles"]
    assert 20 * 20 * 8 - 40 < filled < 20 * 20 * 8
    assert fluid.exchange(states(), 0.0, STEP) == pytest.approx(
        np.array([[0.0, 0.0, PUSH * STEP, 0.0, 0.0, 0.0]])
    )
    balance = fluid.momentum_balance()
    assert balance.gravity[2] == pytest.approx(-9.81 * STEP * filled * 1000.0 * 0.05**3)
    # the falling solver invents the push: the balance shows exactly that
    assert balance.gap == pytest.approx([0.0, 0.0, -PUSH * STEP], abs=1e-9)
    kept, there = fluid.snapshot(), fluid.particles()[0]
    fluid.exchange(states(), STEP, STEP)
    fluid.restore(kept)
    assert (fluid.particles()[0] == there).all()
    fluid.close()
    assert solver.closed


def test_divergence_free_sph_refuses_a_kernel_that_lets_its_pressures_run_away() -> None:
    """The refusal names the kernel to use."""
    with pytest.raises(ConfigError, match=r"unstable with fluid.solver=dfsph(.|\n)*kernel=spline"):
        DfsphSettings(kernel=Kernel.wendland)


def test_a_shift_relaxes_the_places_of_the_ring_alone() -> None:
    """Velocities, and places inside of the ring, are those without relaxation."""
    found = []
    for relaxations in (0, 3):
        physics = FallingSettings()
        fluid: Any = FluidWindow(
            spacing=0.05, size=[1.0, 1.0, 0.4], physics=physics, relaxations=relaxations
        )
        environment = EnvironmentSettings(water_level=0.0, water_density=1000.0)
        fluid.open(Surrounding(environment, WaveStill(), (), STEP), [BALL])
        fluid.initialise(states())
        moved = states()._replace(position=np.array([[0.06, 0.0, 0.0]]))
        fluid.exchange(moved, 0.0, STEP)
        assert fluid.simulation.shifts == 1
        found.append(fluid.particles())
        near = fluid.simulation.box.weight(found[-1][0]) > 0.0
        fluid.close()
    (place, speed), (relaxed, after) = found
    assert (after == speed).all()
    assert (relaxed[~near] == place[~near]).all()
    # the falling solver falls by g h^2 in each of three substeps of half a step
    assert place[near][:, 2] - relaxed[near][:, 2] == pytest.approx(3 * 9.81 * (STEP / 2) ** 2)
