"""Moving water: drifting with the current, and the same physics in still and in moving water."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.effects import MediumKind
from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.angular_drag import DragAngular
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.current import Current
from seals.plugins.effects.linear_drag import DragLinear
from seals.plugins.effects.quadratic_drag import DragQuadratic
from seals.run import build_world

if TYPE_CHECKING:
    from tests.verification.conftest import Bench

Floats = NDArray[np.float64]
RHO, EDGE = 1000.0, 0.1
MASS = RHO * EDGE**3
WATER = {"water_level": 0.0, "water_density": RHO}
FLOW = np.array([0.8, -0.5, 0.0])
CASES = [("world", 0.004), ("twin", 0.016)]


def coupled() -> AddedMass:
    """Return an added mass without any symmetry."""
    table = np.zeros((6, 6))
    for i, j, value in ((0, 1, 0.1), (0, 4, 0.02), (1, 3, -0.03), (2, 3, 0.01), (3, 5, 0.0005)):
        table[i, j] = table[j, i] = value
    return AddedMass(
        mass_x=0.4,
        mass_y=0.7,
        mass_z=1.1,
        inertia_x=0.003,
        inertia_y=0.004,
        inertia_z=0.002,
        coupling=table.tolist(),
    )


def flow(velocity: Floats) -> Current:
    """Return a current with a velocity in the world."""
    x, y, z = velocity.tolist()
    return Current(velocity_x=x, velocity_y=y, velocity_z=z)


@pytest.mark.thorough
@pytest.mark.parametrize(("engine", "step"), CASES)
def test_a_body_at_rest_is_taken_along(bench: Bench, engine: str, step: float) -> None:
    """A neutrally buoyant body approaches the current at the rate c / (m + A)."""
    c, added = 3.0, 0.5
    effects = {
        "buoyancy": Buoyancy(),
        "current": flow(FLOW),
        "added": AddedMass(mass_x=added, mass_y=added, mass_z=added),
        "drag": DragLinear(
            coefficient_x=c, coefficient_y=c, coefficient_z=c, medium=MediumKind.water
        ),
    }
    settings = bench.settings(
        bench.body(MASS, (0.002,) * 3, hull="box", size=[EDGE] * 3),
        effects,
        step=step,
        duration=8.0,
        environment=WATER,
        position=[0, 0, -3],
    )
    run = bench.run(engine, settings)
    # (m + A) v' = -c (v - u)  ->  v = u (1 - exp(-c t / (m + A))); a steady current has no
    # acceleration of its own
    rate = c / (MASS + added)
    expected = FLOW * (1.0 - np.exp(-rate * run.time))[:, None]
    # second and fourth order, see the terminal velocity
    bound = (rate * step) ** (2 if engine == "world" else 4) * np.linalg.norm(FLOW) + 1e-12
    assert np.linalg.norm(run.velocity - expected, axis=1).max() < bound
    np.testing.assert_allclose(run.velocity[-1], FLOW, rtol=0, atol=bound + np.exp(-8.0 * rate))


def drifting(bench: Bench, step: float) -> Any:
    """Return the settings of a body that moves and turns with the current, without drag torque."""
    effects = {
        "buoyancy": Buoyancy(),
        "current": flow(FLOW),
        "added": AddedMass(
            mass_x=0.4, mass_y=0.7, mass_z=1.1, inertia_x=0.003, inertia_y=0.003, inertia_z=0.003
        ),
        "drag": DragLinear(
            coefficient_x=3.0, coefficient_y=4.0, coefficient_z=5.0, medium=MediumKind.water
        ),
        "form": DragQuadratic(coefficient_x=3.0, coefficient_y=4.0, coefficient_z=5.0),
    }
    return bench.settings(
        bench.body(MASS, (0.002,) * 3, hull="box", size=[EDGE] * 3),
        effects,
        step=step,
        duration=2.0,
        environment=WATER,
        position=[0, 0, -3],
        velocity=FLOW,
        angular_velocity=[0.5, -1.0, 2.0],
        rpy=[0.2, 0.3, -0.4],
    )


@pytest.mark.parametrize(("engine", "step"), CASES)
def test_a_body_moving_with_the_current_stays_with_it(
    bench: Bench, engine: str, step: float
) -> None:
    """A turning body carried by the current keeps its velocity and its spin."""
    settings = drifting(bench, step)
    run = bench.run(engine, settings)
    # nothing acts: isotropic moments turn steadily, the centre moves with the flow. The world keeps
    # velocities in world axes and only rounds; the twin keeps them in turning axes and errs by
    # (spin x step)^4
    bound = 1e-12 if engine == "world" else (2.3 * step) ** 4 * float(np.linalg.norm(FLOW))
    drift = np.linalg.norm(run.velocity - FLOW, axis=1).max()
    print(f"{engine}: velocity off the current by {drift:.1e} m/s, bound {bound:.1e}")
    assert drift < bound
    assert np.linalg.norm(run.angular_velocity - run.angular_velocity[0], axis=1).max() < bound


def test_the_ledger_of_a_drifting_body_shows_no_drag(bench: Bench) -> None:
    """In the world, a body moving with the current feels no drag, and its weight is balanced."""
    settings = drifting(bench, 0.004)
    world = build_world(settings)
    bench.record(world, settings)
    ledger = world.actors["robot"].ledger
    world.close()
    # drag is a slope of 5 N s/m times the velocity off the current, which is rounding
    assert np.abs(ledger.of("drag")).max() < 5e-12
    assert np.abs(ledger.of("form")).max() < 5e-12
    balance = ledger.of("buoyancy") + ledger.of("gravity")
    # rounding of the weight of 9.81 N
    assert np.abs(balance).max() < 1e-12


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("engine", "step", "bound"), [("twin", 0.002, 1e-9), ("world", 0.004, 1e-11)]
)
def test_galilean_invariance(bench: Bench, engine: str, step: float, bound: float) -> None:
    """Still water seen from a moving frame, and water moving past: one and the same motion."""
    runs = []
    for velocity in (np.zeros(3), FLOW):
        effects = {
            "buoyancy": Buoyancy(),
            "current": flow(velocity),
            "added": coupled(),
            "drag": DragLinear(
                coefficient_x=1.0, coefficient_y=2.0, coefficient_z=3.0, medium=MediumKind.water
            ),
            "form": DragQuadratic(coefficient_x=3.0, coefficient_y=4.0, coefficient_z=5.0),
            "turn": DragAngular(coefficient_x=0.004, coefficient_y=0.003, coefficient_z=0.005),
        }
        robot = bench.body(
            1.2 * MASS,
            [[0.002, 2e-4, 0], [2e-4, 0.003, 1e-4], [0, 1e-4, 0.0025]],
            centre=[0.005, -0.01, -0.01],
            hull="box",
            size=[EDGE] * 3,
        )
        settings = bench.settings(
            robot,
            effects,
            step=step,
            duration=1.0,
            environment=WATER,
            position=[0, 0, -10],
            velocity=np.array([0.5, 0.4, -0.2]) + velocity,
            angular_velocity=[2.0, -1.0, 1.5],
            rpy=[0.2, 0.3, -0.4],
        )
        runs.append(bench.run(engine, settings))
    still, moving = runs
    carried = moving.position - FLOW * moving.time[:, None]
    apart = np.linalg.norm(carried - still.position, axis=1).max()
    turned = np.abs(moving.rotation - still.rotation).max()
    print(f"{engine}: apart by {apart:.1e} m, {turned:.1e} in attitude")
    # twin: both are within the fourth-order error of the same motion, (10 x 0.002)^4 / 120 = 1e-9;
    # world: velocities in world axes differ by a constant, so only rounding differs
    assert apart < bound
    assert turned < bound
