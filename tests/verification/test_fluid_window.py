"""The window of particle water: rest, a current, waves, momentum, and counts that add up."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.environment.settings import EnvironmentSettings
from seals.fluid import BodyStates, FluidBody, Surrounding
from seals.plugins.fluids.moving_domain import FluidWindow
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.plugins.waves.sea import WaveSea
from seals.plugins.waves.still import WaveStill
from seals.robot.pieces import Piece

pytestmark = pytest.mark.filterwarnings("ignore:.*getdefaultlocale:DeprecationWarning")
Floats = NDArray[np.float64]
STEP = 0.005
SMALL: dict[str, Any] = {"spacing": 0.05, "ring": 4, "freeboard": 0.2}
NOTHING = FluidBody("robot/nothing", ())
BALL = FluidBody("robot/ball", (Piece("sphere", (0.1,), np.zeros(3), np.eye(3)),))


def opened(wave: Any, body: FluidBody, **fields: Any) -> FluidWindow:
    """Open a small window around one body."""
    fluid = FluidWindow(**SMALL | fields)
    environment = EnvironmentSettings(water_level=0.0, water_density=1000.0)
    fluid.open(Surrounding(environment, wave, (), STEP), [body])
    return fluid


def held(place: tuple[float, float, float], speed: float = 0.0) -> BodyStates:
    """Return a body that nothing but its way moves."""
    still = np.zeros((1, 3))
    velocity = np.array([[speed, 0.0, 0.0]])
    turn, none = np.eye(3)[None], np.zeros((1, 3, 3))
    return BodyStates(np.array([place]), turn, velocity, still, np.zeros(1), none, still)


@pytest.fixture
def closing() -> Iterator[list[FluidWindow]]:
    """Close what a test opened."""
    fluids: list[FluidWindow] = []
    yield fluids
    for fluid in fluids:
        fluid.close()


@pytest.mark.thorough
def test_still_water_in_a_window_stays_at_rest_and_level(closing: list[FluidWindow]) -> None:
    """No particle comes or goes, nothing flows, the surface stays within a tenth of a spacing."""
    fluid = opened(WaveStill(), NOTHING, size=[0.7, 0.7, 0.4])
    closing.append(fluid)
    fluid.initialise(held((0.0, 0.0, -0.2)))
    for k in range(120):
        fluid.exchange(held((0.0, 0.0, -0.2)), k * STEP, STEP)
    figures, speed = fluid.diagnostics(), fluid.particles()[1]
    assert figures["particles"] == 14 * 14 * 8
    assert figures["particles come"] == figures["particles gone"] == 0
    assert np.abs(speed.mean(axis=0)).max() < 2e-3
    assert np.sqrt((speed**2).mean()) < 0.03
    places = np.array([[x, y, 0.0] for x in (-0.1, 0.0, 0.1) for y in (-0.1, 0.0, 0.1)])
    level = np.asarray(fluid.surface(places).elevation)
    assert abs(level.mean()) < 0.1 * 0.05
    outside = fluid.surface(np.array([[30.0, 0.0, 0.0]])).elevation
    assert float(outside[0, 0]) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.thorough
def test_a_current_passes_through_a_window_that_stays(closing: list[FluidWindow]) -> None:
    """Water keeps the speed of the current, and the window stays with a robot that stands still."""
    fluid = opened(WaveStill(), NOTHING, size=[0.7, 0.7, 0.4], current=[1.0, 0.0])
    closing.append(fluid)
    place = (0.0, 0.0, -0.2)
    fluid.initialise(held(place))
    pushed = []
    for k in range(160):
        impulses = fluid.exchange(held(place), k * STEP, STEP)
        assert not impulses.any()
        balance = fluid.momentum_balance()
        assert balance is not None
        pushed.append(balance.walls[:2] / STEP)
    places, speed = fluid.particles()
    figures = fluid.diagnostics()
    assert figures["shifts of the window"] == 15
    assert speed.mean(axis=0) == pytest.approx([1.0, 0.0, 0.0], abs=0.01)
    assert np.abs(places[:, :2]).max() < 0.35 + 1.5 * 0.05
    assert figures["particles"] == pytest.approx(14 * 14 * 8, rel=0.005)
    # what sides take of the weight of the water in a second would stop it if it were one-sided
    weight = 1000.0 * 9.81 * 0.7 * 0.7 * 0.4
    assert np.abs(np.mean(pushed, axis=0)).max() < 0.01 * weight


@pytest.mark.thorough
def test_momentum_and_counts_add_up_on_a_tow_through_waves(closing: list[FluidWindow]) -> None:
    """Books hold what the ring, the shifts and the level give and take; so does the count."""
    fluid = opened(WaveSea(height=0.08, period=1.2), BALL, size=[0.9, 0.9, 0.4], current=[0.2, 0.1])
    closing.append(fluid)
    fluid.initialise(held((0.0, 0.0, -0.2), 1.0))
    start, gaps, sources = fluid.diagnostics()["particles"], [], []
    for k in range(120):
        fluid.exchange(held((k * STEP, 0.0, -0.2), 1.0), k * STEP, STEP)
        balance = fluid.momentum_balance()
        assert balance is not None
        gaps.append(np.abs(balance.gap).max() / balance.gross)
        sources.append(np.abs(balance.sources).max() / balance.gross)
    figures = fluid.diagnostics()
    assert figures["shifts of the window"] >= 8
    assert max(gaps) < 1e-5
    assert max(sources) > 1e-2
    came = figures["particles come"] - figures["particles gone"]
    assert figures["particles"] == start + came
    assert figures["particles"] == pytest.approx(18 * 18 * 8 - 4 / 3 * np.pi * 2**3, rel=0.01)


@pytest.mark.slow
def test_the_surface_of_the_window_follows_the_outer_sea(closing: list[FluidWindow]) -> None:
    """Two periods of a wave, the window moving along: rms within a tenth of the amplitude."""
    fluid = opened(WaveSea(height=0.2, period=2.0), NOTHING, size=[1.2, 0.8, 0.6])
    closing.append(fluid)
    fluid.initialise(held((0.0, 0.0, -0.1)))
    places = np.array([[x, 0.0, 0.0] for x in (-0.2, -0.1, 0.0, 0.1, 0.2)])
    off = []
    for k in range(800):
        x = 0.5 * k * STEP
        fluid.exchange(held((x, 0.0, -0.1)), k * STEP, STEP)
        at = places + np.array([x, 0.0, 0.0])
        outer = fluid.simulation.outer.elevation(at, (k + 1) * STEP)
        off.append(np.asarray(fluid.surface(at).elevation)[:, 0] - outer)
    assert np.sqrt(np.mean(np.square(off))) < 0.1 * 0.1


def test_water_of_a_window_has_its_rest_density_at_every_depth(closing: list[FluidWindow]) -> None:
    """Its weight presses less than half of what it would at that speed of sound, g h / c^2."""
    physics = PbfSettings(sound_speed=10.0, deterministic=True)
    fluid = opened(WaveStill(), NOTHING, size=[0.7, 0.7, 0.6], physics=physics)
    closing.append(fluid)
    place, pressures = (0.0, 0.0, -0.2), []
    fluid.initialise(held(place))
    water = fluid.simulation.water
    for k in range(60):
        fluid.exchange(held(place), k * STEP, STEP)
        if k >= 30:
            heights = water.positions()[:, 2]
            deep = (heights > -0.5) & (heights < -0.3)
            pressures.append(water.pressures()[deep].mean() / (-9810.0 * heights[deep].mean()))
    assert water.densities()[deep].mean() == pytest.approx(1000.0, abs=500.0 * 9.81 * 0.4 / 10.0**2)
    # a column that is compressed by g h / c^2 at each depth h sinks by g H^2 / (3 c^2) in the mean
    assert heights.mean() == pytest.approx(-0.3, abs=0.5 * 9.81 * 0.6**2 / (3.0 * 10.0**2))
    assert np.mean(pressures) == pytest.approx(1.0, abs=0.03)


def test_water_advances_by_several_steps_and_hands_equal_shares_over(
    closing: list[FluidWindow],
) -> None:
    """A slow ball: two steps at once; a fast one raises the speed of sound, and takes every step.

    Momentum: what the water gave in its step is the sum of the shares.
    """
    fluid = opened(WaveStill(), BALL, size=[0.9, 0.9, 0.4])
    closing.append(fluid)
    fluid.initialise(held((0.0, 0.0, -0.2)))
    first = fluid.exchange(held((0.0, 0.0, -0.2)), 0.0, STEP)
    balance, kept = fluid.momentum_balance(), fluid.snapshot()
    again = fluid.exchange(held((0.0, 0.0, -0.2)), STEP, STEP)
    assert balance is not None
    assert (first == again).all()
    assert (2.0 * first[0, :3]) == pytest.approx(balance.bodies, rel=1e-12)
    third = fluid.exchange(held((0.0, 0.0, -0.2)), 2 * STEP, STEP)
    assert (third != again).any()
    fluid.restore(kept)
    assert (fluid.exchange(held((0.0, 0.0, -0.2)), STEP, STEP) == again).all()
    slow, given = fluid.simulation.water.sound, []
    for k in range(2, 6):
        given.append(fluid.exchange(held((0.0, 0.0, -0.2), -2.0), k * STEP, STEP))
    assert fluid.simulation.water.sound >= max(20.0, slow)
    assert all((a != b).any() for a, b in pairwise(given))
