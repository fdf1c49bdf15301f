"""A dead zone on the command, before the lag, against closed forms; batches and machine code."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from seals.api import make
from seals.arrays import Floats
from seals.effects import bind_effects
from seals.effects.binding import EffectSet
from seals.motion import Drives, Inputs
from seals.plugins.actuators.rotors import Rotors
from seals.plugins.actuators.thrusters import Thrusters
from seals.plugins.effects.thruster_dead_zone import (
    DeadZoneForm,
    DeadZonePlace,
    ThrusterDeadZone,
)
from seals.testing.instants import random_instant
from seals.world.drivetrain import Drivetrain, response_of

LAG, DEAD = 0.08, 2.0
PLACES = [[0.0, 0.1, 0.0], [0.0, -0.1, 0.0]]


def fitted(form: str, place: str, force: float = DEAD) -> EffectSet:
    """Two thrusters with a dead zone."""
    thrusters = Thrusters(position=PLACES, time_constant=[LAG], max_force=[30.0])
    dead = ThrusterDeadZone(force=force, form=DeadZoneForm(form), place=DeadZonePlace(place))
    return bind_effects({"thrusters": thrusters, "dead": dead}, ["hull"])


def followed(effects: EffectSet, times: Floats, commands: Floats) -> Floats:
    """States of the drives at some times under commands held between them, shape (T, n)."""
    train, state, out = Drivetrain(effects, 0), np.zeros((1, commands.shape[1])), []
    for time, command in zip(times, commands, strict=True):
        state = train.drive(float(time), command[None], state)  # type: ignore[assignment]
        out.append(state[0])
    return np.array(out)


@pytest.mark.parametrize(("form", "beyond"), [("shifted", 5.0 - DEAD), ("jump", 5.0)])
def test_a_step_beyond_it_is_followed_with_the_lag(form: str, beyond: float) -> None:
    """As u (1 - exp(-t / tau)), u less the dead zone or all of it; nothing of 1.5 N."""
    times = np.linspace(0.0, 0.4, 41)
    found = followed(fitted(form, "command"), times, np.tile([5.0, -1.5], (41, 1)))
    assert_allclose(found[:, 0], beyond * (1.0 - np.exp(-times / LAG)), atol=1e-12)
    assert_allclose(found[:, 1], 0.0, atol=1e-12)


def describing(share: float) -> float:
    """Gain of a shifted dead zone for a sine of an amplitude of 1 / share dead zones."""
    return 1.0 - 2.0 / math.pi * (math.asin(share) + share * math.sqrt(1.0 - share**2))


@pytest.mark.parametrize("place", ["command", "force"])
def test_a_sine_passes_dead_zone_and_lag_in_their_order(place: str) -> None:
    """First harmonic of the force over that of the command, by the describing function N(d / A).

    On the command N(d / A) / (1 + i w tau), on the force N(d / |A / (1 + i w tau)|) / (1 + i w
    tau), which is 0.48 of it here. Commands are held: what is sampled half a step later is theirs.
    """
    size, omega, step = 6.0, 2.0 * math.pi * 3.0, 1.0 / 6000.0
    times = np.arange(12000) * step
    effects = fitted("shifted", place)
    command = np.stack([size * np.sin(omega * (times + 0.5 * step)), 0.0 * times], axis=1)
    now = random_instant(np.random.default_rng(0), 1)
    inputs = Inputs(0.0, np.zeros((1, 0)), followed(effects, times, command))
    (actuator,), (dead,) = effects.actuators, effects.actuations
    drives: Drives = actuator.hooks.drives(inputs, actuator.params)
    out: Floats = dead.hooks.actuation(drives, now.motion, now.medium, inputs, dead.params).thrust
    force = out[:, 0]
    # the second half holds three periods, behind the start
    kept = times >= 1.0
    carrier = np.exp(-1j * omega * times[kept])
    found = 2.0 * np.mean(force[kept] * carrier) / (size / 1j)
    lag = 1.0 / (1.0 + 1j * omega * LAG)
    gain = describing(DEAD / (size * (1.0 if place == "command" else abs(lag))))
    assert abs(found) == pytest.approx(gain * abs(lag), rel=2e-4)
    assert cmath.phase(found) == pytest.approx(cmath.phase(lag), abs=2e-4)


@pytest.mark.parametrize("library", ["numpy", "torch"])
def test_one_robot_is_a_batch_of_one(library: str) -> None:
    """Three robots with dead zones of their own follow as each alone does."""
    xp: Any = pytest.importorskip(library)
    sizes = [0.0, 1.0, 2.5]
    effects = fitted("jump", "command")
    like = xp.zeros(1, dtype=xp.float64)
    values = {"dead.force": xp.asarray(sizes, dtype=xp.float64)}
    response = response_of(effects).over_batch(like, effects.with_values(values, like, 3))
    command = np.array([[2.4, -1.1], [1.02, -0.5], [2.4, 9.0]])
    goal = response.goal(xp.asarray(command), None)
    state = np.asarray(response.followed(0.0 * goal, goal, 0.05))
    for k, size in enumerate(sizes):
        alone = followed(
            fitted("jump", "command", size), 0.05 * np.arange(2.0), np.tile(command[k], (2, 1))
        )
        assert_allclose(state[k], alone[1], atol=1e-15)


def test_rotors_and_other_thrusters_are_left_alone() -> None:
    """Of rotors first, then thrusters, on one link only the thrusters have a dead zone."""
    rotors = Rotors(position=PLACES, time_constant=[0.0], max_speed=[900.0])
    thrusters = Thrusters(position=PLACES, time_constant=[0.0], first=rotors.count)
    dead = ThrusterDeadZone(force=DEAD, place=DeadZonePlace.command)
    given = {"rotors": rotors, "thrusters": thrusters, "dead": dead}
    command = np.array([[1.0, 1.5, 1.0, 3.0]])
    assert_allclose(
        response_of(bind_effects(given, ["hull"])).goal(command, None), [[1, 1.5, 0, 1]]
    )


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_machine_code_follows_as_numpy_does(engine: str) -> None:
    """The vehicle holds its place in a current with thrusters that stand still below 2 N."""
    pytest.importorskip("llvmlite")
    pytest.importorskip(engine)
    words = ["robot=rov", "water=fossen", "guide=hover", "initial.position=[0,0,-3]"]
    words += ["+effect@effects.flow=current", "effects.flow.velocity_y=0.1"]
    words += ["effects.dead_zone.place=command", "effects.dead_zone.force=2.0"]
    found = []
    for flag in ("false", "true"):
        world = make([*words, f"backend={engine}", f"backend.compiled={flag}"])
        track = []
        for _ in range(150):
            world.step()
            actor = world.actors["robot"]
            assert actor.drive is not None
            track.append(np.concatenate((actor.drive[0], actor.body.poses().origins.ravel())))
        found.append(np.array(track))
        world.close()
    still = np.abs(found[0][:, :8]) < 1e-9
    assert 0 < still.sum() < still.size
    assert_allclose(found[1], found[0], rtol=0.0, atol=1e-12)
