"""Imitation of the scripted policy in the states that the learner reaches."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from seals.errors import ConfigError
from seals.learn.evaluation.policies import policy_of
from seals.learn.learner import Spaces
from seals.learn.policy import save_policy
from seals.learn.training.application import _flight
from seals.learn.training.schedule import TrainingSchedule
from seals.plugins.learners.dagger import Dagger
from tests.unit.test_learn_training import table, training_of

torch = pytest.importorskip("torch")
pytest.importorskip("torchrl")


@pytest.mark.thorough
def test_an_expert_is_imitated_where_the_learner_goes(tmp_path: Path) -> None:
    """Led by the expert at first, the learner reaches the targets alone; without updates none.

    What is remembered are the expert's actions, also where another one was done.
    """
    learner = Dagger(
        hidden=[32, 32], batch=64, ratio=4, capacity=4000, led=20, share=0.25, mean=0.95
    )
    course = TrainingSchedule(
        steps=2400, look_every=1200, log_every=400, episodes=4, checkpoint=0.0
    )
    training = training_of(learner, tmp_path / "a", course=course)
    outcome = training.run()
    rows = table(tmp_path / "a" / "evaluation.csv")
    assert float(rows[0]["success"]) < 0.5
    assert outcome.success == 1.0
    agent: Any = training.agent
    agent.advise(torch.full((4, 3), 0.25))
    done = agent.act(training.environment.reset([0, 1, 2, 3]), explore=True)
    assert (done[0] == 0.25).all()
    assert not (done[3] == 0.25).all()


def test_the_state_holds_the_filled_part_of_the_memory(tmp_path: Path) -> None:
    """It is a copy, it goes back into another agent, and one of another size is refused."""
    learner = Dagger(hidden=[8], batch=8, ratio=1, capacity=400, led=20)
    course = TrainingSchedule(steps=40, look_every=40, log_every=40, episodes=1, checkpoint=0.0)
    training = training_of(learner, tmp_path / "a", course=course)
    training.run()
    agent: Any = training.agent
    state = agent.state()
    kept = state["rows"]["action"]
    assert len(kept) == agent.stored < len(agent.memory["action"])
    agent.memory["action"][0] += 1.0
    assert not torch.equal(kept[0], agent.memory["action"][0])
    spaces: Spaces = agent.spaces
    other: Any = learner.start(spaces, device="cpu", seed=9)
    other.load(state)
    assert torch.equal(other.memory["action"][: other.stored], kept)
    state["rows"]["action"] = kept[:-1]
    with pytest.raises(ValueError, match="numbers of action"):
        other.load(state)


def _eyes(**changes: Any) -> Any:
    """Agent with two numbers and two pictures of 24 x 24 pixels in each of 40 environments."""
    spaces = Spaces(observation_size=2, action_size=1, count=40, pixels=(6, 24, 24))
    own = {"hidden": [16], "batch": 64, "ratio": 1, "capacity": 400, "led": 1}
    learner = Dagger(**own, channels=8, strides=[2, 1], **changes)
    return learner.start(spaces, device="cpu", seed=3)


def test_a_policy_that_sees_imitates_by_pictures_alone() -> None:
    """The expert steers by the side on which a spot is; no number tells it."""
    agent, rng = _eyes(features=8, mean=0.9, learning_rate=3e-3), torch.Generator().manual_seed(1)
    for _ in range(8):
        side = torch.randint(0, 2, (40,), generator=rng)
        pixels = torch.zeros(40, 6, 24, 24, dtype=torch.uint8)
        for k in range(40):
            left = 3 if side[k] else 15
            pixels[k, :3, 8:14, left : left + 6] = 255
        seen = {"state": torch.zeros(40, 2), "pixels": pixels}
        wanted = (2.0 * side[:, None] - 1.0) * 0.8
        agent.advise(wanted)
        agent.observe(seen, wanted, None)
    for _ in range(250):
        agent.update()
    done = agent.act(seen, explore=False)
    assert (done - wanted).abs().mean() < 0.1
    hidden = {**seen, "pixels": torch.zeros_like(pixels)}
    assert (agent.act(hidden, explore=False) - wanted).abs().mean() > 0.5
    other = _eyes(features=8, mean=0.9)
    other.load(agent.state())
    assert torch.equal(other.act(seen, explore=False), done)


def test_experts_and_learners_take_turns() -> None:
    """Who acts stays as it is by default; with turns each environment changes about that often."""
    fixed, turning = _eyes(share=0.3), _eyes(share=0.3, turn=5)
    first, changed, led = turning.led.clone(), 0, 0
    for _ in range(200):
        before = turning.led.clone()
        fixed._take_turns()
        turning._take_turns()
        changed += int((turning.led != before).sum())
        led += int(turning.led.sum())
    assert torch.equal(fixed.led, first)
    assert int(first.sum()) == 12
    # 8,000 draws of one in five, of which 2 x 0.3 x 0.7 change hands; standard error 3 and 1 %
    assert changed / 8000 == pytest.approx(0.2 * 0.42, rel=0.15)
    assert led / 8000 == pytest.approx(0.3, rel=0.15)


def test_a_policy_that_sees_is_refused_where_there_are_no_pictures(tmp_path: Path) -> None:
    """In words, and the command that ends a training stays with the twins, which have them."""
    network, tensors = _eyes().policy()
    save_policy(tmp_path / "policy", network=network, tensors=tensors, metadata={})
    blind: Any = SimpleNamespace(observation_size=2, action_size=1, pixels=None)
    with pytest.raises(ConfigError, match=r"pictures of \(6, 24, 24\).*has none") as told:
        policy_of(str(tmp_path / "policy"), blind, device="cpu")
    assert "backend=twin" in str(told.value)
    seeing: Any = SimpleNamespace(observation_size=2, action_size=1, pixels=(6, 24, 24))
    assert policy_of(str(tmp_path / "policy"), seeing, device="cpu")
    config = SimpleNamespace(backend={"interval": 10})
    assert "backend=twin" in _flight(config, tmp_path, ["env=pipe_seen"])
