"""Entering the water: the impulse of slamming, and the momentum that added mass takes up."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.slamming import Slamming
from seals.run import build_world

if TYPE_CHECKING:
    from tests.verification.conftest import Bench

RHO, RADIUS = 1000.0, 0.1
EDGES = (0.3, 0.2, 0.1)
WATER = {"water_level": 0.0, "water_density": RHO, "gravity": 0.0}


@pytest.mark.parametrize("speed", [1.0, 3.0])
@pytest.mark.parametrize("shape", ["box", "sphere"])
def test_slamming_impulse_at_constant_speed(bench: Bench, shape: str, speed: float) -> None:
    """The impulse over an entry at constant speed is that of the integrated law."""
    coefficient, step = 0.8, 0.001
    size = EDGES if shape == "box" else [RADIUS]
    # so heavy that the slam of some ten newtons does not slow it
    robot = bench.body(1e6, (1e6,) * 3, hull=shape, size=size)
    top = EDGES[2] / 2 if shape == "box" else RADIUS
    settings = bench.settings(
        robot,
        {"slamming": Slamming(coefficient=coefficient)},
        step=step,
        duration=(2.5 * top) / speed,
        environment=WATER,
        position=[0, 0, top * 1.1],
        velocity=[0, 0, -speed],
    )
    world = build_world(settings)
    bench.record(world, settings)
    force = world.actors["robot"].ledger.of("slamming")[:, 0, 2].copy()
    world.close()
    # J = int rho C A w^2 / 2 4 s (1 - s) dt, dt = dz / w. Box: s = z / h, int = 2 h / 3. Sphere: z
    # = r x, s = x^2 (3 - x) / 4, int_0^2 4 s (1 - s) dx = 4 - (288/5 - 64 + 128/7) / 4 = 36/35
    area, depth = (
        (0.06, EDGES[2] * 2 / 3) if shape == "box" else (np.pi * RADIUS**2, RADIUS * 36 / 35)
    )
    expected = 0.5 * RHO * coefficient * area * speed * depth
    impulse = float(force.sum() * step)
    print(f"{shape} at {speed:g} m/s: {impulse:.6f} N s, closed form {expected:.6f} N s")
    # sum of samples over a bump that vanishes at both ends: h^2 / 12 times the slopes there, which
    # are 4 w / (2 top), against a mean of 2/3 over the time 2 top / w: below (w h / (2 top))^2
    assert impulse == pytest.approx(expected, rel=(speed * step / (2 * top)) ** 2 + 1e-6)
    assert force.max() <= 0.5 * RHO * coefficient * area * speed**2 * (1 + 1e-6)


def test_no_slam_on_the_way_out(bench: Bench) -> None:
    """A body that leaves the water feels no slamming force."""
    robot = bench.body(10.0, (1.0,) * 3, size=[RADIUS])
    settings = bench.settings(
        robot,
        {"slamming": Slamming(coefficient=0.8)},
        duration=0.4,
        environment=WATER,
        position=[0, 0, -0.2],
        velocity=[0, 0, 1.0],
    )
    world = build_world(settings)
    bench.record(world, settings)
    assert np.abs(world.actors["robot"].ledger.of("slamming")).max() == 0.0
    assert world.actors["robot"].body.read().position[2] == pytest.approx(0.2, abs=1e-12)
    world.close()


@pytest.mark.parametrize("ratio", [0.5, 5.0])
@pytest.mark.parametrize("engine", ["world", "twin"])
def test_added_mass_takes_up_momentum(bench: Bench, engine: str, ratio: float) -> None:
    """A body entering without other forces slows from v0 to m v0 / (m + A)."""
    mass, speed, steps = 2.0, 1.0, (0.004, 0.002)
    added = ratio * mass
    errors = []
    for step in steps:
        effects = {"added": AddedMass(mass_x=added, mass_y=added, mass_z=added)}
        settings = bench.settings(
            bench.body(mass, (0.01,) * 3, size=[RADIUS]),
            effects,
            step=step,
            duration=0.4 + 0.1 * ratio,
            environment=WATER,
            position=[0, 0, 0.1107],
            velocity=[0, 0, -speed],
        )
        run = bench.run(engine, settings)
        # d/dt ((m + s A) v) = 0 while s rises from 0 to 1
        expected = -mass * speed / (mass + added)
        errors.append(abs(run.velocity[-1, 2] / expected - 1.0))
        assert run.position[-1, 2] < -RADIUS
    print(f"{engine}, A = {ratio:g} m: error {errors[0]:.1e} at 4 ms, {errors[1]:.1e} at 2 ms")
    # entry takes about 2 r / v0 = 0.2 s, so the rate is 1 / 0.2 s times A / m; the load has kinks
    # at first touch and when wholly wetted, which leave the twin second order as well
    rate = (1.0 + ratio) * speed / (2.0 * RADIUS)
    for error, step in zip(errors, steps, strict=True):
        assert error < (rate * step) ** 2


@pytest.mark.parametrize("engine", ["world", "twin"])
def test_leaving_the_water_gives_no_momentum_back(bench: Bench, engine: str) -> None:
    """A body that leaves the water keeps its speed: the water it carried stays behind."""
    effects = {"added": AddedMass(mass_x=4.0, mass_y=4.0, mass_z=4.0)}
    settings = bench.settings(
        bench.body(2.0, (0.01,) * 3, size=[RADIUS]),
        effects,
        duration=0.6,
        environment=WATER,
        position=[0, 0, -0.3],
        velocity=[0, 0, 1.0],
    )
    run = bench.run(engine, settings)
    # (m + s A) v' = 0 while s falls; rounding of 150 steps
    np.testing.assert_allclose(run.velocity[:, 2], 1.0, rtol=0, atol=150 * 2.0**-52)
