"""The parts of the window that goes with a robot through an open sea: no engine runs here."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seals.environment.ground import Solid
from seals.environment.settings import EnvironmentSettings
from seals.errors import ConfigError, PhysicsError
from seals.experiments.open_sea.measures import measures
from seals.experiments.open_sea.tow import Tow, towed
from seals.plugins.fluids.moving_domain import FluidWindow
from seals.plugins.fluids.moving_domain.box import Box
from seals.plugins.fluids.moving_domain.fluid import LevelController
from seals.plugins.fluids.moving_domain.outer_sea import OuterSea
from seals.plugins.fluids.moving_domain.refusals import (
    refuse_astray,
    refuse_ground,
    refuse_large_robot,
    refuse_sea,
)
from seals.plugins.fluids.sampling import Samples
from seals.plugins.waves.airy import WaveAiry
from seals.plugins.waves.sea import Spectrum, WaveSea
from seals.plugins.waves.still import WaveStill
from seals.run.build import run_settings

D = 0.1


def box(**fields: Any) -> Box:
    """Return a box of 2 x 1.6 x 0.8 m around the origin."""
    corner = np.array([-1.0, -0.8, -0.8])
    return Box(D, corner, (20, 16, 8), ring=5, cell=2, freeboard=0.3)._replace(**fields)


def test_the_ring_weighs_one_at_the_sides_and_nothing_inside() -> None:
    """The weight rises outward as that of Jacobsen et al. 2012."""
    rest = np.array([[0.0, 0.0, -0.1], [-0.5, 0.0, 0.0], [-0.75, 0.0, 0.0], [-1.0, 0.3, -0.7]])
    expected = [0.0, 0.0, (math.exp(0.5**3.5) - 1.0) / (math.e - 1.0), 1.0]
    assert box().weight(rest) == pytest.approx(expected, abs=1e-12)


def test_the_window_moves_by_whole_cells() -> None:
    """It moves once the robot is a cell away, to where the robot is in the middle cell again."""
    assert box().cells_to(np.array([0.19, -0.19, 0.0])) == (0, 0)
    assert box().cells_to(np.array([0.21, -0.45, 0.0])) == (1, -2)
    moved = box().moved((1, -2))
    assert moved.middle[:2] == pytest.approx([0.2, -0.4])
    assert moved.cells_to(np.array([0.21, -0.45, 0.0])) == (0, 0)


def test_water_taken_in_continues_the_lattice() -> None:
    """What is new after a shift and what stays make up the new box, without gap or overlap."""
    old, new = box(), box().moved((1, 0))
    stay = old.lattice()[new.holds(old.lattice())]
    come = new.lattice()[~old.holds(new.lattice())]
    assert len(come) == 2 * 16 * 8
    together = np.sort(np.concatenate([stay, come]), axis=0)
    assert together == pytest.approx(np.sort(new.lattice(), axis=0))


SEAS = [
    WaveAiry(amplitude=0.1, period=2.0, direction=0.5),
    WaveSea(height=0.2, period=2.0, depth=1.5),
    WaveSea(height=0.2, period=2.5, spectrum=Spectrum.jonswap, components=12),
]


@pytest.mark.parametrize("wave", SEAS, ids=["airy", "finite depth", "jonswap"])
def test_displacement_is_the_integral_of_the_velocity(wave: Any) -> None:
    """The rate of the displacement at a place of rest is the velocity there."""
    outer, eps = OuterSea(wave, 0.3, (0.4, -0.2)), 1e-5
    rest = np.random.default_rng(1).uniform(-3.0, 0.3, (40, 3))
    rate = (outer.places(rest, 1.7 + eps) - outer.places(rest, 1.7 - eps)) / (2.0 * eps)
    assert rate == pytest.approx(outer.velocity(rest, 1.7), abs=1e-7)


@pytest.mark.parametrize("wave", SEAS, ids=["airy", "finite depth", "jonswap"])
def test_places_of_rest_are_found_again(wave: Any) -> None:
    """A place of rest, carried by waves and current, is found from where it is."""
    outer = OuterSea(wave, 0.3, (0.4, -0.2))
    rest = np.random.default_rng(2).uniform(-3.0, 0.3, (40, 3))
    found = outer.rest(outer.places(rest, 5.0), 5.0)
    assert found == pytest.approx(rest, abs=2e-3)


def test_the_carried_surface_is_that_of_the_wave() -> None:
    """Water of the surface at rest makes a wave of Stokes: its crest is second order higher."""
    outer = OuterSea(WaveAiry(amplitude=0.1, period=2.0), 0.0, (0.0, 0.0))
    rest = np.zeros((200, 3))
    rest[:, 0] = np.linspace(0.0, 6.0, 200)
    places = outer.places(rest, 0.8)
    linear = outer.elevation(places, 0.8)
    stokes = linear + 0.5 * 1.006 * 0.1**2 * (2.0 * (linear / 0.1) ** 2 - 1.0)
    assert places[:, 2] == pytest.approx(stokes, abs=1.1 * 0.1 * 0.1006**2)


def test_carried_water_keeps_its_volume_to_third_order() -> None:
    """The displacement of a regular wave squeezes by less than the cube of its steepness."""
    outer, eps = OuterSea(WaveSea(height=0.2, period=2.0), 0.0, (0.0, 0.0)), 1e-5
    rest = np.random.default_rng(3).uniform(-2.0, -0.01, (60, 3))
    columns = [
        (outer.places(rest + s, 1.0) - outer.places(rest - s, 1.0)) / (2.0 * eps)
        for s in eps * np.eye(3)
    ]
    volume = np.linalg.det(np.stack(columns, axis=2))
    assert np.abs(volume - 1.0).max() < 2.0 * 0.1006**3


def test_a_current_carries_waves_along() -> None:
    """In axes that go with the current the sea is the same."""
    still, moving = (OuterSea(SEAS[0], 0.0, (u, 0.0)) for u in (0.0, 0.7))
    east = np.linspace(0.0, 5.0, 30)[:, None] * [1.0, 0.0, 0.0]
    later = moving.elevation(east + np.array([0.7 * 3.0, 0.0, 0.0]), 3.0)
    assert later == pytest.approx(still.elevation(east, 3.0))


def test_an_irregular_sea_repeats_with_its_seed() -> None:
    """The same seed gives the same sea, another seed another one; the height is right."""
    at, time = np.random.default_rng(4).uniform(-500.0, 500.0, (20000, 3)), np.zeros((1, 1))
    seas = [WaveSea(height=0.4, period=3.0, spectrum=Spectrum.jonswap, seed=s) for s in (1, 1, 2)]
    a, b, c = (s.at(at, time, 0.0).elevation for s in seas)
    assert (a == b).all()
    assert not np.allclose(a, c)
    assert 4.0 * a.std() == pytest.approx(0.4, rel=0.05)


def test_the_keeper_takes_what_is_too_much_from_the_top_of_the_ring() -> None:
    """A window with too much water loses its highest particles of the ring, and no others."""
    keeper, rest = LevelController(0.1), box().lattice()
    more = np.concatenate([rest, rest[rest[:, 2] > -D] + [0.0, 0.0, D]])
    ring = more[box().weight(more) > 0.0]
    change = keeper.change(box(), ring, len(more) - len(rest), 0.1)
    assert len(change.gone)
    assert not len(change.come)
    assert (ring[change.gone, 2] > 0.0).all()


def test_the_keeper_fills_what_a_body_left() -> None:
    """Missing water comes on top of the ring; what a body takes is not missing."""
    rest = box().lattice()
    fewer = rest[np.linalg.norm(rest + np.array([0.0, 0.0, 0.4]), axis=1) > 0.3]
    ring = fewer[box().weight(fewer) > 0.0]
    assert not len(LevelController(0.1).change(box(), ring, 0.0, 0.1).come)
    come = LevelController(0.1).change(box(), ring, len(fewer) - len(rest), 0.1).come
    assert len(come)
    assert (box().weight(come) > 0.0).all()
    assert (come[:, 2] > 0.0).all()


def test_a_thin_ring_and_small_sides_are_refused() -> None:
    """The ring must be wider than a particle sees, and leave water inside."""
    with pytest.raises(ConfigError, match="too thin: the range of a particle is two spacings"):
        FluidWindow(ring=2).box(EnvironmentSettings(water_level=0.0))
    with pytest.raises(ConfigError, match=r"width of 0.5 m is too small .*\n.* 0.7 m or more"):
        FluidWindow(size=[2.0, 0.5, 0.8]).box(EnvironmentSettings(water_level=0.0))


def test_the_window_ends_at_the_floor() -> None:
    """It is as deep as asked, or down to the floor; the spacing divides the depth."""
    deep = FluidWindow(size=[2.0, 1.6, 0.8]).box(EnvironmentSettings(water_level=0.0))
    assert deep.counts == (40, 32, 16)
    shallow = FluidWindow().box(EnvironmentSettings(water_level=0.2, tank_bottom=-0.31))
    assert shallow.spacing == pytest.approx(0.051)
    assert shallow.lower[2] == pytest.approx(-0.31)


def test_a_window_without_a_size_follows_the_size_of_its_robot() -> None:
    """Inside of the ring, a cell to spare: twice a ball, 1.2 times a sparse robot, or the depth."""
    still, one = EnvironmentSettings(water_level=0.0), FluidWindow(spacing=0.05)
    ball = 4.0 / 3.0 * math.pi * 0.4**3
    assert one.box(still, 0.4, ball).counts == (44, 44, 12)
    assert one.box(still, 0.5, 0.001).counts == (36, 36, 12)
    assert one.box(still, 0.1).counts == (24, 24, 12)
    side = FluidWindow(spacing=0.05, size=[0.0, 1.5, 0.4])
    assert side.box(still, 0.2, 0.125 * ball).counts == (28, 30, 8)


def test_waves_that_particles_cannot_follow_are_refused() -> None:
    """Waves of few spacings, and waves that would go through the floor."""
    short = OuterSea(WaveSea(height=0.01, period=0.5), 0.0, (0.0, 0.0))
    with pytest.raises(ConfigError, match=r"shortest wave of 0.39 m is 3.9 spacings long"):
        refuse_sea(short, box(), floor=None)
    long = WaveSea(height=0.1, period=3.0)
    with pytest.raises(ConfigError, match=r"is fixed.*\n.*wave=sea wave.depth=0.8"):
        refuse_sea(OuterSea(long, 0.0, (0.0, 0.0)), box(), floor=-0.8)
    fit = WaveSea(height=0.1, period=3.0, depth=0.8)
    refuse_sea(OuterSea(fit, 0.0, (0.0, 0.0)), box(), floor=-0.8)


def test_what_does_not_fit_into_the_window_is_refused() -> None:
    """A large robot, an object that is left behind, an obstacle."""
    far = Samples(np.array([[0.6, 0.0, 0.0], [-0.6, 0.0, 0.0]]), np.full(2, D**3))
    with pytest.raises(PhysicsError, match=r"smaller than its robot of 1.3 m"):
        refuse_large_robot(far, box())
    rest = np.array([[0.0, 0.0, 0.0], [1.2, 0.0, 0.0]])
    with pytest.raises(PhysicsError, match=r"'cube/base' is outside the window"):
        refuse_astray(["robot/base", "cube/base"], rest, box())
    rock = Solid("rock", "box", (1.0, 1.0, 1.0), np.zeros(3), np.array([0, 0, 0, 1.0]), 0.5, 0.0)
    with pytest.raises(ConfigError, match="'rock' is in the water"):
        refuse_ground(EnvironmentSettings(water_level=0.0), [rock])


def test_a_wave_without_orbits_is_refused() -> None:
    """The window must know how far waves carry the water; still water needs no orbits."""

    class Bare:
        def at(self, position: Any, time: Any, level: float) -> Any:
            return SEAS[0].at(position, time, level)

    with pytest.raises(ConfigError, match="needs the displacement of the water"):
        OuterSea(Bare(), 0.0, (0.0, 0.0))
    assert math.isinf(OuterSea(WaveStill(), 0.0, (0.0, 0.0)).shortest)


def test_a_steep_sea_is_refused() -> None:
    """Linear theory ends at a steepness of 0.3."""
    with pytest.raises(ConfigError, match=r"has the steepness 0.50"):
        WaveSea(height=1.0, period=2.0)


def test_a_tow_needs_a_window_and_some_way() -> None:
    """The experiment refuses a basin, still water and a way that is too short."""
    basin = run_settings(["robot=ball", "water=particles"])
    with pytest.raises(ConfigError, match="water=window wave=sea"):
        towed(basin, way=60.0, speed=1.5, radius=0.1)
    window = run_settings(["robot=ball", "water=window", "wave=sea"])
    with pytest.raises(ConfigError, match=r"a way of 1 m is too short .*\n.* 6 m or more"):
        towed(window, way=1.0, speed=1.5, radius=0.1)


def test_jumps_and_wave_force_of_a_known_tow() -> None:
    """Figures of a tow whose force, surface and cost are known."""
    rows, step = 4000, 0.01
    time = step * np.arange(1, rows + 1)
    shifted = np.arange(rows) % 40 == 39
    force = np.zeros((rows, 3))
    force[:, 2] = 100.0 + 8.0 * np.cos(2.0 * time)
    # each shift leaves a step of 0.5 N that fades within twenty steps
    force[:, 0] = -30.0 + 0.5 * (np.arange(rows) % 40 >= 39) + 0.5 * (np.arange(rows) % 40 < 20)
    none = np.zeros((rows, 9))
    tow = Tow(
        time=time,
        place=1.5 * time,
        force=force,
        inside=none + 0.01,
        tops=none - 0.02,
        outside=none,
        shifted=shifted,
        cost=np.where(time > 36.0, 0.022, 0.02),
        gap=np.full(rows, 1e-7),
        particles=np.full(rows, 500),
        twins=np.full((4, 10, 3), 0.1),
        come=7.0,
        gone=5.0,
        shot=np.zeros((0, 3)),
        sea=np.zeros((2, 0)),
        radius=0.1,
        depth=0.2,
        amplitude=0.1,
        encounter=2.0,
        spacing=0.05,
        samples=10,
        step=step,
    )
    found = {name: value for name, (value, _) in measures(tow, tow).figures.items()}
    wave = 8.0 * 2.0 / math.pi
    assert found["mean wave force, largest axis [N]"] == pytest.approx(wave, rel=1e-3)
    assert found["mean jump at a shift over mean wave force [%]"] == pytest.approx(
        50.0 / wave, rel=0.02
    )
    assert found["with the shift less without it, mean of 10 steps [%]"] == pytest.approx(
        10.0 / wave, rel=1e-3
    )
    surface = "elevation inside against outside, rms over amplitude [%]"
    assert found[surface] == pytest.approx(10.0)
    assert found["ball: change of the cost [%]"] == pytest.approx(10.0)
