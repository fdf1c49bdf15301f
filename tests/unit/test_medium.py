"""Water, its waves, and which part of a hull it wets."""

from __future__ import annotations

import contextlib
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.effects.identification import Residual
from seals.environment.sampler import WaterColumn
from seals.environment.seawater import density_of, viscosity_of
from seals.environment.settings import EnvironmentSettings
from seals.environment.wetting import WettingTable
from seals.errors import ConfigError
from seals.hydrostatics import (
    HullBox,
    HullCapsule,
    HullCompound,
    HullCylinder,
    HullSphere,
    HullTable,
)
from seals.hydrostatics.alike import HullsAlike
from seals.plugins.waves.airy import WaveAiry
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


WAVE = WaveAiry(amplitude=0.1, period=2.0, direction=0.6, phase=0.3)


def test_the_wave_length_is_that_of_deep_water() -> None:
    """Crests stand g P^2 / (2 pi) apart along the direction of travel."""
    length = 9.81 * 4.0 / (2.0 * math.pi)
    ahead = length * np.array([[math.cos(0.6), math.sin(0.6), 0.0]])
    here, there = (WAVE.at(p, np.zeros((1, 1)), 0.0).elevation for p in (0.0 * ahead, ahead))
    assert float(here[0, 0]) == pytest.approx(float(there[0, 0]), abs=1e-12)


def test_crests_run_in_the_direction_of_the_wave() -> None:
    """Following at the phase speed g P / (2 pi) keeps the elevation."""
    speed = 9.81 * 2.0 / (2.0 * math.pi)
    along = np.array([[math.cos(0.6), math.sin(0.6), 0.0]])
    found = [
        float(WAVE.at(speed * t * along, np.array([[t]]), 0.0).elevation[0, 0])
        for t in (0.0, 0.37, 1.1)
    ]
    assert max(found) - min(found) < 1e-12


def test_water_goes_in_circles_that_shrink_with_depth() -> None:
    """The speed is a w exp(k z) at all times: half at a depth of ln 2 / k."""
    k, omega = WAVE.wavenumber, math.pi
    for depth, share in ((0.0, 1.0), (math.log(2.0) / k, 0.5)):
        times = np.linspace(0.0, 2.0, 9)[:, None]
        place = np.tile([1.0, 2.0, -depth], (9, 1))
        velocity = WAVE.at(place, times, 0.0).velocity
        assert velocity is not None
        np.testing.assert_allclose(
            np.linalg.norm(velocity, axis=1), 0.1 * omega * share, rtol=1e-12
        )


def test_water_under_a_crest_moves_with_the_wave() -> None:
    """Under a crest the water runs forward and accelerates downward."""
    crest = WaveAiry(amplitude=0.1, period=2.0).at(np.zeros((1, 3)), np.zeros((1, 1)), 0.0)
    assert crest.velocity is not None
    assert crest.acceleration is not None
    np.testing.assert_allclose(crest.velocity, [[0.1 * math.pi, 0.0, 0.0]], atol=1e-15)
    np.testing.assert_allclose(crest.acceleration, [[0.0, 0.0, -0.1 * math.pi**2]], atol=1e-15)


def test_too_steep_a_wave_is_refused() -> None:
    """A wave beyond linear theory is refused with its steepness."""
    with pytest.raises(ConfigError, match="steepness"):
        WaveAiry(amplitude=0.5, period=1.0)


def test_a_small_float_rides_the_long_wave() -> None:
    """A light ball on a wave of 62 m length rises and falls with the surface, within 5 %."""
    wave = ["wave=airy", "wave.amplitude=0.3", "wave.period=6.3", "initial.position=[0,0,0.31]"]
    run = run_settings(["robot=ball", "water=fossen", *wave, "time.step=0.01"])
    surface = WaveAiry(amplitude=0.3, period=6.3)
    world, off = build_world(run), []
    for k in range(1300):
        world.step()
        if k > 650:
            place = world.actors["robot"].body.read().position
            level = surface.at(place[None], np.array([[world.time]]), 0.0).elevation[0, 0]
            off.append(place[2] - level)
    world.close()
    # it floats deeper or higher by a constant; what is left is the part that does not follow
    assert np.ptp(off) < 0.05 * 0.6


@pytest.mark.parametrize("depth", [0.0, 4.0])
def test_waves_are_guessed_from_the_force_on_a_hull(depth: float) -> None:
    """At the surface a float is lifted by the crest, below it pushed along the orbits.

    Both with a second of period read off two minutes: a coarse grid of periods would miss it.
    """
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 120.0, 0.06)
    position = 0.1 * rng.standard_normal((len(time), 3)) - [0.0, 0.0, depth]
    side, height, amplitude, period, direction, phase = 0.5, 0.2, 0.05, 3.21, 5.2, 0.7
    omega = 2.0 * math.pi / period
    k = omega**2 / 9.81
    heading = np.array([math.cos(direction), math.sin(direction)])
    theta = k * position[:, :2] @ heading - omega * time + phase
    decay = np.exp(k * np.minimum(position[:, 2], 0.0))
    push = 998.0 * side**2 * height * amplitude * omega**2 * decay
    lift = 0.0 if depth else 998.0 * 9.81 * side**2 * amplitude
    force = np.zeros((len(time), 3))
    force[:, :2] = (push * np.sin(theta))[:, None] * heading
    force[:, 2] = (lift - push) * np.cos(theta)
    force += 0.2 * np.abs(force).max() * rng.standard_normal(force.shape)
    hull = SimpleNamespace(volume=side**2 * height, plan_area=side**2)
    subject: Any = SimpleNamespace(
        hull=hull,
        environment=EnvironmentSettings(water_level=0.0, water_density=998.0, gravity=9.81),
        nominal=lambda name, stem, medium: np.zeros(3),
    )
    residual = Residual(position=position, force=force, time=time, subject=subject)
    found = WaveAiry.guesses(residual)[0]
    assert found["period"] == pytest.approx(period, rel=0.01)
    assert abs(math.remainder(found["direction"] - direction, 2.0 * math.pi)) < math.pi / 8.0
    assert found["amplitude"] == pytest.approx(amplitude, rel=0.2)


