"""Actions that pass by loops of the controller: body rates, and thrusts of the rotors."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest

from seals.arrays import Floats
from seals.batch.piloted import PilotedTwin
from seals.config.compose import compose
from seals.control import Reference
from seals.control.mass_properties import MassPropertyEstimator
from seals.errors import ConfigError
from seals.learn.environments.build import batched_of, build_learning
from seals.learn.environments.twin import TwinSimulator
from seals.learn.metadata import world_config
from seals.learn.task import ActionMode, wanted_of
from seals.plugins.tasks.reach import TOPPLED
from seals.plugins.tasks.rewards import Reward
from seals.run.assembly import build_model, build_world
from seals.run.build import build_run
from seals.testing import check_task

torch = pytest.importorskip("torch")

STEP = 0.004
GAIN, QUICKER = (20.0, 20.0, 6.0), 3.0
"""Defaults of the cascade in air: spin_gain of roll and pitch, yaw_spin_gain [1/s], quicker."""
MODES = ("body_rates", "rotor_thrust")
HIGH = np.array([[0.0, 0.0, 5.0]])


@functools.cache
def twin_of(robot: str = "aam") -> Any:
    """One twin, high above the water, with its control loop at every step."""
    overrides = ["env=hover", f"backend.interval={STEP}", f"robot={robot}"]
    settings, task = build_learning(compose(overrides, root="learn"))
    simulator = TwinSimulator(settings, task, count=1, device="cpu")
    start = task.draw(np.random.default_rng(0), 1)._replace(position=HIGH)
    return simulator.twin, simulator.begin(start)[0], task.posture


def carrying(twin: Any, posture: Floats) -> Floats:
    """Shares of the rotors' largest thrusts that carry the weight without turning the robot.

    Equation:
        sum T = m g; sum (y - y_c) T = 0; sum (x - x_c) T = 0; sum d T = 0, with d the reaction.
    """
    layout, mass = twin.plant.layout, MassPropertyEstimator(twin.plant.robot).at(posture)
    largest = layout.thrust_coefficient * layout.limit**2
    x, y, _ = (layout.position - mass.centre).T
    drag = layout.reaction_coefficient / layout.thrust_coefficient
    rows = np.stack((np.ones_like(x), y, x, drag))
    thrust = np.linalg.lstsq(rows, np.array([mass.mass * 9.81, 0.0, 0.0, 0.0]), rcond=None)[0]
    return np.asarray(thrust / largest)[None]


@pytest.mark.parametrize("robot", ["aam", "hexacopter"])
def test_thrusts_that_carry_the_weight_leave_it_where_it_is(robot: str) -> None:
    """Statics: their speeds stay, and so do place and attitude, over half a second."""
    twin, flight, posture = twin_of(robot)
    share = carrying(twin, posture)
    flight = flight._replace(drive=twin.plant.layout.limit * np.sqrt(share))
    after = twin.fly(flight, {"thrusts": share}, 125)
    np.testing.assert_allclose(after.drive, flight.drive, rtol=1e-12)
    np.testing.assert_allclose(after.state.velocity, 0.0, atol=1e-4)
    np.testing.assert_allclose(after.state.angular_velocity, 0.0, atol=1e-4)


def test_thrusts_of_all_rotors_accelerate_by_newton() -> None:
    """A fifth more than the weight: 0.2 g upward, after one step of constant speeds."""
    twin, flight, posture = twin_of()
    share = 1.2 * carrying(twin, posture)
    flight = flight._replace(drive=twin.plant.layout.limit * np.sqrt(share))
    after = twin.fly(flight, {"thrusts": share}, 1)
    np.testing.assert_allclose(after.state.velocity[0] / STEP, [0.0, 0.0, 0.2 * 9.81], atol=1e-3)


def test_thrusts_follow_with_the_lag_of_the_rotors() -> None:
    """No loop is closed: speeds approach by exp(-t / lag), without the controller's lead."""
    twin, flight, posture = twin_of()
    share = carrying(twin, posture)
    first, last = (twin.plant.layout.limit * np.sqrt(x * share) for x in (1.0, 1.3))
    after = twin.fly(flight._replace(drive=first), {"thrusts": 1.3 * share}, 10)
    left = math.exp(-10 * STEP / twin.plant.layout.lag[0])
    np.testing.assert_allclose(after.drive, last + left * (first - last), rtol=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_step_in_rate_gives_that_rate(axis: int) -> None:
    """A loop of gain k over rotors of lag T, made three times as fast: closed form.

    Equation:
        w'' T / 3 + w' + k (w - w_d) = 0 after a period in which nothing happens.
    """
    twin, flight, posture = twin_of()
    share, rates = carrying(twin, posture), np.zeros((1, 4))
    rates[0, 0] = share.mean()
    flight = flight._replace(drive=twin.plant.layout.limit * np.sqrt(share))
    flight = twin.fly(flight, {"rates": rates}, 50)
    start = flight.state.angular_velocity[0, axis]
    rates[0, 1 + axis] = 0.3
    found = []
    for _ in range(100):
        flight = twin.fly(flight, {"rates": rates}, 1)
        found.append((flight.state.angular_velocity[0, axis] - start) / (0.3 - start))
    lag = twin.plant.layout.lag[0] / QUICKER
    s = np.roots([lag, 1.0, GAIN[axis]]).astype(complex)
    time = STEP * np.arange(1, 101)
    # response of two poles to a step, from rest
    wanted = 1.0 + (s[1] * np.exp(s[0] * time) - s[0] * np.exp(s[1] * time)) / (s[0] - s[1])
    # commands are held for a period: 4 ms at the steepest slope, 10 a second
    np.testing.assert_allclose(found, wanted.real, atol=0.04)


def environments(mode: str, *words: str, count: int = 2, **options: Any) -> Any:
    """Environments of the task hover with one action mode."""
    overrides = ["env=hover", f"task.actions={mode}", "task.rate=50", *words]
    return batched_of(compose(overrides, root="learn"), count=count, **options)


def flown(batch: Any, steps: int, size: float = 0.1) -> Floats:
    """Places, attitudes and spins after random actions of a size."""
    rng = np.random.default_rng(4)
    batch.reset(list(range(batch.count)))
    for _ in range(steps):
        action = size * rng.uniform(-1.0, 1.0, (batch.count, batch.action_size))
        batch.step(torch.as_tensor(action, dtype=torch.float32))
    now = batch.now
    flat = [np.reshape(x, (batch.count, -1)) for x in now[1:5]]
    batch.close()
    return np.concatenate(flat, axis=1)


@pytest.mark.parametrize("mode", MODES)
def test_machine_code_of_twins_flies_as_numpy_does(mode: str) -> None:
    """Row by row, within 1e-12 while the drives are within their limits."""
    pytest.importorskip("llvmlite")
    fast, plain = (environments(mode, coded=coded) for coded in (True, False))
    found = flown(fast, 12)
    assert not any(law.refused for law in fast.simulator.machine)
    np.testing.assert_allclose(found, flown(plain, 12), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("mode", MODES)
def test_pytorch_flies_as_numpy_does(mode: str) -> None:
    """The law of the card: in float64, on the processor, to 1e-9 over a second."""
    settings, task = build_learning(compose(["env=hover"], root="learn"))
    robot, effects = build_model(settings)
    ends: list[Floats] = []
    actions = np.array([[0.02, 0.1, -0.1, 0.05], [0.1, 0.02, 0.04, -0.03]])
    for like in (np.zeros(1), torch.zeros(1, dtype=torch.float64)):
        twin = PilotedTwin(
            settings, robot, effects, joints=task.posture.tolist(), batch=2, like=like, step=0.02
        )
        state = twin.twin.start(position=[[0, 0, 1.4], [0.1, 0.0, 0.9]], velocity=[0.0, 0.0, 0.2])
        flight = twin.start(state, like + 670.0 * (like[None] * 0.0 + 1.0))
        action: Any = torch.tensor(actions, dtype=torch.float64) if ends else actions
        task.actions = ActionMode[mode]
        flight = twin.fly(flight, wanted_of(task, action, None), 50)
        ends.append(np.asarray(flight.state.position.tolist()))
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize("mode", MODES)
def test_steps_of_a_world_at_once_are_those_one_by_one(mode: str) -> None:
    """Machine code of a world, controller in the loop, against the laws step by step."""
    pytest.importorskip("mujoco")
    words = ("backend=mujoco", "robot=hexacopter")
    fast, slow = (
        flown(environments(mode, *words, f"backend.compiled={word}", count=1, lasting=True), 10)
        for word in ("true", "false")
    )
    np.testing.assert_allclose(fast, slow, rtol=0.0, atol=1e-9)


def test_sizes_and_bounds() -> None:
    """Actions are named, four or one for each rotor; the whole attitude is seen."""
    sizes = {}
    for mode in ("velocity", *MODES):
        overrides = ["env=hover", "robot=hexacopter", f"task.actions={mode}"]
        _, task = build_learning(compose(overrides, root="learn"))
        sizes[mode] = len(task.action_names), len(task.observation_names)
    assert sizes == {"velocity": (3, 19), "body_rates": (4, 24), "rotor_thrust": (6, 26)}
    for mode in MODES:
        check_task("hover", values={"actions": mode})
    # ends of the range: all that the rotors can do, and nothing
    task.actions, ends = ActionMode.body_rates, np.array([[1.0, 1.0, -1.0, 1.0], [-1.0] * 4])
    found = wanted_of(task, ends, task)["rates"]
    np.testing.assert_allclose(found, [[1.0, 3.0, -3.0, 1.5], [0.0, -3.0, -3.0, -1.5]])


def test_what_takes_no_such_actions_says_so() -> None:
    """Thrusters, catching, and the scripted policy."""
    with pytest.raises(ConfigError, match="velocities only"):
        build_learning(compose(["env=station", "task.actions=body_rates"], root="learn"))
    with pytest.raises(ConfigError, match="no form for catching"):
        build_learning(compose(["env=catch_still", "task.actions=body_rates"], root="learn"))
    batch = environments("rotor_thrust")
    batch.reset([1, 2])
    with pytest.raises(ConfigError, match="no scripted policy"):
        batch.scripted_policy()


def test_a_controller_of_thrusters_refuses_the_reference() -> None:
    """A guide that is told to give thrusts does not fly by a velocity of zero instead."""
    words = ["robot=auv", "guide=commanded", "controller=station", "backend=free"]
    world = build_world(build_run(compose(words)))
    pilot: Any = world.actors["robot"].pilot
    pilot.guide.tell(Reference(thrusts=np.zeros(pilot.plant.layout.drives)))
    with pytest.raises(ConfigError, match="takes no body rates"):
        world.step()


def test_worlds_of_velocities_keep_their_hash() -> None:
    """Policies and demonstrations made before there were action modes stay of their world."""
    plain, other = (
        world_config(compose(["env=hover", *words], root="learn"))["task"]
        for words in ((), ("task.actions=body_rates",))
    )
    assert "actions" not in plain
    assert "rates" not in plain
    assert other["actions"] == "body_rates"


@pytest.mark.parametrize("mode", ["velocity", *MODES])
def test_a_body_on_its_side_ends_its_episode(mode: str) -> None:
    """Where actions turn the body, and at a cost; a controller that holds the attitude recovers."""
    batch = environments(mode, "task.reward_form=none", count=3)
    batch.reset([1, 2, 3])
    rolls = np.array([0.0, 1.5, 1.6])
    turned = np.array(
        [[[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]] for a in rolls]
    )
    now, memory = batch.now._replace(rotation=turned), np.zeros((3, 2))
    toppled = [False, False, mode != "velocity"]
    assert batch.task.ended(now, memory).tolist() == toppled
    batch.task.reward_form = Reward.progress
    before, _ = batch.task.reward(now._replace(rotation=turned * 0.0 + np.eye(3)), now, memory)
    after, _ = batch.task.reward(now, now, memory)
    np.testing.assert_allclose(before - after, TOPPLED * np.array(toppled, dtype=float), atol=1e-9)
