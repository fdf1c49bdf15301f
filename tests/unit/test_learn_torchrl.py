"""The environments in TorchRL's wrappers and collectors, as their users know them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")
pytest.importorskip("torchrl", reason="learning needs torchrl: pip install 'aam-seals[learn]'")
gymnasium = pytest.importorskip("gymnasium")

from seals.errors import ConfigError, SealsError  # noqa: E402

SHORT = ["task.duration=0.2"]
STEPS = 5
"""Control steps in an episode."""
collecting = pytest.mark.filterwarnings(
    # importing its collectors, TorchRL warns of classes of its own
    "ignore:Creating .*WeightUpdater.* which inherits:DeprecationWarning"
)


def maker() -> Callable[[], Any]:
    """A function that makes four twins behind TorchRL's wrapper in whatever process calls it."""
    words = list(SHORT)

    # inside of another one: a process that is spawned cannot import this file
    def flock() -> Any:
        import gymnasium
        from torchrl.envs import GymWrapper

        import seals.envs  # noqa: F401  makes the ids known in this process

        env = gymnasium.make_vec(
            "SEALS/Hover-v0", 4, vectorization_mode="vector_entry_point", overrides=words
        )
        return GymWrapper(env)

    return flock


def collected(seed: int) -> Any:
    """Two processes of four twins each, ten steps each of random actions."""
    from torchrl.collectors import MultiSyncCollector

    collector = MultiSyncCollector(
        [maker(), maker()], frames_per_batch=80, total_frames=160, cat_results="stack"
    )
    try:
        collector.set_seed(seed)
        return torch.stack([batch.clone() for batch in collector])
    finally:
        collector.shutdown()


def goes_on(batch: Any) -> None:
    """Steps follow one another within an episode, and a new one begins after its last step.

    Args:
        batch: of shape (..., steps).
    """
    seen, reached = batch["observation"], batch["next", "observation"]
    ended = batch["next", "done"][..., :-1, 0]
    assert ended.any()
    apart = (seen[..., 1:, :] - reached[..., :-1, :]).abs().amax(-1)
    assert float(apart[~ended].max()) == 0.0
    # targets are drawn within half a metre: two starts in ten million are alike
    assert float(apart[ended].min()) > 1e-4
    # the last step of an episode reaches what lies beside the one before, not the next start
    moved = (reached[..., :3] - seen[..., :3]).abs().amax(-1)
    assert float(moved.max()) < 0.1


@pytest.mark.parametrize("backend", ["twin", "free"])
def test_an_environment_is_made_by_its_name(backend: str) -> None:
    """The module in the name makes the id known; the engine goes with the overrides."""
    from torchrl.envs import GymEnv
    from torchrl.envs.utils import check_env_specs

    env = GymEnv("seals.envs:SEALS/Hover-v0", overrides=[f"backend={backend}", *SHORT])
    try:
        check_env_specs(env)
        kind = "TwinSimulator" if backend == "twin" else "WorldsInTurn"
        assert type(env._env.unwrapped._batched.simulator).__name__ == kind
        env.set_seed(5)
        first = env.rollout(2 * STEPS, break_when_any_done=False)
        goes_on(first)
        env.set_seed(5)
        assert float((env.reset()["observation"] - first["observation"][0]).abs().max()) == 0.0
    finally:
        env.close()


def test_a_batch_of_twins_is_one_environment_of_many() -> None:
    """Episodes that end begin anew, and their last observation is not lost."""
    env = maker()()
    rollout = env.rollout(2 * STEPS + 2, break_when_any_done=False)
    assert rollout.batch_size == (4, 2 * STEPS + 2)
    at = np.flatnonzero(rollout["next", "done"][0, :, 0].numpy())
    assert at.tolist() == [STEPS - 1, 2 * STEPS - 1]
    goes_on(rollout)
    env.close()


@pytest.mark.thorough
@pytest.mark.parametrize("backend", ["twin", "free"])
def test_a_batch_is_an_environment_of_torchrl_itself(backend: str) -> None:
    """Specs hold; episodes begin anew; steps are those of the vector environment, to the bit."""
    from torchrl.envs.utils import check_env_specs

    from seals.envs import torchrl_env

    words = [f"backend={backend}", *SHORT]
    env = torchrl_env("SEALS/Hover-v0", 3, overrides=words)
    check_env_specs(env)
    env.set_seed(5)
    rollout = env.rollout(2 * STEPS + 2, break_when_any_done=False)
    assert rollout.batch_size == (3, 2 * STEPS + 2)
    at = np.flatnonzero(rollout["next", "done"][0, :, 0].numpy())
    assert at.tolist() == [STEPS - 1, 2 * STEPS - 1]
    goes_on(rollout)
    env.close()
    other = gymnasium.make_vec(
        "SEALS/Hover-v0", 3, vectorization_mode="vector_entry_point", overrides=words
    )
    draws = np.random.default_rng(5).integers(1_000_000_000, size=3)
    seen, _ = other.reset(seed=draws.tolist())
    assert np.array_equal(seen, rollout["observation"][:, 0].numpy())
    for k in range(STEPS):
        _, reward, _, truncated, infos = other.step(rollout["action"][:, k].numpy())
        assert np.array_equal(np.float32(reward), rollout["next", "reward"][:, k, 0].numpy())
    assert truncated.all()
    assert np.array_equal(infos["final_obs"], rollout["next", "observation"][:, STEPS - 1].numpy())
    other.close()


