"""Behaviours of animals, alone and as objects of a run."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.api import make
from seals.errors import ConfigError, SealsError
from seals.plugins.guides.behaviour import Flee, March, Seek, Wander
from seals.schema import read

ALONE = ["robot=ball", "environment.ground_level=0.0", "initial.position=[0,0,0.06]"]


def seen(position: tuple[float, float], time: float = 0.0, **bodies: tuple[float, float]) -> Any:
    """Return what a behaviour looks at."""
    return SimpleNamespace(
        time=time,
        yaw=0.3,
        position=np.array([*position, 0.03]),
        bodies={name: np.array([*place, 0.03]) for name, place in bodies.items()},
    )


def test_wandering_is_a_function_of_its_seed() -> None:
    """Equal seeds walk equal bouts, others do not; bouts and pauses have their mean lengths."""

    def ways(seed: int) -> list[tuple[float, float]]:
        guide = Wander(seed=seed, walk=2.0, pause=3.0)
        memory = guide.start(seen((0.0, 0.0)))
        out = []
        for k in range(20000):
            aim, memory = guide.aim(seen((0.0, 0.0), 0.2 * k), memory)
            out.append((float(aim.velocity[0]), float(aim.velocity[1])))
        return out

    first = ways(1)
    assert first == ways(1)
    assert first != ways(2)
    walking = np.mean([vx != 0.0 or vy != 0.0 for vx, vy in first])
    # 2 s of walking to 3 s of rest; some 800 bouts
    assert walking == pytest.approx(0.4, abs=0.05)


def test_a_wanderer_turns_home() -> None:
    """Beyond its radius every bout leads back."""
    guide = Wander(radius=0.5, walk=1.0, pause=0.0, speed=0.1)
    memory = guide.start(seen((0.0, 0.0)))
    for k in range(200):
        aim, memory = guide.aim(seen((2.0, 0.0), 0.2 * k), memory)
        if aim.velocity.any() and memory.bouts > 1:
            assert aim.velocity[0] < 0.0


def test_seeking_ends_at_the_target() -> None:
    """It walks towards the place, slower near it, and is done there."""
    guide = Seek(place=[1.0, 1.0], speed=0.2, slow=0.2, near=0.03)
    aim, memory = guide.aim(seen((0.0, 0.0)), guide.start(seen((0.0, 0.0))))
    assert aim.velocity == pytest.approx([0.2 / np.sqrt(2.0), 0.2 / np.sqrt(2.0), 0.0])
    assert guide.finished(memory) is None
    aim, memory = guide.aim(seen((0.9, 1.0)), memory)
    assert np.linalg.norm(aim.velocity) == pytest.approx(0.1)
    aim, memory = guide.aim(seen((0.98, 1.0)), memory)
    assert not aim.velocity.any()
    assert guide.finished(memory) is True


def test_fleeing_starts_at_the_alarm_and_ends_when_calm() -> None:
    """It runs straight away between alarm and calm, with a memory of which it is."""
    guide = Flee(enemy="hunter", alarm=0.5, calm=0.8, speed=0.3)
    memory = guide.start(seen((0.0, 0.0), hunter=(2.0, 0.0)))
    for far, runs in ((0.7, False), (0.4, True), (0.7, True), (0.9, False), (0.7, False)):
        aim, memory = guide.aim(seen((0.0, 0.0), hunter=(far, 0.0)), memory)
        assert aim.velocity == pytest.approx([-0.3 if runs else 0.0, 0.0, 0.0], abs=1e-12)
        assert guide.stage(memory) == ("fleeing" if runs else "still")


def test_an_enemy_that_is_not_there_is_refused() -> None:
    """The refusal names the bodies of the scene."""
    guide = Flee(enemy="robott")
    with pytest.raises(ConfigError, match=r"flee\.enemy=robott is not the name"):
        guide.aim(seen((0.0, 0.0), robot=(1.0, 0.0)), guide.start(seen((0.0, 0.0))))
    with pytest.raises(ConfigError, match=r"flee\.alarm=.* is above flee\.calm=0\.2"):
        Flee(calm=0.2)
    with pytest.raises(ConfigError, match=r"guide\.place=\[1\.0\] has 1 numbers"):
        read(Seek, {"place": [1.0]}, where="guide")


def test_marching_has_an_end() -> None:
    """It rests, walks for its time, and is done."""
    guide = March(speed=0.1, delay=1.0, duration=2.0)
    memory = guide.start(seen((0.0, 0.0)))
    for time, speed, done in ((0.5, 0.0, None), (2.0, 0.1, None), (3.1, 0.0, True)):
        aim, memory = guide.aim(seen((0.0, 0.0), time), memory)
        assert float(aim.velocity[0]) == speed
        assert guide.finished(memory) is done


def moved(*overrides: str, steps: int = 350) -> dict[str, np.ndarray]:
    """Return how far the objects of a run have moved."""
    world = make([*ALONE, *overrides])
    start = {name: actor.body.read().position for name, actor in world.actors.items()}
    for _ in range(steps):
        world.step()
    out = {name: actor.body.read().position - start[name] for name, actor in world.actors.items()}
    world.close()
    return out


def test_an_object_flees_from_the_robot() -> None:
    """An animal in the scene runs away; one beside it that its folder lets freeze stays."""
    gone = moved(
        "+objects.crab={robot: crab, position: [0.3, 0, 0.029], guide: {guide: flee, alarm: 0.5}}",
        "+objects.still={robot: crab, position: [-0.3, 0.5, 0.029]}",
    )
    assert gone["crab"][0] > 0.2
    assert np.linalg.norm(gone["still"]) < 2e-3


@pytest.mark.thorough
def test_an_object_walks_by_the_gait_that_the_run_names() -> None:
    """Values of the controller are over those of the folder; another one may be named."""
    slow = moved(
        "+objects.crab={robot: crab, position: [0.3, 0, 0.029], "
        "guide: {guide: march, way: 1.5708, speed: 0.3}, controller: {highest: 1.6}}"
    )
    other = moved(
        "+objects.crab={robot: crab, position: [0.3, 0, 0.029], "
        "guide: {guide: march, speed: 0.1}, controller: {controller: cpg, facing: ahead}}"
    )
    assert 0.01 < slow["crab"][1] < 0.14
    assert other["crab"][0] > 0.03


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("robot: crab, guide: flea", "flee"),
        ("robot: crab, guide: {guide: flee, alarmm: 1.0}", "alarm"),
        ("robot: crab, guide: 3", "the name of a guide"),
        ("robot: cube, guide: freeze", "neither the run nor 'cube' names one"),
        ("robot: crab, controller: {highest: -1.0}", "highest"),
    ],
)
def test_wrong_behaviour_is_refused(entry: str, words: str) -> None:
    """Every wrong value is refused with the nearest name or the bounds."""
    overrides = [*ALONE, f"+objects.thing={{{entry}, position: [0.3, 0, 0.05]}}"]
    with pytest.raises(SealsError, match=words):
        make(overrides)
