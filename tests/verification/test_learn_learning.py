"""Learners learn: fixed points that are known in closed form, and a task that is small enough."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from seals.learn.batched import StepResult
from seals.learn.learner import Spaces
from seals.learn.training.loop import Outcome, Training
from seals.learn.training.schedule import TrainingSchedule
from seals.plugins.learners.bc import BC
from seals.plugins.learners.ppo import PPO
from seals.plugins.learners.sac import SAC
from seals.testing.reaching import PointReach, demonstrations

torch = pytest.importorskip("torch")
pytest.importorskip("torchrl")
torch.set_num_threads(1)

SHOWN: dict[str, Any] = {"demonstrations": "buffer"}
SMALL: dict[str, Any] = {
    "hidden": [64, 64],
    "learning_rate": 1e-3,
    "gamma": 0.95,
    "batch": 128,
    "random_steps": 500,
}


class Bandit:
    """One state, one number to choose, reward 1 - steep (a - 0.5)^2, in episodes of some steps.

    Args:
        cut: whether an episode is cut off rather than over.
        length: of an episode.
        steep: how much the choice matters.
    """

    count, observation_size, action_size, pixels, device = 8, 1, 1, None, "cpu"

    def __init__(self, *, cut: bool, length: int = 1, steep: float = 0.0) -> None:
        self.cut, self.length, self.steep, self.age = cut, length, steep, 0

    def reset(self, seeds: Any = None) -> Any:
        """Begin."""
        self.age = 0
        return torch.ones(self.count, 1)

    def step(self, action: Any) -> StepResult:
        """Pay and end, or not."""
        self.age += 1
        over = torch.full((self.count,), self.age >= self.length)
        self.age = 0 if self.age >= self.length else self.age
        here = torch.ones(self.count, 1)
        never = torch.zeros_like(over)
        return StepResult(
            observation=here,
            reward=1.0 - self.steep * (action[:, 0] - 0.5).square(),
            terminated=never if self.cut else over,
            truncated=over if self.cut else never,
            final=here,
            success=never,
            facts={},
        )


def practised(environment: Bandit, *, steps: int, temperature: float) -> Any:
    """Let SAC practise and return the agent."""
    learner = SAC(
        hidden=[32],
        learning_rate=3e-3,
        gamma=0.5,
        tau=0.05,
        batch=64,
        random_steps=100,
        temperature=temperature,
        entropy=-3.0,
        steps=steps,
        normalise=False,
    )
    spaces = Spaces(observation_size=1, action_size=1, count=environment.count)
    agent = learner.start(spaces, device="cpu", seed=0)
    observation = environment.reset()
    for _ in range(250):
        action = agent.act(observation, explore=True)
        agent.observe(observation, action, environment.step(action))
        for _ in range(agent.due()):
            agent.update()
    return agent


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("cut", "length", "steps", "value"),
    [
        # it is over: the reward alone
        pytest.param(False, 1, 1, 1.0, marks=pytest.mark.slow),
        (False, 1, 3, 1.0),
        # cut off, the state would have gone on for ever: 1 / (1 - 0.5)
        pytest.param(True, 1, 1, 2.0, marks=pytest.mark.slow),
        pytest.param(True, 1, 3, 2.0, marks=pytest.mark.slow),
        (True, 7, 3, 2.0),
        # never cut off: the same
        (False, 10**9, 3, 2.0),
    ],
)
def test_values_are_those_of_the_closed_form(
    cut: bool, length: int, steps: int, value: float
) -> None:
    """A reward of 1 is worth 1 where all ends with it, and 1 / (1 - gamma) = 2 where it goes on."""
    # a bonus for entropy would be worth something, too
    agent = practised(Bandit(cut=cut, length=length), steps=steps, temperature=1e-4)
    found = agent.nets.values(torch.ones(3, 1), torch.tensor([[-0.9], [0.0], [0.9]]))
    assert found.detach().mean().item() == pytest.approx(value, abs=0.05)


def test_the_best_choice_is_found() -> None:
    """The parabola's top is at 0.5, where the reward is 1."""
    agent = practised(Bandit(cut=False, steep=2.0), steps=1, temperature=0.1)
    here = torch.ones(8, 1)
    assert agent.act(here, explore=False)[0].item() == pytest.approx(0.5, abs=0.1)
    value = agent.nets.values(torch.ones(1, 1), torch.tensor([[0.5]]))
    assert value.detach().mean().item() == pytest.approx(1.0, abs=0.1)


def trained(
    learner: Any, folder: Path, *, steps: int, count: int, shown: int = 0, seed: int = 0
) -> Outcome:
    """Train among points that are to reach others, and judge by 50 starts."""
    spaces = Spaces(observation_size=6, action_size=3, count=count)
    agent = learner.start(spaces, device="cpu", seed=seed)
    if shown:
        agent.add_demonstrations(demonstrations(shown))
    every = max(steps, 1)
    course = TrainingSchedule(
        steps=steps, look_every=every, log_every=every, episodes=50, checkpoint=0.0
    )
    return Training(
        PointReach(count), agent, course=course, folder=folder, eval_env=PointReach(50)
    ).run()


@pytest.mark.slow
def test_cloning_learns_from_many_demonstrations(tmp_path: Path) -> None:
    """From 150 demonstrations a clone reaches at least half of new targets; from none it cannot."""
    outcome = trained(BC(hidden=[128, 128], updates=3000), tmp_path, steps=0, count=1, shown=150)
    assert outcome.success is not None
    assert outcome.success > 0.5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("learner", "steps", "count", "shown"),
    [
        (SAC(**SMALL), 6000, 1, 0),
        (SAC(**SMALL, steps=3), 8000, 8, 0),
        (SAC(**SMALL, **SHOWN), 6000, 8, 10),
        # demonstrations hold few of the starts: what is learned from them alone must be unlearned
        (SAC(**SMALL, **SHOWN, steps=3, alpha=0.6, one_step=1.0, pretrain=500), 12_000, 8, 10),
        # half of every batch needs more than a few of them
        (SAC(**SMALL, **SHOWN, layer_norm=True, share=0.5, subset=2), 12_000, 8, 100),
        (PPO(learning_rate=1e-3, gamma=0.95), 250_000, 64, 0),
    ],
    ids=["sac", "sac-3-steps", "sac-shown", "sacfd", "rlpd", "ppo"],
)
def test_a_small_task_is_learned(
    learner: Any, steps: int, count: int, shown: int, tmp_path: Path
) -> None:
    """At least 45 of 50 new targets by the middle of three seeds; untrained almost none."""
    found = []
    for seed in range(3):
        folder = tmp_path / str(seed)
        outcome = trained(learner, folder, steps=steps, count=count, shown=shown, seed=seed)
        first = (folder / "evaluation.csv").read_text().splitlines()[1]
        assert float(first.split(",")[4]) <= 0.1
        assert outcome.success is not None
        found.append(outcome.success)
    assert sorted(found)[1] >= 0.9