def test_torchrl_s_environment_sees() -> None:
    """With cameras it observes numbers and pictures, as its specs say."""
    from torchrl.envs.utils import check_env_specs

    from seals.learn.environments.torchrl_env import SealsEnvBase

    eyes = [
        f"sensors.{eye}.{side}=16" for eye in ("front", "belly") for side in ("width", "height")
    ]
    env = SealsEnvBase("reach_seen", num_envs=2, overrides=["backend=twin", *SHORT, *eyes])
    check_env_specs(env)
    rollout = env.rollout(STEPS + 2, break_when_any_done=False)
    # three colours of two cameras in three control steps
    assert rollout["pixels"].shape == (2, STEPS + 2, 18, 16, 16)
    assert int(rollout["next", "pixels"].max()) > 0
    env.close()


def test_success_and_single_resets_of_torchrl_s_environment() -> None:
    """What has succeeded says so at its end; what still runs is not reset alone."""
    from seals.envs import torchrl_env

    words = ["backend=twin", "task.ends=true", "task.success_distance=9", "task.duration=1"]
    env = torchrl_env("SEALS/Reach-v0", 2, overrides=words)
    first = env.rollout(20)
    assert first["next", "terminated"][:, -1].all()
    assert first["next", "success"][:, -1].all()
    assert not first["next", "success"][:, :-1].any()
    begun = env.reset()
    begun["_reset"] = torch.tensor([[True], [False]])
    with pytest.raises(SealsError, match="ended are reset alone"):
        env.reset(begun)
    env.close()
    with pytest.raises(ConfigError, match="Did you mean 'SEALS/Reach-v0'"):
        torchrl_env("SEALS/Reach", 2)


@pytest.mark.slow
@collecting
def test_two_processes_collect_from_twins() -> None:
    """160 frames; eight twins in two processes, each from a start of its own."""
    found = collected(3)
    assert found.batch_size == (2, 2, 4, 10)
    goes_on(found)
    starts = found["observation"][0, :, :, 0, :3].reshape(8, 3)
    assert float(torch.pdist(starts).min()) > 1e-4


@pytest.mark.slow
@collecting
def test_what_two_processes_collect_follows_the_seed() -> None:
    """The same seed gives the same frames, another one others."""
    first, again, other = (collected(seed)["observation"] for seed in (3, 3, 4))
    assert torch.equal(first, again)
    assert not torch.equal(first, other)


@pytest.mark.slow
@collecting
def test_two_processes_collect_each_at_its_own_pace() -> None:
    """TorchRL's asynchronous collector takes the batch itself, four twins in each process."""
    from torchrl.collectors import MultiAsyncCollector

    words = list(SHORT)

    def flock() -> Any:
        from seals.envs import torchrl_env

        return torchrl_env("SEALS/Hover-v0", 4, overrides=words)

    collector = MultiAsyncCollector([flock, flock], frames_per_batch=40, total_frames=160)
    try:
        collector.set_seed(3)
        batches = [batch.clone() for batch in collector]
    finally:
        collector.shutdown()
    assert [batch.batch_size for batch in batches] == [(4, 10)] * 4
    for batch in batches:
        goes_on(batch)


@pytest.mark.slow
@collecting
def test_a_process_collects_with_the_weights_that_it_was_sent() -> None:
    """All actions are those of the first weights or of those sent after the first batch."""
    from tensordict.nn import TensorDictModule
    from torchrl.collectors import AsyncCollector

    words = list(SHORT)

    def flock() -> Any:
        from seals.envs import torchrl_env

        return torchrl_env("SEALS/Hover-v0", 4, overrides=words)

    size = flock().observation_spec["observation"].shape[-1]
    network = torch.nn.Linear(size, 3)
    torch.nn.init.zeros_(network.weight)
    torch.nn.init.constant_(network.bias, 0.25)
    collector = AsyncCollector(
        flock,
        TensorDictModule(network, ["observation"], ["action"]),
        frames_per_batch=40,
        total_frames=400,
        auto_register_policy_transforms=False,
    )
    actions = []
    try:
        for batch in collector:
            goes_on(batch)
            actions.append(batch["action"].clone())
            torch.nn.init.constant_(network.bias, -0.5)
            collector.update_policy_weights_()
    finally:
        collector.shutdown()
    assert len(actions) == 10
    assert (actions[0] == 0.25).all()
    assert (actions[-1] == -0.5).all()
    every = torch.stack(actions)
    assert ((every == 0.25) | (every == -0.5)).all()
