"""The coupling calls an engine as the protocol of its bodies promises."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals import registry
from seals.effects.binding import bind_effects
from seals.errors import ConfigError
from seals.learn.environments.facts import Facts
from seals.testing.bodies import moving_arm
from seals.testing.scenes import ENVIRONMENT, start_of
from seals.world import Actor, World

STEP = 0.002
BEFORE = ("set_inertia", "mass_matrix", "apply_wrenches", "set_motors", "apply_joint_forces")
BEFORE += ("add_inertia", "drive_joints")
AFTER = ("state", "motor_forces", "contacts", "shift_base", "set_velocity")


class Recording:
    """An engine's body that writes down the calls that it is given."""

    def __init__(self, body: Any) -> None:
        """Start with an empty list."""
        self.body, self.calls = body, list[str]()

    def __getattr__(self, name: str) -> Any:
        """Return the body's own, and note calls of the protocol."""
        own = getattr(self.body, name)
        if name not in BEFORE + AFTER:
            return own

        def call(*given: Any) -> Any:
            if name == "shift_base":
                assert given[0].shape == (6,)
            self.calls.append(name)
            return own(*given)

        return call


def arm_on(
    backend: str, folder: Path, effects: dict[str, Any], damping: float = 0.0
) -> tuple[World, Actor]:
    """Return an arm in the air that moves; its file states a damping of the joints."""
    engine = registry.get("backend", backend).load()()
    engine.open(ENVIRONMENT, STEP)
    robot, stated = moving_arm(folder), f'<dynamics damping="{damping}"/></joint>'
    file = Path(robot.urdf)
    file.write_text(file.read_text().replace("</joint>", stated))
    still = registry.get("wave", "still").load()()
    bound = bind_effects(effects, robot.links)
    actor = Actor(robot, bound, {}, engine, ENVIRONMENT, waves=still, steps=100)
    world = World(engine, {"arm": actor}, ENVIRONMENT, step=STEP, seed=0)
    world.reset({"arm": start_of(robot, "air", 0)})
    return world, actor


@pytest.mark.parametrize("backend", ["pybullet", "mujoco"])
def test_the_damping_of_a_file_is_not_the_engines(backend: str, tmp_path: Path) -> None:
    """Friction is an effect with a row in the ledger: what an engine adds by itself is nowhere.

    A KUKA arm whose file states 0.5 N m s/rad at each joint flew apart by it at steps of 4 ms.
    """
    found = []
    for damping in (0.0, 0.02):
        world, actor = arm_on(backend, tmp_path, {}, damping)
        for _ in range(50):
            world.step()
        body: Any = actor.body
        found.append(body.read().joint_velocity)
        world.close()
    assert found[1] == pytest.approx(found[0], rel=1e-12)


def test_calls_come_in_the_order_of_the_protocol(tmp_path: Path) -> None:
    """Before the step loads once, after it the state first; a free motion is shifted."""
    gravity = registry.get("effect", "gravity").load()()
    world, actor = arm_on("pybullet", tmp_path, {"gravity": gravity})
    body: Any = actor.body
    engine = body.engine = Recording(body.engine)
    world.step()
    assert engine.calls == [
        "apply_wrenches",
        "apply_joint_forces",
        "contacts",
        "state",
        "shift_base",
        "set_velocity",
    ]
    world.close()


def test_an_engine_that_solves_gets_inertia_and_drives(tmp_path: Path) -> None:
    """Such an engine is given wrenches, added inertia, joint forces and drives, once each."""
    pytest.importorskip("mujoco")
    world, actor = arm_on("mujoco", tmp_path, {})
    body: Any = actor.body
    engine = body.engine = Recording(body.engine)
    world.step()
    assert engine.calls == [
        "apply_wrenches",
        "add_inertia",
        "apply_joint_forces",
        "drive_joints",
        "contacts",
        "state",
        "shift_base",
        "set_velocity",
    ]
    world.close()


def test_velocities_stand_still_without_after_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A backend that forgets `after_step` reports velocities and joints of the start."""
    gravity = registry.get("effect", "gravity").load()()
    world, actor = arm_on("pybullet", tmp_path, {"gravity": gravity})
    body: Any = actor.body
    before = body.read()
    monkeypatch.setattr(body, "after_step", lambda step: None)
    world.step()
    for kept in ("angular_velocity", "joints", "joint_velocity"):
        assert np.array_equal(getattr(body.read(), kept), getattr(before, kept))
    monkeypatch.undo()
    world.step()
    assert (body.read().joints != before.joints).all()
    world.close()


@pytest.mark.parametrize(("backend", "known"), [("pybullet", True), ("free", False)])
def test_power_needs_a_body_with_joint_forces(backend: str, known: bool, tmp_path: Path) -> None:
    """A backend without joint forces is refused in words that say what to take."""
    world, actor = arm_on(backend, tmp_path, {})
    if known:
        facts = Facts(["power"], actor, ENVIRONMENT)
        world.step()
        facts.observe()
        assert facts.now()["power"].shape == (1, 1)
    else:
        with pytest.raises(ConfigError, match="return joint forces, such as backend=pybullet"):
            Facts(["power"], actor, ENVIRONMENT)
    world.close()
