"""Faults on purpose: rotors and sensors that die, no weight, cables too stiff, steps too long."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

import numpy as np
import pytest

from seals.errors import ConfigError, PhysicsError
from seals.plugins.effects.linear_drag import DragLinear
from seals.plugins.effects.tether import Tether
from seals.run import build_world
from seals.run.build import run_settings
from seals.run.simulation import Ending, Record, simulate
from seals.world import World

if TYPE_CHECKING:
    from tests.verification.conftest import Bench

HOVER = ("robot=aam", "guide=hover", "initial.position=[0,0,20]", "initial.drives=carrying")


def flown(*words: str) -> Record:
    """Run to the end, whatever ends it."""
    return simulate(run_settings([*HOVER, *words]))


def stepped(world: World, steps: int) -> None:
    """Take so many steps."""
    for _ in range(steps):
        world.step()


@pytest.mark.thorough
def test_with_a_dead_rotor_it_falls_as_three_rotors_let_it() -> None:
    """The first second without one of four rotors: it turns over and sinks; no number is lost."""
    record = flown(
        "+effect@effects.dead=weak_rotor", "effects.dead.relative_loss=1.0", "time.duration=1.5"
    )
    assert record.ending is Ending.done
    assert all(np.all(np.isfinite(x)) for x in (record.log.channel("position"),))
    fall = 20.0 - record.log.channel("position")[-1, 2]
    # three quarters of the lift at the most: it falls faster than with a quarter of the weight,
    # and no faster than freely
    free = 0.5 * 9.81 * 1.5**2
    assert 0.25 * free < fall < free
    lost = record.ledger.of("rotors")[:, 0]
    assert np.abs(lost[5:50, 3:5]).max() > 0.3


def test_with_a_dead_sensor_the_pilot_goes_on_blind() -> None:
    """Odometry that never arrives: the log has no reading of it, and everything stays finite."""
    words = (
        "+sensor@sensors.odometry=odometry",
        "controller.sense=odometry",
        "sensors.odometry.dropout=1.0",
        "time.duration=1.0",
    )
    record = flown(*words)
    assert record.ending is Ending.done
    assert record.error is None
    # what nobody measured is not in the log as if it had been
    assert not np.isfinite(record.log.channel("estimated_position")).any()
    assert np.all(np.isfinite(record.log.channel("position")))
    assert np.all(np.isfinite(record.ledger.wrenches))


def test_without_weight_nothing_falls() -> None:
    """Zero gravity: a body at rest stays, one that moves goes straight at its speed."""
    words = ["robot=ball", "environment.gravity=0", "initial.position=[0,0,5]"]
    still = simulate(run_settings([*words, "time.duration=1"]))
    assert still.log.channel("position")[-1] == pytest.approx([0.0, 0.0, 5.0], abs=1e-12)
    settings = run_settings(
        [*words, "initial.velocity=[1,2,-3]", "~effects.air_drag", "time.duration=1"]
    )
    with contextlib.closing(build_world(settings)) as world:
        stepped(world, 250)
        at = world.actors["robot"].body.read()
    assert at.position == pytest.approx([1.0, 2.0, 2.0], abs=1e-9)
    assert at.velocity == pytest.approx([1.0, 2.0, -3.0], abs=1e-12)


@pytest.mark.parametrize("share", [0.9, 10.0])
def test_a_step_too_long_for_a_cable_is_refused_with_its_bound(bench: Bench, share: float) -> None:
    """Leapfrog: a spring is stable up to h = 2 sqrt(m / K), and only up to there."""
    mass, stiffness = 2.0, 5000.0
    bound = 2.0 * np.sqrt(mass / stiffness)
    robot = bench.body(mass, (0.02, 0.02, 0.02))
    settings = bench.settings(
        robot,
        {"cable": Tether(anchor_z=1.0, length=0.0, stiffness=stiffness)},
        weight=False,
        step=share * bound,
        duration=200 * share * bound,
    )
    if share > 1.0:
        with pytest.raises(ConfigError, match=rf"up to {bound:.3g}"):
            build_world(settings)
        return
    run = bench.run("world", settings)
    # energy of the swing at 0.9 of the bound: bounded, no growth over 200 steps
    assert np.abs(run.position[:, 2] - 1.0).max() < 3.0


def test_the_bound_of_a_cable_is_where_the_motion_breaks(bench: Bench) -> None:
    """A tenth beyond the bound, past the check, the swing grows until it is refused in flight."""
    robot = bench.body(2.0, (0.02, 0.02, 0.02))
    bound = 2.0 * np.sqrt(2.0 / 5000.0)
    settings = bench.settings(
        robot,
        {"cable": Tether(anchor_z=1.0, length=0.0, stiffness=5000.0)},
        weight=False,
        step=0.5 * bound,
        duration=1.0,
    )
    with contextlib.closing(build_world(settings)) as world:
        actor = world.actors["robot"]
        # the same world, its spring 4.84 times as stiff: the step is 1.1 bounds long
        bound_effect = next(b for b in actor.effects.bound if b.name == "cable")
        bound_effect.params["stiffness"] = bound_effect.params["stiffness"] * 4.84
        with pytest.raises(PhysicsError, match=r"take a smaller time\.step"):
            stepped(world, 400)


def test_a_step_ten_times_too_long_for_the_controller_is_refused() -> None:
    """The manipulator's controller at 125 Hz: 16 ms go, 40 ms do not, and the bound is said."""
    assert flown("time.step=0.016", "time.duration=0.5").ending is Ending.done
    with pytest.raises(ConfigError, match=r"controller\.rate=125: .*\n.*up to 0\.016"):
        flown("time.step=0.04", "time.duration=0.5")


