"""Divers and animals in one batch of worlds, on Warp's processor, against MuJoCo's worlds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.config.compose import compose
from seals.errors import ConfigError
from seals.learn.environments.batch import Environments
from seals.learn.environments.build import build_learning
from seals.learn.environments.warp_worlds import DivingWorlds
from seals.learn.environments.world import FullWorld, WorldsInTurn

torch = pytest.importorskip("torch")
pytest.importorskip("mujoco_warp")

SEEDS = (5, 6)
LOW = ("task.start_low=[0.1,0.0,-0.35]", "task.start_high=[0.1,0.0,-0.35]")
NEAR = ("task.target_low=[0.2,0.05,0.0]", "task.target_high=[0.3,0.05,0.0]")


def run(*words: str) -> tuple[Any, Any]:
    """Return run and task of a diver that starts in the water above a fleeing crab."""
    return build_learning(
        compose(
            [
                "env=catch_fleeing",
                "initial.drives=rest",
                "objects.crab.guide.alarm=0.8",
                *LOW,
                *NEAR,
                *words,
            ],
            root="learn",
        )
    )


@pytest.fixture(scope="module")
def divers() -> Environments:
    """Return one batch for all tests: it is compiled once."""
    settings, task = run("backend=mujoco_warp")
    worlds = DivingWorlds(settings, task, count=2, device="cpu")
    return Environments(worlds, task, count=2, device="cpu", seed=1)


def test_a_chase_is_that_of_mujoco(divers: Environments) -> None:
    """After 1 s both places are those of MuJoCo's world, and so is what the hand observes.

    The controllers of a batch know the centre of gravity of the held posture, not that of the arm
    as it bends: the diver is 5 mm off after a way of 0.1 m, the animal 2 mm.
    """
    own = ("backend=mujoco", "backend.compiled=false", "backend.second_order=false")
    settings, task = run(*own)
    one = WorldsInTurn([FullWorld(settings, task)])
    world = Environments(one, task, count=1, device="cpu", renew=False)
    divers.reset(SEEDS)
    world.reset(SEEDS[:1])
    first = world.now.target.copy()
    for _ in range(10):
        action = divers.scripted_policy()
        divers.step(action)
        world.step(action[:1])
    now, other = divers.now, world.now
    assert np.linalg.norm(other.target - first) > 0.04
    for name, close in (("position", 8e-3), ("tool", 0.02), ("target", 4e-3)):
        found, told = getattr(now, name)[0].numpy(), getattr(other, name)[0]
        np.testing.assert_allclose(found, told, atol=close, err_msg=name)
    for name in ("grip", "closed", "touch", "level"):
        found, told = now.facts[name][0].numpy(), other.facts[name][0]
        np.testing.assert_allclose(found, told, atol=5e-3, err_msg=name)
    assert float(now.submersion.min()) == pytest.approx(float(other.submersion[0, 0]), abs=1e-3)
    world.close()


def test_a_snapshot_goes_on_as_before(divers: Environments) -> None:
    """A step after a snapshot is put back is the same step, bit for bit."""
    divers.reset(SEEDS)
    action = torch.tensor([[0.3, -0.2, 0.1, 1.0], [-0.5, 0.4, 0.2, 1.0]])
    divers.step(action)
    kept = divers.snapshot()
    first = divers.step(action).observation.clone()
    divers.step(-action)
    divers.restore(kept)
    assert torch.equal(divers.step(action).observation, first)


def test_a_hand_closes_by_its_action(divers: Environments) -> None:
    """Half a second at full rate closes half of the hand, in command and in the fingers."""
    divers.reset(SEEDS)
    close = torch.tensor([[0.0, 0.0, 0.5, 1.0]] * 2)
    for _ in range(5):
        divers.step(close)
    np.testing.assert_allclose(divers.now.facts["grip"].numpy(), 0.5, atol=1e-6)
    np.testing.assert_allclose(divers.now.facts["closed"].numpy(), 0.5, atol=0.05)


def test_an_episode_that_begins_anew_begins_with_an_open_hand(divers: Environments) -> None:
    """What the first observation tells of the hand is of the new episode, not of the last one."""
    divers.reset(SEEDS)
    close = torch.tensor([[0.0, 0.0, 0.5, 1.0]] * 2)
    for _ in range(3):
        divers.step(close)
    # beyond all distances the flight is lost
    divers.simulator.worlds.engine.position[0, 0] = 2e3  # type: ignore[attr-defined]
    assert divers.step(close).terminated.tolist() == [True, False]
    assert divers.now.facts["grip"][:, 0].tolist() == pytest.approx([0.0, 0.4])


def test_what_a_batch_has_not_is_refused_in_words() -> None:
    """Further objects, and behaviours without a form over a batch."""

    def built(*words: str) -> None:
        composed = compose(["env=catch_still", "backend=mujoco_warp", *words], root="learn")
        DivingWorlds(*build_learning(composed), count=1, device="cpu")

    for words, said in (
        (("+objects.ball={robot: ball}",), "further objects: ball"),
        (("backend.slope=0.1",), "a slope"),
        (("+objects.crab.guide=march",), "March has no batched form"),
    ):
        with pytest.raises(ConfigError, match=said):
            built(*words)
