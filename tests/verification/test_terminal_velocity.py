"""Falling against drag: terminal velocity, and the way towards it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from seals.effects import MediumKind
from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.linear_drag import DragLinear
from seals.plugins.effects.quadratic_drag import DragQuadratic

if TYPE_CHECKING:
    from tests.verification.conftest import Bench, Trajectory

G = 9.81
CASES = [("world", 0.001), ("world", 0.004), ("twin", 0.004), ("twin", 0.016)]


def allowed(engine: str, rate: float, step: float, speed: float) -> float:
    """Error bound of a velocity that relaxes at ``rate`` towards ``speed``.

    World: v(n) = v(n-1/2) + a(n-1) h/2 misses 3/8 h^2 v'', the drag made from it 3/8 h^2 v'' more,
    the midpoint rule h^2 v''/24; v'' <= rate^2 speed: the sum is below (rate h)^2 speed. Twin: the
    classic Runge-Kutta error (rate h)^4 rate t exp(-rate t) / 120, below (rate h)^4. Then rounding.
    """
    order = 2 if engine == "world" else 4
    return (rate * step) ** order * speed + 1e-12


def fallen(run: Trajectory) -> float:
    """Distance fallen over the run [m]."""
    return float(run.position[0, 2] - run.position[-1, 2])


@pytest.mark.parametrize(("engine", "step"), CASES)
def test_linear_drag_in_air(bench: Bench, engine: str, step: float) -> None:
    """Speed approaches m g / c exponentially."""
    mass, c = 0.5, 1.25
    drag = DragLinear(coefficient_x=c, coefficient_y=c, coefficient_z=c, medium=MediumKind.air)
    run = bench.run(
        engine,
        bench.settings(bench.body(mass, (1e-3,) * 3), {"drag": drag}, step=step, duration=4.0),
    )
    # m v' = -m g - c v  ->  v = -(m g / c) (1 - exp(-c t / m))
    rate, terminal = c / mass, mass * G / c
    expected = -terminal * (1.0 - np.exp(-rate * run.time))
    bound = allowed(engine, rate, step, terminal)
    assert np.abs(run.velocity[:, 2] - expected).max() < bound
    # z = -vt (t - (1 - exp(-rate t)) / rate); a velocity within the bound drifts by at most bound
    # times t
    way = terminal * (4.0 - (1.0 - np.exp(-rate * 4.0)) / rate)
    assert abs(fallen(run) - way) < 4.0 * bound


@pytest.mark.parametrize(("engine", "step"), CASES)
def test_quadratic_drag_in_air(bench: Bench, engine: str, step: float) -> None:
    """Speed approaches sqrt(m g / k) as a hyperbolic tangent."""
    mass, k = 0.4, 0.05
    drag = DragQuadratic(coefficient_x=k, coefficient_y=k, coefficient_z=k, medium=MediumKind.air)
    run = bench.run(
        engine,
        bench.settings(bench.body(mass, (1e-3,) * 3), {"drag": drag}, step=step, duration=4.0),
    )
    # m v' = -m g + k v^2  ->  v = -vt tanh(g t / vt), vt = sqrt(m g / k), z = -vt^2 / g ln cosh(g t
    # / vt)
    terminal = np.sqrt(mass * G / k)
    bound = allowed(engine, 2.0 * G / terminal, step, terminal)
    assert np.abs(run.velocity[:, 2] + terminal * np.tanh(G * run.time / terminal)).max() < bound
    assert abs(fallen(run) - terminal**2 / G * np.log(np.cosh(G * 4.0 / terminal))) < 4.0 * bound
    assert run.velocity[-1, 2] == pytest.approx(-terminal, rel=0.01)


@pytest.mark.parametrize(("engine", "step"), CASES)
def test_sinking_with_buoyancy_and_added_mass(bench: Bench, engine: str, step: float) -> None:
    """A sinking ball approaches its net weight over c at the rate c / (m + A)."""
    mass, c, added, radius, rho = 0.8, 1.5, 0.26, 0.05, 1000.0
    effects = {
        "buoyancy": Buoyancy(),
        "drag": DragLinear(
            coefficient_x=c, coefficient_y=c, coefficient_z=c, medium=MediumKind.water
        ),
        "added": AddedMass(mass_x=added, mass_y=added, mass_z=added),
    }
    settings = bench.settings(
        bench.body(mass, (1e-3,) * 3, size=[radius]),
        effects,
        step=step,
        duration=4.0,
        position=[0, 0, -5],
        environment={"water_level": 0.0, "water_density": rho},
    )
    run = bench.run(engine, settings)
    # (m + A) v' = -(m - rho V) g - c v
    net = (mass - rho * 4.0 / 3.0 * np.pi * radius**3) * G
    rate, terminal = c / (mass + added), net / c
    expected = -terminal * (1.0 - np.exp(-rate * run.time))
    assert np.abs(run.velocity[:, 2] - expected).max() < allowed(engine, rate, step, terminal)
