"""Imitation of the scripted policy in the states that the learner reaches."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from seals.learn.learner import Spaces
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