HULLS = (HullBox(size=(0.4, 0.2, 0.1)), HullSphere(radius=0.15))
BATCH = 200


def _surfaces() -> tuple[Any, Any]:
    rng = np.random.default_rng(4)
    up = rng.normal(size=(2 * BATCH, 3))
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    return up, rng.uniform(-0.6, 0.6, (2 * BATCH, 1))


def _looked_up(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    rows: list[int] = []
    plain = HullTable.lookup

    def lookup(self: Any, up: Any, level: Any) -> Any:
        rows.append(len(level))
        return plain(self, up, level)

    monkeypatch.setattr(HullTable, "lookup", lookup)
    return rows


def test_only_cut_hulls_are_looked_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """All rows get what their table gives, those out of reach of the surface without asking it."""
    tables = [HullTable.build(hull) for hull in HULLS]
    up, level = _surfaces()
    cuts = slice(0, BATCH), slice(BATCH, None)
    wanted = [t.lookup(up[c], level[c]) for t, c in zip(tables, cuts, strict=True)]
    wetting = WettingTable(tables, reach=[hull.reach for hull in HULLS])
    wetting.wet(up, level)
    rows = _looked_up(monkeypatch)
    found = wetting.wet(up, level)
    reach = np.repeat([[hull.reach] for hull in HULLS], BATCH, axis=0)
    assert rows == [int((np.abs(level) < reach)[c].sum()) for c in cuts]
    assert sum(rows) < BATCH
    for column, parts in zip(found, zip(*wanted, strict=True), strict=True):
        np.testing.assert_allclose(column, np.concatenate(parts), rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_away_from_the_surface_there_is_no_waterplane(
    side: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A batch far above or far below asks no table and has no area."""
    wetting = WettingTable(
        [HullTable.build(hull) for hull in HULLS], reach=[hull.reach for hull in HULLS]
    )
    up, level = _surfaces()
    far = side * (1.0 + np.abs(level))
    wetting.wet(up, far)
    rows = _looked_up(monkeypatch)
    found = wetting.wet(up, far)
    assert rows == []
    assert found.area is None
    volumes = np.repeat([[hull.volume] for hull in HULLS], BATCH, axis=0)
    np.testing.assert_allclose(found.volume, volumes * (side > 0.0), rtol=1e-12)


def test_another_library_gets_the_same() -> None:
    """An array library that cannot leave rows out looks all of them up."""
    torch = pytest.importorskip("torch", reason="torch is not installed")
    tables = [HullTable.build(hull) for hull in HULLS]
    wetting = WettingTable(tables, reach=[hull.reach for hull in HULLS])
    up, level = _surfaces()
    here = wetting.wet(up, level)
    there = wetting.wet(torch.as_tensor(up), torch.as_tensor(level))
    for one, other in zip(here, there, strict=True):
        np.testing.assert_allclose(one, other.numpy(), rtol=0.0, atol=1e-12)


def test_hulls_of_like_forms_are_evaluated_together_as_one_by_one() -> None:
    """Primitives of every form, turned, moved, and in compounds, agree with their own tables."""
    torch = pytest.importorskip("torch", reason="torch is not installed")
    place = {"position": (0.03, -0.02, 0.05), "rpy": (0.3, -0.5, 0.8)}
    parts = [
        HullCylinder(radius=0.05, length=0.3, **place),
        HullCylinder(radius=0.02, length=0.1),
        HullCapsule(radius=0.04, length=0.2, **place),
        HullSphere(radius=0.1, position=(0.0, 0.1, 0.0)),
        HullBox(size=(0.2, 0.3, 0.1), **place),
    ]
    whole = HullCompound(parts=parts, displaced_volume=0.02, centre_of_buoyancy=(0.01, 0.02, 0.0))
    hulls = [*parts, whole, HullCompound(parts=parts[:2])]
    tables = [HullTable.build(hull) for hull in hulls]
    rng = np.random.default_rng(2)
    up = rng.normal(size=(len(hulls) * BATCH, 3))
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    level = rng.uniform(-0.3, 0.3, (len(up), 1))
    found = WettingTable(tables).wet(torch.as_tensor(up), torch.as_tensor(level))
    rows = [slice(k * BATCH, (k + 1) * BATCH) for k in range(len(hulls))]
    wanted = [t.lookup(up[r], level[r]) for t, r in zip(tables, rows, strict=True)]
    for one, own in zip(found, zip(*wanted, strict=True), strict=True):
        np.testing.assert_allclose(one.numpy(), np.concatenate(own), rtol=0.0, atol=1e-13)


def test_a_compound_that_is_moved_keeps_its_own_table() -> None:
    """A stated centre of buoyancy that moves the parts has its own law; a mesh has one as well."""
    parts = [HullSphere(radius=0.1)]
    stated = {"parts": parts, "centre_of_buoyancy": (0.0, 0.0, 0.1)}
    assert HullsAlike.fits(HullCompound(**stated))
    assert not HullsAlike.fits(HullCompound(**stated, shift_geometry=True))
