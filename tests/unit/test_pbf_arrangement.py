"""Water arranged for a CUDA device moves as it does on a processor."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.pbf.engine import Engine
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.plugins.fluids.solvers.pbf.solver import SolverPbf

SPACING = 0.02


class Arranged(Engine):
    """Engine on the processor whose water is arranged as on a CUDA device."""

    started = False

    @property
    def accelerated(self) -> bool:
        """Whether the water is arranged so."""
        return self.started

    def start(self, water: object) -> object:
        """Start on the processor."""
        module = super().start(water)
        self.started = True
        return module


def splash(engine: Engine) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Let a shell fall on a block of water; return places [m] and the impulse on it [N s]."""
    counts, inside = (9, 7, 6), np.array([0.24, 0.14, 0.3])
    axes = [SPACING * (np.arange(n) + 0.5) for n in counts]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    side = [np.arange(-0.5, round(s / SPACING) + 1) * SPACING for s in inside]
    box = np.stack(np.meshgrid(*side, indexing="ij"), -1).reshape(-1, 3)
    walls = box[((box < 0) | (box > inside)).any(axis=1)]
    shell = np.stack(np.meshgrid(*[(-SPACING, 0.0, SPACING)] * 3), -1).reshape(-1, 3)
    shell = shell[abs(shell).max(axis=1) > 0]
    water = SolverPbf(
        Domain(
            spacing=SPACING,
            lower=np.full(3, -SPACING),
            upper=inside + SPACING,
            capacity=len(points),
            boundary_capacity=len(walls) + len(shell),
            bodies=1,
        ),
        settings=PbfSettings(deterministic=True),
        engine=engine,
    )
    water.add_boundary(body=0, points=walls)
    water.add_boundary(body=1, points=shell)
    water.add_particles(points)
    where = (np.array([[0.08, 0.07, 0.16]]), np.eye(3)[None], np.array([[0.0, 0.0, -2.0]]))
    impulse, spin = np.zeros(6), np.zeros((1, 3))
    for _ in range(4):
        water.place_bodies(
            position=where[0],
            rotation=where[1],
            velocity=where[2],
            spin=spin,
            inverse_mass=np.array([5.0]),
            inverse_inertia=5e3 * np.eye(3)[None],
            acceleration=np.array([[0.0, 0.0, -9.81]]),
        )
        impulse += water.advance(2e-3, substeps=2).impulses[0]
        *where, spin = water.placed()
    places = water.positions()
    water.close()
    return places, impulse


@pytest.mark.slow
def test_water_moves_alike_where_it_is_arranged_for_a_card() -> None:
    """Arranged for a CUDA device, with its one kernel a substep, water differs by rounding."""
    plain, push = splash(Engine(device="cpu", threads=1))
    packed, pushed = splash(Arranged(device="cpu", threads=1))
    assert np.linalg.norm(push[:3]) > 1e-2
    assert abs(packed - plain).max() < 1e-4 * SPACING
    assert np.allclose(pushed, push, atol=1e-4 * abs(push).max())
