"""Density and viscosity of water, alone and against depth; submersion at the surface."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest

from seals.environment.sampler import WaterColumn
from seals.environment.seawater import density_of, viscosity_of
from seals.run import build_world
from seals.run.build import run_settings

# UNESCO Technical Papers in Marine Science 44 (1983), check values of EOS-80 at p = 0:
# each row salinity, then temperature (IPTS-68), then density
EOS80 = [
    (0.0, 5.0, 999.96675),
    (0.0, 25.0, 997.04796),
    (35.0, 5.0, 1027.67547),
    (35.0, 25.0, 1023.34306),
]


@pytest.mark.parametrize(("salinity", "temperature", "density"), EOS80)
def test_density_meets_the_published_check_values(
    salinity: float, temperature: float, density: float
) -> None:
    """The one-atmosphere equation of state gives all digits of the published values."""
    found = density_of(np.array(temperature), np.array(salinity))
    assert float(found) == pytest.approx(density, abs=6e-6)


def test_viscosity_of_fresh_water() -> None:
    """1.0016 mPa s at 20 degC (IAPWS 2008), 1.3059 at 10 degC, each within 0.3 %."""
    found = viscosity_of(np.array([20.0, 10.0]), np.zeros(2))
    np.testing.assert_allclose(found, [1.0016e-3, 1.3059e-3], rtol=3e-3)


def test_a_column_joins_both_profiles() -> None:
    """Nodes of temperature and salinity are merged; values between them are interpolated."""
    column = WaterColumn.of_profiles([[0, 25], [10, 5]], [[0, 0], [10, 0], [20, 35]], None)
    np.testing.assert_array_equal(column.depth, [0.0, 10.0, 20.0])
    np.testing.assert_allclose(column.density, [997.04796, 999.96675, 1027.67547], atol=6e-6)


def test_a_stated_density_rules() -> None:
    """A density given by the user holds at every depth."""
    column = WaterColumn.of_profiles([[0, 25], [10, 5]], [[0, 35]], 1010.0)
    assert set(column.density) == {1010.0}


@pytest.mark.parametrize(
    ("depth", "density"),
    [(2.0, 999.96675), (15.0, 0.5 * (999.96675 + 1027.67547)), (40.0, 1027.67547)],
)
def test_lift_follows_the_density_at_depth(depth: float, density: float) -> None:
    """The lift of a submerged ball is rho(depth) g V: above, inside and below a salinity step."""
    water = ["environment.water_temperature=[[0,5]]", "environment.salinity=[[0,0],[10,0],[20,35]]"]
    run = run_settings(["robot=ball", "water=fossen", f"initial.position=[0,0,{-depth}]", *water])
    with contextlib.closing(build_world(run)) as world:
        world.step()
        lift = world.actors["robot"].ledger.of("buoyancy")[0, 0, 2]
    volume = 4.0 / 3.0 * np.pi * 0.05**3
    assert lift == pytest.approx(density * 9.81 * volume, rel=1e-7)


def test_no_water_is_no_lift() -> None:
    """Without a water level buoyancy is zero wherever the robot is."""
    run = run_settings(
        [
            "robot=ball",
            "water=fossen",
            "environment.water_level=null",
            "initial.position=[0,0,-3]",
        ]
    )
    with contextlib.closing(build_world(run)) as world:
        world.step()
        assert not world.actors["robot"].ledger.of("buoyancy").any()


def test_the_water_level_may_be_anywhere() -> None:
    """A ball whose centre is at the level displaces half its volume, at any height of the level."""
    for level in (0.0, 2.5):
        place = [f"environment.water_level={level}", f"initial.position=[0,0,{level}]"]
        run = run_settings(["robot=ball", "water=fossen", *place])
        with contextlib.closing(build_world(run)) as world:
            world.step()
            lift = world.actors["robot"].ledger.of("buoyancy")[0, 0, 2]
        half = 2.0 / 3.0 * np.pi * 0.05**3
        assert lift == pytest.approx(998.206 * 9.81 * half, rel=1e-6)
