"""The particle water's book-keeping: sorting, neighbours, refusals, snapshots."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.caches import HOME
from seals.errors import ConfigError, MissingExtra, PhysicsError
from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.device_settings import Search
from seals.plugins.fluids.solvers.pbf.engine import LOCKED, Engine
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.plugins.fluids.solvers.pbf.solver import SolverPbf

SPACING = 0.02
LISTED: dict[str, Any] = {"search": Search.list, "deterministic": True}
CELLS: dict[str, Any] = {"search": Search.cells, "deterministic": True, "outflow": True}
"""Two sets of settings for all that needs one: each takes seconds to compile."""
FLOOR = np.stack(np.meshgrid(np.arange(-1, 9), np.arange(-1, 9), [-0.5], indexing="ij"), -1)


def block(*counts: int, corner: float = 0.0) -> np.ndarray:
    """Return a lattice of water."""
    axes = np.meshgrid(*(SPACING * (np.arange(n) + 0.5) + corner for n in counts), indexing="ij")
    return np.stack(axes, -1).reshape(-1, 3)


@pytest.fixture(scope="module")
def waters() -> Iterator[dict[str, SolverPbf]]:
    """Waters by their settings: kernels are compiled once for each."""
    made: dict[str, SolverPbf] = {}
    yield made
    for water in made.values():
        water.close()


@pytest.fixture
def make(waters: dict[str, SolverPbf]) -> Callable[..., SolverPbf]:
    """Return an empty water in a box of 0.24 m."""

    def build(**settings: Any) -> SolverPbf:
        key = repr(sorted(settings.items(), key=str))
        if key not in waters:
            waters[key] = SolverPbf(
                Domain(
                    spacing=SPACING,
                    lower=(-0.04, -0.04, -0.04),
                    upper=(0.2, 0.2, 0.2),
                    capacity=600,
                    boundary_capacity=400,
                    bodies=0,
                ),
                settings=PbfSettings(**settings),
                engine=Engine(),
            )
        water = waters[key]
        water.remove_particles(np.ones(water.count, dtype=bool))
        water.boundary.clear(0)
        return water

    return build


def stirred(water: SolverPbf) -> SolverPbf:
    """Fill disordered water above a floor, and advance once."""
    rng = np.random.default_rng(1)
    points = block(8, 8, 8)
    water.add_boundary(body=0, points=(SPACING * FLOOR).reshape(-1, 3))
    water.add_particles(
        points + rng.uniform(-0.2, 0.2, points.shape) * SPACING,
        rng.normal(0, 0.1, points.shape),
    )
    water.advance(1e-3, substeps=1)
    return water


def test_lists_equal_brute_force(make: Callable[..., SolverPbf]) -> None:
    """Each particle's list holds what lies within the support, particles and samples."""
    water = stirred(make())
    solver = water.pipeline
    solver.kernels.start(False)
    particles, samples = solver.particles, solver.samples
    x = particles.place[1].to_numpy()[: water.count, :3]
    b = samples.place.to_numpy()[: water.boundary.count, :3]
    lists = particles.list.to_numpy()
    near, beside = particles.near.to_numpy(), particles.beside.to_numpy()
    filled = particles.filled.to_numpy()
    assert beside.max() > 0
    for i in range(water.count):
        fluid = lists[i, : near[i]]
        assert filled[i] % 8 == 0
        assert (lists[i, near[i] : filled[i]] == i).all()
        solid = lists[i, filled[i] : filled[i] + beside[i]]
        close = np.linalg.norm(x - x[i], axis=1) < 2 * SPACING
        close[i] = False
        assert sorted(fluid) == list(np.nonzero(close)[0])
        assert sorted(solid) == list(np.nonzero(np.linalg.norm(b - x[i], axis=1) < 2 * SPACING)[0])


def test_sorting_keeps_particles(make: Callable[..., SolverPbf]) -> None:
    """Numbers stay a permutation, cells ascend, and rows keep the order of filling."""
    water = stirred(make())
    number = water.pipeline.particles.number[0].to_numpy()[: water.count]
    assert sorted(number) == list(range(water.count))
    assert np.abs(water.positions() - block(8, 8, 8)).max() < 0.5 * SPACING


@pytest.mark.thorough
def test_list_and_cells_agree(make: Callable[..., SolverPbf]) -> None:
    """Both searches give the same step up to rounding; nothing leaves through open faces."""
    a, b = (stirred(make(**kind)) for kind in (LISTED, CELLS))
    assert a.positions() == pytest.approx(b.positions(), abs=1e-4 * SPACING)


def test_density_is_the_sum_over_neighbours(make: Callable[..., SolverPbf]) -> None:
    """On the lattice, inner particles have the rest density, a corner much less."""
    water = make()
    water.add_particles(block(6, 6, 6))
    # all fall alike
    water.advance(1e-4, substeps=1)
    found = water.densities().reshape(6, 6, 6)
    assert found[2:4, 2:4, 2:4] == pytest.approx(998.206, rel=1e-4)
    assert found[0, 0, 0] < 800.0


