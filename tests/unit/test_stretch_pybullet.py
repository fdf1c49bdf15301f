"""Steps of PyBullet that are made in one loop are those made one by one, bit for bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.config.compose import compose
from seals.coupling.predicted import PredictedForces
from seals.plugins.backends.pybullet.body import PybulletBody
from seals.run.assembly import build_world
from seals.run.build import build_run
from seals.run.simulation import Record, simulate
from seals.world import World

pytest.importorskip("llvmlite")
pytest.importorskip("pybullet")

HOVER = ("robot=hexacopter", "guide=hover", "initial.drives=carrying")
LAND = ("environment.water_level=null", "environment.ground_level=0")
CASES = {
    "hover": (
        *(*HOVER, "+sensor@sensors.gps=gps", "+sensor@sensors.battery=battery_meter"),
        *("+sensor@sensors.touch=contact", "sensors.imu.position=[0.1,0,0]"),
    ),
    "water": (
        "robot=box",
        "water=fossen",
        "initial.velocity=[0.3,0,-1]",
        "initial.rpy=[0.3,0.2,0]",
    ),
    "ground": ("robot=box", "initial.position=[0,0,0.6]", *LAND),
    "arm": ("robot=aam", "water=fossen", "guide=hover", "initial.position=[0,0,5]"),
}
STEPS = 90


def built(words: tuple[str, ...]) -> World:
    """A world with compiled laws."""
    return build_world(build_run(compose([*words, "backend=pybullet", "backend.compiled=true"])))


def forms(world: World) -> list[Any]:
    """The loops that have been made."""
    laws: Any = world.actors["robot"].compiled
    return [stretch for form in laws._forms.values() for stretch in form.stretches.values()]


def same(one: World, other: World) -> None:
    """State, ledger, readings and commands are equal."""
    a, b = (w.actors["robot"] for w in (one, other))
    np.testing.assert_array_equal(a.ledger.wrenches, b.ledger.wrenches)
    for x, y in zip(a.body.read(), b.body.read(), strict=True):
        np.testing.assert_array_equal(x, y)
    np.testing.assert_array_equal(a.body.contact_wrenches(), b.body.contact_wrenches())
    np.testing.assert_equal(b.readings, a.readings)
    np.testing.assert_equal(b.command, a.command)
    assert one.snapshot().random == other.snapshot().random


@pytest.mark.parametrize("case", CASES)
def test_steps_in_a_loop_are_those_one_by_one(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """In air, through the surface, onto the ground; whatever the parts that they are made in."""
    worlds = [built(CASES[case]) for _ in range(2)]
    for world, part in zip(worlds, (1, 30), strict=True):
        for _ in range(STEPS // part):
            world.advance(part)
        assert forms(world)
    monkeypatch.setattr(PredictedForces, "steps_alone", lambda self: False)
    plain = built(CASES[case])
    plain.advance(STEPS)
    assert not forms(plain)
    for world in worlds:
        same(plain, world)


def recorded(words: tuple[str, ...]) -> Record:
    """Run some steps, and return the record."""
    words = *words, f"time.duration={0.004 * STEPS}", "backend=pybullet", "backend.compiled=true"
    found = simulate(build_run(compose(list(words))))
    assert found.error is None
    return found


@pytest.mark.parametrize("case", ["hover", "ground"])
def test_a_log_of_steps_in_a_loop(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """States, readings, commands and contacts are those of steps one by one, bit for bit."""
    fast = recorded(CASES[case])
    monkeypatch.setattr(PredictedForces, "steps_alone", lambda self: False)
    slow = recorded(CASES[case])
    np.testing.assert_equal(fast.log.columns, slow.log.columns)
    np.testing.assert_equal(fast.log.meta, slow.log.meta)
    np.testing.assert_array_equal(fast.ledger.wrenches, slow.ledger.wrenches)


def test_a_step_that_is_refused_is_taken_back() -> None:
    """A joint that runs into its stop within a step: the engine stands where it did before it."""
    words = (*CASES["arm"][:2], "initial.position=[0,0,5]")
    one, other = built(words), built(words)
    for world, parts in ((one, [1] * 60), (other, [20] * 3)):
        torque = world.actors["robot"].joint_torque
        torque[...] = 0.4
        for part in parts:
            world.advance(part)
    same(one, other)


def test_what_the_engine_raises_is_heard(monkeypatch: pytest.MonkeyPatch) -> None:
    """A call that fails within the loop is told at once, from where it failed, the step undone."""
    world = built(CASES["hover"])
    world.advance(30)
    engine: Any = world.actors["robot"].body
    before = engine.engine.native()
    calls: list[Any] = []

    def failing(body: PybulletBody) -> Any:
        calls.append(body)
        raise ArithmeticError("the engine broke")

    monkeypatch.setattr(PybulletBody, "contacts", failing)
    with pytest.raises(ArithmeticError, match="the engine broke") as told:
        world.advance(30)
    assert told.traceback[-1].name == "failing"
    assert len(calls) == 1
    for old, new in zip(before, engine.engine.native(), strict=True):
        np.testing.assert_array_equal(old, new)


def test_an_interrupt_within_the_loop_comes_through(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever stops a run by its keys is heard."""
    world = built(CASES["hover"])
    world.advance(30)

    def interrupted(body: PybulletBody) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(PybulletBody, "apply_generalised", lambda body, *given: interrupted(body))
    with pytest.raises(KeyboardInterrupt):
        world.advance(30)
