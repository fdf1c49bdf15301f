"""Tasks with objects: lift a sample, put it in a basket, turn a valve."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seals.config.compose import compose
from seals.errors import ConfigError, SealsError
from seals.learn.environments.build import batched_of, build_learning
from seals.learn.starts import validation_seeds
from seals.learn.task import Instant
from seals.plugins.tasks.place import ABOVE, TaskPlace
from seals.plugins.tasks.valve import PUSH, TaskValve

TASKS = ("pick", "place", "valve")


def _task(env: str) -> Any:
    """Return the task of an environment, bound to its robot."""
    return build_learning(compose([f"env={env}"], root="learn"))[1]


def _instant(
    target: list[float], *, above: float, goal: list[float], turn: float = 0.0, grip: float = 1.0
) -> Instant:
    """A level robot at rest that holds the target with all fingers, or has its hand above it."""
    row, one = np.zeros((1, 3)), np.ones((1, 1))
    place = np.array([target])
    hand = place + np.array([0.0, 0.0, above])
    facts = {
        "grip": grip * one,
        "closed": 0.5 * grip * one,
        "touch": 2.0 * grip + row,
        "level": 0.0 * one,
        "goal": np.array([goal]),
        "turn": turn * one,
    }
    last = np.array([[0.0, 0.0, 0.0, 2.0 * grip - 1.0]])
    body = hand + np.array([0.0, 0.0, 0.42])
    return Instant(one, body, np.eye(3)[None], row, row, hand, place, row, one, last, one, facts)


GOAL = [0.1, 0.2, 0.3, 0.5, -0.4]
"""Pose of the object at the start, then the place of the basket."""


@pytest.mark.parametrize(
    ("place", "away"),
    [
        # in it; beside its inside by 5 cm; 3 cm above its rim; both
        ([0.5, -0.4, -0.95], 0.0),
        ([0.5, -0.4 + 0.2, -0.95], 0.05),
        ([0.5, -0.4, -0.87], 0.03),
        ([0.5 - 0.18, -0.4 + 0.2, -0.87], 0.08),
    ],
)
def test_the_way_to_a_basket_is_that_to_its_inside(place: list[float], away: float) -> None:
    """The larger of the horizontal distances, and the height above the rim of 0.1 m."""
    task: TaskPlace = _task("place")
    task.shelf = -1.0
    now = _instant(place, above=0.3, goal=GOAL)
    assert task.distance(now)[0] == pytest.approx(away, abs=1e-9)
    # the hand must be 0.1 m from what it has let go
    near = _instant(place, above=0.04, goal=GOAL)
    assert task.distance(near)[0] == pytest.approx(away + 0.06, abs=1e-9)


def test_a_full_hand_goes_up_before_it_crosses_the_rim() -> None:
    """From the floor straight up, over the rim towards the basket, in the basket it lets go."""
    task: TaskPlace = _task("place")
    task.shelf = -1.0
    low = task.scripted_policy(_instant([0.1, 0.2, -0.97], above=0.0, goal=GOAL))[0]
    assert np.abs(low[:2]).max() < 1e-9
    assert low[2] > 0.0
    assert low[3] == 1.0
    high = -1.0 + task.rim + ABOVE
    over = task.scripted_policy(_instant([0.1, 0.2, high], above=0.0, goal=GOAL))[0]
    assert over[0] > 0.0 > over[1]
    assert over[3] == 1.0
    inside = task.scripted_policy(_instant([0.5, -0.4, -0.95], above=0.0, goal=GOAL))[0]
    assert inside[2] > 0.0
    assert inside[3] == -1.0


def test_a_basket_stands_as_far_as_stated() -> None:
    """From 0.5 to 0.8 m beside the object, and where the draw says."""
    task: TaskPlace = _task("place")
    draw = task.draw(np.random.default_rng(1), 500)
    away = np.linalg.norm(draw.goal[:, 3:5] - draw.goal[:, :2], axis=1)
    assert away.min() > task.near - 1e-9
    assert away.max() < task.far + 1e-9
    assert away.std() > 0.05
    places = task.places(draw.goal[:1])
    np.testing.assert_array_equal(places["sample"], draw.goal[0, :3])
    np.testing.assert_array_equal(places["basket"], [*draw.goal[0, 3:5], 0.0])
    with pytest.raises(ConfigError, match=r"task\.near=2"):
        TaskPlace(near=2.0)


@pytest.mark.parametrize("turn", [0.0, 0.5, 0.5 * math.pi])
def test_a_lever_is_pushed_along_its_circle(turn: float) -> None:
    """Distance is the arc that is left; the velocity is the tangent's where the hand is over it."""
    task: TaskValve = _task("valve")
    heading = 0.3
    goal = [0.1, 0.2, heading]
    pointing = heading + turn
    flat = task.lever * math.cos(pointing), task.lever * math.sin(pointing)
    knob = [0.1 + flat[0], 0.2 + flat[1], -1.6 + task.knob]
    held = _instant(knob, above=0.0, goal=goal, turn=turn)
    # a world tells the place of the valve, not of its knob
    now = held._replace(target=np.array([[0.1, 0.2, -1.6]]))
    assert task.reached(now)[0] == pytest.approx(0.0, abs=1e-12)
    assert task.distance(now)[0] == pytest.approx(task.lever * (0.5 * math.pi - turn), abs=1e-12)
    along = PUSH * np.array([-math.sin(pointing), math.cos(pointing), 0.0])
    np.testing.assert_allclose(task.bring(held)[0], along, atol=1e-12)
    seen = dict(zip(task.observation_names, task.observation(now)[0], strict=True))
    assert seen["lever_x"] == pytest.approx(math.cos(pointing))
    assert seen["left"] == pytest.approx(0.5 * math.pi - turn)


def test_a_lift_under_water_ends_under_water() -> None:
    """0.4 m above a floor of 1.6 m depth; the script goes up until half of the depth is left."""
    task = _task("pick")
    for height, lacking in ((-1.575, 0.375), (-1.2, 0.0), (-0.9, 0.0)):
        now = _instant([0.0, 0.0, height], above=0.0, goal=[0.0, 0.0, 0.0])
        assert task.distance(now)[0] == pytest.approx(lacking, abs=1e-9)
    assert task.gone(_instant([0.0, 0.0, -1.2], above=0.0, goal=[0.0] * 3))[0] == 1.0
    assert task.bring(_instant([0.0, 0.0, -0.6], above=0.0, goal=[0.0] * 3))[0, 2] <= 0.0


def test_a_target_without_joints_has_no_turn() -> None:
    """In words, before the first step."""
    words = ["env=pick", "task=valve", "task.object=sample", "backend=mujoco"]
    with pytest.raises(SealsError, match="'turn', which needs a target with joints"):
        batched_of(compose(words, root="learn"), count=1)


@pytest.mark.slow
@pytest.mark.parametrize("env", [*TASKS, *(f"{name}_crossing" for name in TASKS)])
def test_the_script_succeeds(env: str) -> None:
    """From the first validation start, in a full world; a basket, which cannot move, included."""
    words = [f"env={env}", "task.ends=true", "backend=mujoco"]
    world: Any = batched_of(compose(words, root="learn"), count=1, renew=False, lasting=True)
    world.reset(validation_seeds(1))
    for _ in range(world.episodes.steps):
        turn = world.step(world.scripted_policy())
        if bool(turn.terminated[0]):
            break
    world.close()
    assert bool(turn.success[0])