def test_snapshot_repeats_bit_for_bit(make: Callable[..., SolverPbf]) -> None:
    """Deterministic water goes on from a snapshot as it did the first time."""
    water = stirred(make(**LISTED))
    saved = water.snapshot()
    water.advance(4e-3, substeps=4)
    first = water.positions()
    water.restore(saved)
    water.advance(4e-3, substeps=4)
    assert np.array_equal(first, water.positions())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"count": 10**7}, "10000000 particles"),
        ({"count": -1}, "-1 particles"),
        ({"count": 27.0}, "27.0 particles"),
        ({"number": np.full(600, 10**8, np.int32)}, "not numbered"),
        ({"number": np.zeros(600, np.int32)}, "not numbered"),
        ({"origin": np.array([0.0, np.nan, 0.0])}, "origin"),
    ],
)
def test_a_forged_snapshot_is_refused(
    make: Callable[..., SolverPbf], change: dict[str, Any], words: str
) -> None:
    """Kernels do not look whether a particle lies within their arrays."""
    water = make(**LISTED)
    water.add_particles(block(3, 3, 3))
    saved = water.snapshot()
    with pytest.raises(ValueError, match=words):
        water.restore(replace(saved, arrays={**saved.arrays, **change}))
    water.restore(saved)
    assert water.count == 27


def test_take_write_and_shift(make: Callable[..., SolverPbf]) -> None:
    """Particles are taken out by row, overwritten, and stay where they are when the box moves."""
    water = stirred(make())
    where = water.positions()
    assert water.remove_particles(where[:, 2] > 0.1) == (where[:, 2] > 0.1).sum()
    kept = where[where[:, 2] <= 0.1]
    assert water.positions() == pytest.approx(kept, abs=1e-7)
    water.set_particles(velocities=np.ones_like(kept))
    water.shift_domain(np.array([1, 0, 0]))
    assert water.positions() == pytest.approx(kept, abs=1e-7)
    assert water.momentum() == pytest.approx(np.full(3, len(kept) * 998.206 * SPACING**3), rel=1e-5)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda x: x + 1.0, "outside the domain"),
        (lambda x: np.concatenate([x[:9], x[:9] + 0.3 * SPACING]), "overlap each other"),
        (lambda x: np.where(x > 0.14, np.nan, x), "not finite"),
        (lambda x: np.concatenate([x, x + 5.0]), "exceed the capacity of 600"),
        (lambda x: x[:, :2], "shape"),
        (lambda x: x[:9] + SPACING * np.array([0.5, 0.5, -0.8]), "overlap static boundary"),
    ],
)
def test_bad_fillings_are_refused(
    make: Callable[..., SolverPbf], change: Callable[[np.ndarray], np.ndarray], words: str
) -> None:
    """Each wrong filling is refused in words, and nothing is filled."""
    water = make()
    water.add_boundary(body=0, points=(SPACING * FLOOR).reshape(-1, 3))
    with pytest.raises(PhysicsError, match=words):
        water.add_particles(change(block(8, 8, 8)))
    assert water.count == 0


def test_trouble_is_said_in_words(make: Callable[..., SolverPbf]) -> None:
    """Lost particles, crowds, bodies never placed, unknown bodies, too many samples."""
    lost = make()
    lost.add_particles(block(2, 2, 2), np.full((8, 3), [0, 0, -50.0]))
    with pytest.raises(PhysicsError, match="8 times a particle was outside"):
        lost.advance(2e-3, substeps=1)
    crowd = make()
    crowd.add_particles(block(8, 8, 8) * 0.65)
    with pytest.raises(PhysicsError, match="more than neighbours=80"):
        crowd.advance(1e-4, substeps=1)
    with pytest.raises(PhysicsError, match="Boundary body 2 does not exist"):
        crowd.add_boundary(body=2, points=np.zeros((1, 3)))
    with pytest.raises(PhysicsError, match="exceed the capacity of 400"):
        crowd.add_boundary(body=0, points=block(8, 8, 8))


def test_bodies_must_be_placed() -> None:
    """Water with bodies does not advance before they were placed, one finite pose each."""
    water = SolverPbf(
        Domain(
            spacing=SPACING,
            lower=(0, 0, 0),
            upper=(1, 1, 1),
            capacity=1,
            boundary_capacity=1,
            bodies=1,
        ),
        settings=PbfSettings(),
        engine=Engine(),
    )
    with pytest.raises(PhysicsError, match="never placed"):
        water.advance(1e-3, substeps=1)
    z, turn = np.zeros((1, 3)), np.eye(3)[None]
    with pytest.raises(PhysicsError, match="for each of 1 bodies"):
        water.place_bodies(
            position=z + np.nan,
            rotation=turn,
            velocity=z,
            spin=z,
            inverse_mass=np.ones(1),
            inverse_inertia=turn,
            acceleration=z,
        )
    water.close()


