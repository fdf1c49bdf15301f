"""Weight of a body's boundary volumes in the density: the water that it keeps away lifts it."""

from __future__ import annotations

import numpy as np
import pytest

from seals import registry
from seals.environment.settings import EnvironmentSettings
from seals.errors import ConfigError
from seals.fluid import BodyStates, FluidBody, Surrounding
from seals.plugins.fluids.coupling.bodies import solid_scales
from seals.plugins.fluids.tank import FluidParticles
from seals.robot.pieces import Piece

EDGE, SPACING, STEP, STEPS = 0.12, 0.03, 0.004, 60
PLACES = np.array([[-0.18, 0.0, 0.12], [0.18, 0.0, 0.12]])
WATER = EnvironmentSettings(water_level=0.3, tank_bottom=-0.06, water_density=1000.0)


def held(count: int) -> BodyStates:
    """Return cubes that are held."""
    still = np.zeros((count, 3))
    return BodyStates(
        position=PLACES[:count],
        rotation=np.repeat(np.eye(3)[None], count, axis=0),
        velocity=still,
        spin=still,
        inverse_mass=np.zeros(count),
        inverse_inertia=np.zeros((count, 3, 3)),
        acceleration=still,
    )


def opened(scale: dict[str, float]) -> FluidParticles:
    """Return a tank with two cubes under water."""
    fluid = FluidParticles(spacing=SPACING, size=[0.78, 0.42, 0.36], solid_scale=scale)
    cube = Piece("box", (EDGE, EDGE, EDGE), np.zeros(3), np.eye(3))
    around = Surrounding(WATER, registry.get("wave", "still").load()(), (), STEP)
    fluid.open(around, [FluidBody("light/cube", (cube,)), FluidBody("heavy/cube", (cube,))])
    return fluid


def over(places: np.ndarray, middle: np.ndarray) -> float:
    """Return how far the nine particles next to a cube's upper face are from it [m]."""
    x = places - middle
    column = (np.abs(x[:, :2]) < 0.05).all(axis=1) & (x[:, 2] > 0.0)
    return float(np.sort(x[column, 2])[:9].mean() - 0.5 * EDGE)


@pytest.mark.slow
def test_a_body_of_more_weight_keeps_more_water_away_and_is_lifted_by_as_much() -> None:
    """Lift as the cube of the edge, grown by the layer that it keeps away, within 8 %."""
    fluid = opened({"light": 0.5, "heavy/cube": 2.0})
    fluid.initialise(held(2))
    lifts = []
    for k in range(STEPS):
        lifts.append(fluid.exchange(held(2), k * STEP, STEP)[:, 2])
        balance = fluid.momentum_balance()
        assert balance is not None
        assert np.abs(balance.gap).max() < 1e-6 * balance.gross
    light, heavy = np.mean(lifts[-30:], axis=0)
    places, _ = fluid.particles()
    fluid.close()
    edges = [EDGE + 2.0 * over(places, middle) - SPACING for middle in PLACES]
    assert heavy > 1.2 * light
    assert heavy / light == pytest.approx((edges[1] / edges[0]) ** 3, rel=0.08)


def test_names_of_no_body_are_refused() -> None:
    """The nearest body is named, before anything is allocated."""
    with pytest.raises(ConfigError, match="Did you mean 'crab/claw'"):
        solid_scales(["crab/body", "crab/claw"], {"crab/clw": 2.0})
