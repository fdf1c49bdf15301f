"""Reach in a current, follow a pipe: frozen starts, the way of the target, and the scripts."""

from __future__ import annotations

import hashlib
import math
from typing import Any

import numpy as np
import pytest

from seals.arrays import Floats
from seals.config.compose import compose
from seals.learn.environments.build import batched_of, build_learning
from seals.learn.starts import held_out_seeds, validation_seeds
from seals.learn.task import Instant
from seals.plugins.tasks.pipe import TaskPipe
from seals.plugins.tasks.reach import EXPERT_GAIN, TaskReach, TaskReachCurrent

TWINS = ("reach_current", "reach_current_crossing", "pipe", "pipe_crossing")
FROZEN = {
    "reach": ("f186e34a65727801", "70ebb0b5814108fc", "3224e20e5d25cf96"),
    "catch": ("2ca847efbaeb2869", "2f79faeab8772b39", "ebf1df6415afa19d"),
    "reach_current": ("3f23900eb8de1c58", "884d665bdc548667", "3f88310774b532da"),
    "reach_current_crossing": ("bbd99fa453490ce4", "b217c4c3a3d19d23", "2ca4f7abdcd7d7b2"),
    "pipe": ("ddb84347cc8d1ae1", "fc0cad1fac67f0ba", "2733a2b9d86cbb50"),
    "pipe_crossing": ("ec3e5c4ea8b78a58", "fcb4513d42bb0c70", "3e5471260e4984f0"),
    "pick": ("a37e57ca71e05b9b", "acf63561c6eed046", "096e2d4ca318e357"),
    "pick_crossing": ("2ca847efbaeb2869", "2f79faeab8772b39", "ebf1df6415afa19d"),
    "place": ("d15aa9f8a3976915", "14e590957a02a717", "2a8407e07953e952"),
    "place_crossing": ("09aecfcb51e6ec8f", "2a49c1204bc3aac8", "28e875cb5cd06afa"),
    "valve": ("6e20d51fa3ddb785", "cdc3c6807d6392e0", "ce47e522b0a70c5b"),
    "valve_crossing": ("9238fcdf8f8ae8c2", "78b667a107c12504", "e748440160ab9dae"),
}
"""Digests of a hundred starts each: for training (seeds from 0), validation and test."""


@pytest.mark.parametrize("env", FROZEN)
def test_starts_stay_as_they_were_published(env: str) -> None:
    """A figure of these tasks means these starts; no start serves two purposes."""
    _, task = build_learning(compose([f"env={env}"], root="learn"))
    sets = [
        np.array([_start(task, seed) for seed in seeds])
        for seeds in (range(100), validation_seeds(100), held_out_seeds(100))
    ]
    assert tuple(_digest(rows) for rows in sets) == FROZEN[env]
    assert len(np.unique(np.concatenate(sets), axis=0)) == 300


def _start(task: Any, seed: int) -> Floats:
    return np.concatenate([x.ravel() for x in task.draw(np.random.default_rng(seed), 1)])


def _digest(rows: Floats) -> str:
    return hashlib.sha256(np.round(rows, 9).tobytes()).hexdigest()[:16]


def test_the_target_goes_along_both_parts() -> None:
    """A bend of a right angle after half of 2 m, at 0.5 m/s from second 1 on."""
    task = TaskPipe(length=2.0, pace=0.5, approach=1.0)
    goal = np.array([[1.0, 2.0, -1.5, 0.0, 0.5 * math.pi]])
    places = {0.5: (1.0, 2.0), 2.0: (1.5, 2.0), 3.0: (2.0, 2.0), 4.0: (2.0, 2.5), 9.0: (2.0, 3.0)}
    for time, (x, y) in places.items():
        place, _ = task.target(goal, np.array([[time]]))
        np.testing.assert_allclose(place, [[x, y, -1.5]], atol=1e-12)
    speeds = {0.5: (0.0, 0.0), 2.0: (0.5, 0.0), 4.0: (0.0, 0.5), 9.0: (0.0, 0.0)}
    for time, (x, y) in speeds.items():
        _, speed = task.target(goal, np.array([[time]]))
        np.testing.assert_allclose(speed, [[x, y, 0.0]], atol=1e-12)


def test_an_upright_pipe_leads_straight_up() -> None:
    """A riser: its bend turns nothing, and its end is its length above its beginning."""
    task = TaskPipe(rise=0.5 * math.pi)
    goal = np.array([[0.1, 0.2, -1.1, 0.7, -0.9]])
    place, _ = task.target(goal, np.array([[100.0]]))
    np.testing.assert_allclose(place, [[0.1, 0.2, -1.1 + task.length]], atol=1e-9)


def _carried(task: TaskReach, drift: Floats, steps: int) -> float:
    """Last distance of a hand that does what it is told but for a drift, from 0.5 m away."""
    place, action = np.zeros((1, 3)), np.zeros((1, 3))
    target, step = np.array([[0.5, 0.0, 0.0]]), 1.0 / task.rate
    one = np.ones((1, 1))
    for k in range(steps):
        velocity = task.speed * action - drift
        now = Instant(
            *(step * k * one, place, np.eye(3)[None], velocity, place * 0.0, place),
            *(target, place * 0.0, one, action, one, {}),
        )
        action = task.scripted_policy(now)
        place = place + step * (task.speed * action - drift)
    return float(np.linalg.norm(target - place))


def test_the_integral_finds_the_current() -> None:
    """A proportional law stays behind by drift over gain; with its integral nothing is left."""
    drift = np.array([[0.2, -0.1, 0.0]])
    left = _carried(TaskReach(), drift, 1000)
    assert left == pytest.approx(float(np.linalg.norm(drift)) / EXPERT_GAIN, rel=1e-6)
    assert _carried(TaskReachCurrent(), drift, 1000) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("env", TWINS)
def test_the_script_succeeds(env: str) -> None:
    """Of twelve validation starts, with batch dynamics."""
    batch: Any = batched_of(compose([f"env={env}"], root="learn"), count=12, coded=True)
    batch.reset(validation_seeds(12))
    for _ in range(batch.episodes.steps):
        turn = batch.step(batch.scripted_policy())
    batch.close()
    assert bool(turn.truncated.all())
    assert int(turn.success.sum()) >= 11