def test_outflow_counts_what_leaves(make: Callable[..., SolverPbf]) -> None:
    """With open faces, water that leaves is taken out and counted."""
    water = make(**CELLS)
    water.add_particles(block(2, 2, 2), np.full((8, 3), [0, 0, -50.0]))
    assert water.advance(2e-3, substeps=1).left == 8
    assert water.count == 0


def test_one_engine_per_process(make: Callable[..., SolverPbf]) -> None:
    """Another start, an unknown device and absent CUDA are refused in words."""
    make()
    other = Engine(threads=Engine().threads + 1)
    with pytest.raises(ConfigError, match="already runs on cpu"):
        other.start(make())
    with pytest.raises(ConfigError, match="Allowed: cpu, cuda"):
        Engine(device="tpu")


ENDED = """
from seals.errors import ConfigError
from seals.plugins.fluids.solvers.pbf.engine import Engine

class Water: pass

first, second = Water(), Water()
for water in (first, second):
    Engine(threads=1).start(water)
Engine.leave(first)
try:
    Engine(threads=2).start(first)
except ConfigError:
    Engine.leave(second)
    Engine(threads=2).start(first)
    print("ended with the last one")
"""


def test_a_replaced_stream_brings_no_line_of_taichi() -> None:
    """Behind the plain streams of a command nothing of Taichi's shells is printed."""
    probe = (
        "import io, sys; sys.stdout = io.StringIO();"
        "import seals.plugins.fluids.solvers.pbf.language;"
        "sys.__stdout__.write(sys.stdout.getvalue())"
    )
    done = subprocess.run(
        [sys.executable, "-I", "-c", probe], capture_output=True, text=True, check=True
    )
    assert "shell" not in done.stdout + done.stderr


def test_taichi_ends_with_the_last_water() -> None:
    """What it has compiled goes with it, and another choice is free again."""
    done = subprocess.run(
        [sys.executable, "-P", "-c", ENDED], capture_output=True, text=True, check=True
    )
    assert "ended with the last one" in done.stdout


KEPT = """
import taichi as ti
from seals.plugins.fluids.solvers.pbf.engine import Engine

class Water: pass

water = Water()
Engine(threads=1).start(water)
ti.field(ti.f32, 4).fill(1.0)
Engine.leave(water)
"""


@pytest.mark.parametrize("age", [5.0, 3600.0])
def test_a_lock_left_by_a_killed_process_does_not_end_the_cache(age: float, tmp_path: Path) -> None:
    """What is compiled is kept again once the lock is old; the lock of a running process stays."""
    folder = tmp_path / "seals" / "taichi"
    folder.mkdir(parents=True, mode=0o700)
    lock = folder / "ticache.lock"
    lock.touch()
    then = time.time() - age
    os.utime(lock, (then, then))
    command = [sys.executable, "-P", "-W", "ignore", "-c", KEPT]
    subprocess.run(command, check=True, env={**os.environ, HOME: str(tmp_path)})
    assert bool(list(folder.glob("*.tic"))) == (age > LOCKED)
    assert lock.exists() == (age < LOCKED)


def test_inner_forces_conserve_momentum(make: Callable[..., SolverPbf]) -> None:
    """Cohesion and viscosity move no momentum out of the water, and take energy from it."""
    water = make(gravity=0.0, sound_speed=10.0, cohesion=0.01, viscosity=50.0)
    rng = np.random.default_rng(2)
    points = block(6, 6, 6, corner=0.02)
    water.add_particles(points, rng.normal(0, 0.2, points.shape))
    before, energy = water.momentum(), water.kinetic_energy()
    water.advance(5e-3, substeps=5)
    gross = 216 * 1000 * SPACING**3 * 0.2
    assert water.momentum() == pytest.approx(before, abs=1e-6 * gross)
    assert water.kinetic_energy() < energy


@pytest.mark.parametrize("name", ["wall_friction", "body_friction", "adhesion"])
def test_what_needs_stored_lists_is_refused_without_them(name: str) -> None:
    """It would be without effect, and nobody would know."""
    with pytest.raises(ConfigError, match=f"stores no lists of neighbours, which {name} needs"):
        PbfSettings(search=Search.cells, **{name: 0.01})
    assert getattr(PbfSettings(**{name: 0.01}), name) == 0.01


def test_another_kernel_language_is_taken_where_taichi_is_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Taichi first, then Quadrants, then words; a package that is asked for rules."""
    from seals.plugins.fluids.solvers.pbf import language as module

    monkeypatch.delenv("SEALS_TAICHI", raising=False)
    there = {"taichi": object(), "quadrants": object()}
    monkeypatch.setattr(module, "find_spec", there.get)
    assert module.language() == "taichi"
    del there["taichi"]
    assert module.language() == "quadrants"
    del there["quadrants"]
    with pytest.raises(MissingExtra, match="pip install quadrants"):
        module.language()
    monkeypatch.setenv("SEALS_TAICHI", "mine")
    assert module.language() == "mine"
