"""Vectors in words: what is read is what was written, and water moves as it does without them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.pbf.device.packing import Quads, Symmetrics, Triples
from seals.plugins.fluids.solvers.pbf.engine import Engine
from seals.plugins.fluids.solvers.pbf.fields import Fields
from seals.plugins.fluids.solvers.pbf.language import ti
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.plugins.fluids.solvers.pbf.solver import SolverPbf

SPACING = 0.02
COUNT = 200


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


class Holder:
    """What the engine runs for where there is no water."""


@pytest.fixture
def fields() -> Iterator[Fields]:
    """Group of fields, while the engine runs."""
    holder = Holder()
    Engine(device="cpu", threads=1).start(holder)
    group = Fields()
    yield group
    group.free()
    Engine.leave(holder)


def test_words_hold_vectors_and_matrices(fields: Fields) -> None:
    """Vectors come back as they were, the numbers of matrices within half a bit of 21."""
    rng = np.random.default_rng(2)
    quads, triples = Quads(fields, COUNT, True), Triples(fields, COUNT, True)
    matrices, read = Symmetrics(fields, COUNT, True), fields.vector(6, ti.f32, COUNT)
    given = fields.vector(6, ti.f32, COUNT)
    fields.allocate()
    four = rng.normal(0.0, 1e3, (COUNT, 4)).astype(np.float32)
    three = rng.normal(0.0, 1e-3, (COUNT, 3)).astype(np.float32)
    six = rng.uniform(-1.0, 0.999, (COUNT, 6)).astype(np.float32)
    quads.from_numpy(four)
    triples.from_numpy(three)
    given.from_numpy(six)

    @ti.kernel
    def through():  # noqa: ANN202
        for i in range(COUNT):
            quads.set(i, quads.get(i))
            quads.set_last(i, 2.0 * quads.get(i)[3])
            triples.add(i, triples.get(i))
            matrices.set(i, given[i])
            read[i] = matrices.get(i)

    through()
    four[:, 3] *= 2.0
    assert np.array_equal(quads.to_numpy(), four)
    assert np.array_equal(triples.to_numpy(), 2.0 * three)
    assert abs(read.to_numpy() - six).max() < 2.0**-21 * 1.3


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
def test_water_moves_alike_in_words() -> None:
    """Arranged for a CUDA device, with its one kernel a substep, water differs by rounding."""
    plain, push = splash(Engine(device="cpu", threads=1))
    packed, pushed = splash(Arranged(device="cpu", threads=1))
    assert np.linalg.norm(push[:3]) > 1e-2
    assert abs(packed - plain).max() < 1e-5 * SPACING * 10
    assert np.allclose(pushed, push, atol=1e-4 * abs(push).max())