def test_a_step_too_long_for_a_drag_is_refused_while_it_runs(bench: Bench) -> None:
    """Drag of 40 m / h throws the body faster and faster; the refusal says what to do."""
    robot = bench.body(1.0, (0.02, 0.02, 0.02))
    drag = DragLinear(coefficient_x=1e4, coefficient_y=1e4, coefficient_z=1e4)
    settings = bench.settings(
        robot, {"drag": drag}, weight=False, step=0.004, duration=1.0, velocity=[1.0, 0.0, 0.0]
    )
    with (
        contextlib.closing(build_world(settings)) as world,
        pytest.raises(PhysicsError, match=r"take a smaller time\.step"),
    ):
        stepped(world, 250)


def test_after_a_cable_snaps_the_body_goes_straight(bench: Bench) -> None:
    """A body that swings on a cable without weight: at the snap it keeps its velocity, at once."""
    robot = bench.body(2.0, (0.02, 0.02, 0.02))
    settings = bench.settings(
        robot,
        {"cable": Tether(length=1.0, stiffness=200.0)},
        weight=False,
        step=0.004,
        duration=4.0,
        position=[1.1, 0.0, 0.0],
        velocity=[0.0, 2.0, 0.0],
    )
    with contextlib.closing(build_world(settings)) as world:
        actor = world.actors["robot"]
        stepped(world, 300)
        held = actor.body.read()
        cable = next(b for b in actor.effects.bound if b.name == "cable")
        assert np.abs(actor.ledger.of("cable")[-1]).max() > 5.0
        cable.params["stiffness"] = cable.params["stiffness"] * 0.0
        stepped(world, 1)
        after = actor.body.read()
        stepped(world, 250)
        end = actor.body.read()
    # the velocity at the snap holds half of the last kick, which the next step takes back: one
    # kick of the cable at most, and nothing from then on
    kick = 0.004 * 200.0 * 0.5 / 2.0
    assert np.linalg.norm(after.velocity - held.velocity) < kick
    assert end.velocity == pytest.approx(after.velocity, abs=1e-12)
    assert end.position == pytest.approx(after.position + after.velocity, abs=1e-9)
