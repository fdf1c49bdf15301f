"""Torque-free tumbling of an asymmetric body, and the measured order of both integrators."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.effects import MediumKind
from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.angular_drag import DragAngular
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.linear_drag import DragLinear

if TYPE_CHECKING:
    from tests.verification.conftest import Bench, Trajectory

Floats = NDArray[np.float64]
MOMENTS = np.array([0.02, 0.05, 0.06])
SPIN = [0.3, 4.0, 0.2]
"""Mostly about the middle axis: the tennis-racket motion, the hardest case [rad/s]."""


def drift(run: Trajectory) -> tuple[float, float]:
    """Return the largest relative change of angular momentum and of energy."""
    inertia = np.einsum("nij,j,nkj->nik", run.rotation, MOMENTS, run.rotation)
    momentum = np.einsum("nij,nj->ni", inertia, run.angular_velocity)
    energy = 0.5 * np.einsum("ni,ni->n", momentum, run.angular_velocity)
    turned = np.linalg.norm(momentum - momentum[0], axis=1).max() / np.linalg.norm(momentum[0])
    return float(turned), float(np.abs(energy / energy[0] - 1.0).max())


def tumble(bench: Bench, engine: str, step: float, duration: float) -> tuple[float, float]:
    """Return the drifts of momentum and energy of a free tumbling body."""
    settings = bench.settings(
        bench.body(1.0, MOMENTS), weight=False, step=step, duration=duration, angular_velocity=SPIN
    )
    found = drift(bench.run(engine, settings))
    print(
        f"{engine} h = {step * 1e3:g} ms, {duration:g} s: "
        f"momentum {found[0]:.2e}, energy {found[1]:.2e}"
    )
    return found


def check_world(bench: Bench, duration: float) -> None:
    """Drifts fall with the square of the step and stay below the bound of the scheme."""
    steps = (0.004, 0.001, 0.00025)
    found = np.array([tumble(bench, "world", h, duration) for h in steps])
    # second order: the error of a rate w after t is at most C w t (w h)^2 with C = 1 for the
    # leapfrog with half-step velocities (C = 3/8 + 3/8 + 1/24, see the terminal velocity)
    speed = float(np.linalg.norm(SPIN))
    for h, row in zip(steps, found, strict=True):
        assert (row < speed * duration * (speed * h) ** 2).all()
    # a quarter of the step: 16 times less, 12 leaves room for the next order
    assert (found[0] / found[1] > 12.0).all()
    assert (found[1] / found[2] > 12.0).all()


def test_drift_of_the_world(bench: Bench) -> None:
    """Momentum and energy drift with the square of the step in PyBullet."""
    check_world(bench, 2.0)


@pytest.mark.slow
def test_drift_of_the_world_over_ten_seconds(bench: Bench) -> None:
    """The same over ten seconds, past the flips of the middle axis."""
    check_world(bench, 10.0)


@pytest.mark.thorough
def test_drift_of_the_twin(bench: Bench) -> None:
    """Momentum and energy of the twin stay within 1e-6 over ten seconds at 1 ms."""
    momentum, energy = tumble(bench, "twin", 0.001, 10.0)
    # fourth order: w t (w h)^4 / 120 = 40 x 2.6e-10 / 120 = 9e-11 plus 10,000 roundings of 1e-16
    assert momentum < 1e-9
    assert energy < 1e-9


def final(bench: Bench, engine: str, step: float) -> Floats:
    """Return the final state of a body under smooth, nonlinear, coupled loads."""
    coupling = np.zeros((6, 6))
    coupling[0, 4] = coupling[4, 0] = 0.05
    coupling[1, 3] = coupling[3, 1] = -0.04
    added = AddedMass(
        mass_x=0.5,
        mass_y=1.0,
        mass_z=1.5,
        inertia_x=0.02,
        inertia_y=0.03,
        inertia_z=0.01,
        coupling=coupling.tolist(),
    )
    drag = DragLinear(
        coefficient_x=1.0, coefficient_y=2.0, coefficient_z=3.0, medium=MediumKind.water
    )
    turn = DragAngular(coefficient_x=0.01, coefficient_y=0.02, coefficient_z=0.01)
    robot = bench.body(
        1.0,
        [[0.02, 0.003, -0.002], [0.003, 0.03, 0.001], [-0.002, 0.001, 0.04]],
        centre=[0.02, -0.01, -0.03],
        hull="box",
        size=[0.2, 0.1, 0.06],
    )
    settings = bench.settings(
        robot,
        {"buoyancy": Buoyancy(), "added": added, "drag": drag, "turn": turn},
        step=step,
        duration=1.024,
        environment={"water_level": 0.0, "water_density": 1000.0},
        position=[0, 0, -20],
        velocity=[1.0, 0.5, -0.3],
        angular_velocity=[3.0, -2.0, 4.0],
        rpy=[0.3, -0.2, 0.5],
    )
    run = bench.run(engine, settings)
    return np.concatenate(
        [run.position[-1], run.rotation[-1].ravel(), run.velocity[-1], run.angular_velocity[-1]]
    )


@pytest.mark.parametrize(("engine", "order", "coarse"), [("world", 2, 0.004), ("twin", 4, 0.032)])
def test_measured_order(bench: Bench, engine: str, order: int, coarse: float) -> None:
    """Halving the step twice shows second order in the world and fourth order in the twin."""
    states = [final(bench, engine, coarse / 2**k) for k in range(3)]
    first, second = (np.linalg.norm(a - b) for a, b in pairwise(states))
    measured = float(np.log2(first / second))
    print(f"{engine}: order {measured:.3f}")
    # error = C h^p (1 + O(h)): the ratio of differences is 2^p to within a fifth of a power
    assert measured == pytest.approx(order, abs=0.2)
