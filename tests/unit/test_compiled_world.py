"""Worlds with compiled laws: ledger, motion and sensors are those of NumPy, on both engines."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

from seals.api import make
from seals.errors import ConfigError
from seals.plugins.effects.quadratic_drag import DragQuadratic
from seals.world import World

pytest.importorskip("llvmlite")

BOX = ("robot=box", "water=fossen", "initial.velocity=[0.3,0,-1]", "initial.rpy=[0.3,0.2,0]")
CURRENT = ("+effect@effects.flow=current", "effects.flow.velocity_y=0.4")
SWING = ("experiment=swing", "+effect@effects.wind=wind", "effects.wind.velocity_x=3")
SHORT = {
    "box": ((*BOX, *CURRENT), 120),
    "waves": ((*BOX, "wave=airy", "initial.position=[0,0,0.2]"), 60),
    "swing": (SWING, 40),
}
LONG = {
    "aam": (("robot=aam", "water=fossen", "guide=hover", "initial.position=[0,0,0]"), 150),
    "crab": (("experiment=crab_seabed",), 100),
}


def worlds(engine: str, words: tuple[str, ...]) -> tuple[World, World]:
    """The same world on NumPy and with compiled laws."""
    pytest.importorskip(engine)
    both: Any = [
        make([*words, f"backend={engine}", f"backend.compiled={flag}"])
        for flag in ("false", "true")
    ]
    return both[0], both[1]


def agree(engine: str, words: tuple[str, ...], steps: int, slack: float) -> None:
    """Step both and compare."""
    both = worlds(engine, words)
    for _ in range(steps):
        for world in both:
            world.step()
    one, other = (world.actors["robot"] for world in both)
    scale = np.abs(one.ledger.wrenches).max()
    np.testing.assert_allclose(
        other.ledger.wrenches, one.ledger.wrenches, rtol=0.0, atol=slack * scale
    )
    for x, y in zip(one.body.poses(), other.body.poses(), strict=True):
        np.testing.assert_allclose(y, x, rtol=0.0, atol=slack)
    for name, reading in one.readings.items():
        for channel, values in (reading or {}).items():
            np.testing.assert_allclose(other.readings[name][channel], values, atol=1e-2)
    for world in both:
        world.close()


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
@pytest.mark.parametrize("case", SHORT)
def test_a_compiled_world_is_that_of_numpy(case: str, engine: str) -> None:
    """A falling box through the surface, in a current and in waves; a pendulum in wind."""
    agree(engine, *SHORT[case], slack=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
@pytest.mark.parametrize("case", LONG)
def test_a_compiled_robot_is_that_of_numpy(case: str, engine: str) -> None:
    """The manipulator at the surface, under its controller; a crab that walks on the bottom.

    Contacts multiply rounding, so the bound is wider than for free motion.
    """
    agree(engine, *LONG[case], slack=1e-8)


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_a_compiled_world_continues_bit_for_bit(engine: str) -> None:
    """A snapshot restores the very same motion."""
    _, world = worlds(engine, SHORT["box"][0])
    actor = world.actors["robot"]
    for _ in range(30):
        world.step()
    kept, ends = world.snapshot(), []
    for _ in range(2):
        for _ in range(20):
            world.step()
        ends.append((actor.ledger.wrenches.copy(), actor.body.poses().origins))
        world.restore(kept)
    for a, b in zip(*ends, strict=True):
        assert np.array_equal(a, b)
    world.close()


@pytest.mark.parametrize("choice", ["auto", "true"])
def test_a_law_without_machine_code(choice: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """By default a robot goes on with NumPy, in words; where code was asked for it is refused."""
    pytest.importorskip("mujoco")
    law = DragQuadratic.loads

    def asking(motion: Any, *rest: Any, **more: Any) -> Any:
        assert float(motion.velocity[0, 2]) < 9.0
        return law(motion, *rest, **more)

    def built(how: str) -> World:
        words = ("time.duration=60", "backend=mujoco", f"backend.compiled={how}")
        return make([*BOX, *words])

    monkeypatch.setattr(DragQuadratic, "loads", staticmethod(functools.wraps(law)(asking)))
    world, plain = built(choice), built("false")
    if choice == "true":
        with pytest.raises(ConfigError, match="cannot be compiled"):
            world.step()
        return
    with pytest.warns(UserWarning, match="goes on uncompiled"):
        world.step()
    plain.step()
    for _ in range(5):
        for one in (world, plain):
            one.step()
    both = (w.actors["robot"].ledger.wrenches for w in (world, plain))
    assert np.array_equal(*both)
