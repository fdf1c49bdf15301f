"""Memory of transitions: returns over several steps, protected demonstrations, sums, advantages."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.learn.replay import Memory, Prioritised, Returns, Sampler, of_episodes
from seals.learn.starts import generator_of

torch = pytest.importorskip("torch")
pytest.importorskip("torchrl")
torch.set_num_threads(1)


def pushed(returns: Returns, *, t: float, reward: float, terminated: bool, truncated: bool) -> Any:
    """Push one step of one environment whose observation is the time before it."""
    return returns.push(
        torch.tensor([[t]]),
        torch.tensor([[t / 10.0]]),
        reward=torch.tensor([reward]),
        terminated=torch.tensor([terminated]),
        truncated=torch.tensor([truncated]),
        final=torch.tensor([[t + 1.0]]),
    )


def test_a_return_over_three_steps() -> None:
    """1 + 0.5 * 2 + 0.25 * 4 = 3, then the value of the fourth state with 0.125."""
    returns = Returns(length=3, gamma=0.5)
    rewards = (1.0, 2.0, 4.0)
    out = [
        pushed(returns, t=t, reward=r, terminated=False, truncated=False)
        for t, r in enumerate(rewards)
    ]
    assert out[:2] == [None, None]
    assert out[2]["observation"].item() == 0.0
    assert out[2]["action"].item() == 0.0
    assert out[2]["reward"].item() == 3.0
    assert out[2]["discount"].item() == 0.125
    assert out[2]["next_observation"].item() == 3.0


@pytest.mark.parametrize(("terminated", "discount"), [(True, 0.0), (False, 0.25)])
def test_a_return_stops_where_the_episode_ends(terminated: bool, discount: float) -> None:
    """After two steps the episode is over: 1 + 0.5 * 2 = 2, and the next reward does not count.

    What was terminated has no future; what was cut off has one, two steps away: 0.5^2.
    """
    returns = Returns(length=3, gamma=0.5)
    pushed(returns, t=0.0, reward=1.0, terminated=False, truncated=False)
    pushed(returns, t=1.0, reward=2.0, terminated=terminated, truncated=not terminated)
    out = pushed(returns, t=100.0, reward=64.0, terminated=False, truncated=False)
    assert out["reward"].item() == 2.0
    assert out["discount"].item() == discount
    # the observation that the episode reached, not the first of the next one
    assert out["next_observation"].item() == 2.0
    # the last step of the episode stands for itself alone
    out = pushed(returns, t=101.0, reward=64.0, terminated=False, truncated=False)
    assert (out["observation"].item(), out["reward"].item()) == (1.0, 2.0)
    assert out["discount"].item() == (0.0 if terminated else 0.5)


def test_environments_end_by_themselves() -> None:
    """The episode of one environment ends, that of its neighbour goes on."""
    returns = Returns(length=2, gamma=0.5)
    nobody = torch.zeros(2, dtype=torch.bool)
    first = torch.tensor([True, False])
    now = torch.zeros(2, 1)
    one = torch.ones(2)
    returns.push(now, now, reward=one, terminated=first, truncated=nobody, final=now + 1)
    out = returns.push(now, now, reward=one, terminated=nobody, truncated=nobody, final=now + 2)
    assert out is not None
    assert out["reward"].tolist() == [1.0, 1.5]
    assert out["discount"].tolist() == [0.0, 0.25]
    assert out["next_observation"].tolist() == [[1.0], [2.0]]


def test_the_single_step_comes_along() -> None:
    """With both, the reward of the step itself stands beside that over several."""
    returns = Returns(length=2, gamma=0.5, both=True)
    pushed(returns, t=0.0, reward=1.0, terminated=False, truncated=False)
    out = pushed(returns, t=1.0, reward=2.0, terminated=False, truncated=False)
    assert (out["reward"].item(), out["step_reward"].item()) == (2.0, 1.0)
    assert (out["discount"].item(), out["step_discount"].item()) == (0.25, 0.5)
    assert (out["next_observation"].item(), out["step_next_observation"].item()) == (2.0, 1.0)


def test_returns_of_whole_episodes() -> None:
    """Two episodes in one table do not run into each other; the end of the second was cut off."""
    columns = {
        "observation": torch.arange(5.0)[:, None],
        "action": torch.zeros(5, 1),
        "reward": torch.tensor([1.0, 1.0, 1.0, 10.0, 10.0]),
        "next_observation": torch.arange(1.0, 6.0)[:, None],
        "terminated": torch.tensor([False, False, True, False, False]),
        "truncated": torch.zeros(5, dtype=torch.bool),
        "episode": torch.tensor([0, 0, 0, 1, 1]),
    }
    found = of_episodes(columns, Returns(length=2, gamma=0.5))
    assert found["reward"].tolist() == [1.5, 1.5, 1.0, 15.0, 10.0]
    assert found["discount"].tolist() == [0.25, 0.0, 0.0, 0.25, 0.5]
    assert found["next_observation"][:, 0].tolist() == [2.0, 3.0, 3.0, 5.0, 5.0]


def advantages(
    reward: Any, value: Any, later: Any, terminated: Any, truncated: Any, decay: float
) -> Any:
    """Advantages and value targets that PPO learns a rollout from, shape (T, N) each; gamma is 0.5.

    Observations are the values of the critic.
    """
    from seals.learn.learner import Spaces
    from seals.plugins.learners.ppo import PPO

    count = reward.shape[1]
    spaces = Spaces(observation_size=1, action_size=1, count=count, pixels=None, names=("v",))
    agent: Any = PPO(gamma=0.5, decay=decay).start(spaces, device="cpu", seed=0)
    agent.critic, agent.inputs = torch.nn.Identity(), lambda seen: seen
    rows = zip(reward, value, later, terminated, truncated, strict=True)
    agent.rollout = [
        {
            "observation": v[:, None],
            "action": torch.zeros(count, 1),
            "reward": r,
            "terminated": ended,
            "truncated": cut,
            "final": after[:, None],
        }
        for r, v, after, ended, cut in rows
    ]
    agent._begin_round()
    return tuple(agent.round[key].reshape(reward.shape) for key in ("advantage", "value_target"))


def test_advantages_by_hand() -> None:
    """Three steps, gamma 0.5, decay 0.5; the second ends the first environment's episode.

    delta = r + 0.5 V' - V with V = 1, V' = 2: 1 everywhere, 0 where it was terminated.
    """
    shape = (3, 2)
    terminated = torch.zeros(shape, dtype=torch.bool)
    terminated[1, 0] = True
    one, never = torch.ones(shape), torch.zeros(shape, dtype=torch.bool)
    found, wanted = advantages(one, one, 2.0 * one, terminated, never, 0.5)
    assert found[:, 0].tolist() == [1.0, 0.0, 1.0]
    assert found[:, 1].tolist() == [1.0 + 0.25 * 1.25, 1.25, 1.0]
    assert torch.equal(wanted, found + 1.0)


def test_advantages_know_cutting_off_from_ending() -> None:
    """A cut-off step is followed by the value it reached, and by nothing of the next episode."""
    cut = torch.tensor([[True], [False]])
    reward, later = torch.tensor([[1.0], [100.0]]), torch.tensor([[4.0], [0.0]])
    found, _ = advantages(reward, torch.zeros(2, 1), later, torch.zeros_like(cut), cut, 1.0)
    assert found[:, 0].tolist() == [3.0, 100.0]


@pytest.mark.parametrize("size", [1, 63, 64, 65, 5000])
def test_priorities_draw_what_cumulative_sums_draw(size: int) -> None:
    """The index is the one at which NumPy's running sum first exceeds the number drawn."""
    rng = np.random.default_rng(size)
    weights = rng.integers(0, 4, size).astype(float)
    weights[size // 2] = 3.0
    sampler = Prioritised(alpha=1.0, beta=1.0, anneal=1, epsilon=0.0, bonus=0.0)
    sampler.allocate(size + 3, "cpu")
    # slots that hold nothing yet must not be drawn, whatever they held before
    sampler.priorities[:] = 7.0
    sampler.priorities[:size] = torch.from_numpy(weights)
    sampler.generator = generator_of(2, "cpu")
    index, weight = sampler.sample(size, 300)
    drawn = torch.rand(300, generator=generator_of(2, "cpu"), dtype=torch.float64).numpy()
    assert (
        index.tolist()
        == np.searchsorted(np.cumsum(weights), drawn * weights.sum(), side="right").tolist()
    )
    assert weight is not None
    share = weights[index.numpy()] / weights.sum()
    assert weight.numpy() == pytest.approx(share.min() / share, rel=1e-6)


def memory_of(*, capacity: int, share: float | None = None) -> Memory:
    """Return an empty memory on the processor."""
    sampler = Sampler(share=share)
    generator = generator_of(1, "cpu")
    return Memory(capacity=capacity, sampler=sampler, device="cpu", generator=generator)


def numbered(first: int, count: int) -> dict[str, Any]:
    """Return rows that carry their number."""
    return {"reward": torch.arange(first, first + count).float()}


def test_demonstrations_are_never_overwritten() -> None:
    """Experience goes round behind them: of 25 rows the last 10 are left, and all 3 before."""
    memory = memory_of(capacity=10)
    memory.protect(numbered(-3, 3))
    for first in range(0, 25, 5):
        memory.add(numbered(first, 5))
    rewards = set(memory.sample(2000)["reward"].tolist())
    assert rewards == {-3.0, -2.0, -1.0, *map(float, range(15, 25))}
    assert (len(memory), memory.protected, memory.experience) == (13, 3, 10)


def test_rows_lie_where_those_of_torchrl_lie() -> None:
    """Without demonstrations the ring is that of TorchRL's buffer, and so is every drawn row."""
    from torchrl.data import LazyTensorStorage, TensorDictReplayBuffer
    from torchrl.data.replay_buffers.samplers import RandomSampler

    memory = memory_of(capacity=12)
    other = TensorDictReplayBuffer(storage=LazyTensorStorage(12), sampler=RandomSampler())
    for first in range(0, 35, 5):
        memory.add(numbered(first, 5))
        other.extend(memory._table(numbered(first, 5)))
        batch = memory.sample(50)
        assert torch.equal(batch["reward"], other[batch["index"]]["reward"])
        assert len(memory) == len(other)


def test_shares_are_kept_in_every_batch() -> None:
    """Half of each batch are demonstrations, be there ever so few."""
    memory = memory_of(capacity=100, share=0.5)
    memory.protect(numbered(-1, 1))
    memory.add(numbered(0, 50))
    for _ in range(5):
        batch = memory.sample(32)
        assert int((batch["reward"] < 0).sum()) == 16
        assert float(memory.share(batch)) == 0.5


def test_a_memory_goes_on_from_its_state() -> None:
    """Rows, place of the next one and draws are the same after a round through the state."""
    memory, other = memory_of(capacity=8), memory_of(capacity=8)
    memory.protect(numbered(-2, 2))
    memory.add(numbered(0, 5))
    other.load(memory.state())
    for each in (memory, other):
        each.add(numbered(5, 5))
    other.sampler.generator.set_state(memory.sampler.generator.get_state())
    assert torch.equal(memory.sample(64)["reward"], other.sample(64)["reward"])
    assert set(other.sample(500)["reward"].tolist()) == {-2.0, -1.0, *map(float, range(2, 10))}


def test_what_does_not_fit_is_refused() -> None:
    """Demonstrations after experience, and more environments than room, are refused in words."""
    memory = memory_of(capacity=4)
    with pytest.raises(ConfigError, match="less than 5 environments"):
        memory.add(numbered(0, 5))
    memory.add(numbered(0, 2))
    with pytest.raises(ConfigError, match="come after experience"):
        memory.protect(numbered(0, 2))
