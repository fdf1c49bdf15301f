"""Behaviours of animals over a batch, beside those of one animal; settings told by their name."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.plugins.guides.behaviour import Flee, Shy, Wander


def _state(place: Floats, enemy: Floats) -> Any:
    """What an animal sees of its enemy."""
    return SimpleNamespace(position=place, yaw=0.0, time=0.0, bodies={"robot": enemy})


def test_flights_over_a_batch_are_those_of_one() -> None:
    """Crabs near and far, calm and alarmed: the same velocity, the same memory."""
    flee, rng = Flee(enemy="robot", speed=0.1, alarm=0.5, calm=1.0), np.random.default_rng(3)
    place, enemy = rng.uniform(-0.5, 0.5, (40, 3)), rng.uniform(-0.5, 0.5, (40, 3))
    runs = (rng.random((40, 1)) < 0.5).astype(float)
    many = flee.over_batch()
    time = np.zeros((40, 1))
    way, after = many.aim(place, enemy, time, (runs,), lambda k: np.zeros((40, k)))
    for row in range(40):
        seen = _state(place[row], enemy[row])
        memory = flee.start(seen)._replace(runs=bool(runs[row, 0]))
        aim, memory = flee.aim(seen, memory)
        np.testing.assert_allclose(way[row], aim.velocity, atol=1e-12)
        assert bool(after[0][row, 0]) == memory.runs
    assert 0.2 < after[0].mean() < 0.95


def test_wanderers_rest_and_walk_for_their_mean_times_and_turn_home() -> None:
    """Exponential bouts: walk / (walk + pause) of the time they walk; the far ones return."""
    wander, rng, count = (
        Wander(walk=2.0, pause=3.0, radius=0.2, speed=0.1),
        np.random.default_rng(0),
        400,
    )
    many = wander.over_batch()
    place, time = np.zeros((count, 3)), np.zeros((count, 1))
    memory, walked, farthest = many.start(place, time), 0.0, 0.0
    for _ in range(1500):
        way, memory = many.aim(place, place, time, memory, lambda k: rng.random((count, k)))
        place, time = place + 0.1 * way, time + 0.1
        walked += float((np.linalg.norm(way, axis=1) > 0.0).mean()) / 1500
        farthest = max(farthest, float(np.median(np.linalg.norm(place[:, :2], axis=1))))
    assert walked == pytest.approx(0.4, abs=0.02)
    assert farthest < 0.5
    assert not math.isclose(farthest, 0.0)


def test_some_animals_are_shy_and_stay_so() -> None:
    """Half of many seeds flee, one by one and over a batch; none changes its mind."""
    alone = [Shy(enemy="robot", seed=k).start(_state(np.zeros(3), np.ones(3))) for k in range(300)]
    assert np.mean([memory.flees for memory in alone]) == pytest.approx(0.5, abs=0.1)
    rng, count = np.random.default_rng(1), 300
    many = Shy(enemy="robot", walk=0.1, pause=1e3, flight=0.1).over_batch()
    place, time = np.zeros((count, 3)), np.zeros((count, 1))
    enemy = place + np.array([0.1, 0.0, 0.2])
    memory = many.start(place, time)
    for _ in range(50):
        way, memory = many.aim(place, enemy, time, memory, lambda k: rng.random((count, k)))
        time = time + 0.1
    flees = memory[0][:, 0] > 0.5
    assert flees.mean() == pytest.approx(0.5, abs=0.1)
    np.testing.assert_allclose(way[flees], [[-0.1, 0.0, 0.0]] * int(flees.sum()), atol=1e-9)
    assert np.abs(way[~flees]).max() < 0.09


@pytest.mark.parametrize(("behaviour", "name"), [(Flee, "flee"), (Shy, "shy")])
def test_a_calm_below_the_alarm_is_told_by_the_name_of_the_guide(behaviour: Any, name: str) -> None:
    """A shy animal flees by `Flee`, but its user has set a field of `Shy`."""
    with pytest.raises(ConfigError, match=rf"^{name}\.alarm=.* is above {name}\.calm=0.1"):
        behaviour(calm=0.1)
