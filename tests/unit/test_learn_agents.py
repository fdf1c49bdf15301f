"""Environments in the hands of other learners: Stable-Baselines3, PettingZoo, loops of one file."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.envs import parallel_env, vec_env
from seals.errors import ConfigError

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")
gymnasium = pytest.importorskip("gymnasium")

SHORT = ["task.duration=0.2"]
STEPS = 5
"""Control steps in an episode."""


def batch(count: int = 4) -> Any:
    """Twins of short episodes as a vector environment of Gymnasium."""
    mode = "vector_entry_point"
    return gymnasium.make_vec("SEALS/Hover-v0", count, vectorization_mode=mode, overrides=SHORT)


@pytest.mark.thorough
def test_stable_baselines_sees_what_the_batch_sees() -> None:
    """The same seeds and actions give the same numbers; the last observation is not lost."""
    pytest.importorskip("stable_baselines3", reason="needs aam-seals[agents]")
    ours, plain = vec_env("SEALS/Hover-v0", 4, overrides=SHORT), batch()
    ours.seed(7)
    first = ours.reset()
    np.testing.assert_array_equal(first, plain.reset(seed=[7, 8, 9, 10])[0])
    rng, total = np.random.default_rng(0), np.zeros(4)
    for k in range(1, STEPS + 1):
        action = rng.uniform(-1.0, 1.0, (4, 3)).astype(np.float32)
        seen, reward, ended, infos = ours.step(action)
        _, wanted, _, truncated, facts = plain.step(action)
        np.testing.assert_allclose(reward, wanted, rtol=1e-6)
        total += wanted
        assert ended.tolist() == [k == STEPS] * 4
    assert truncated.all()
    for k, info in enumerate(infos):
        np.testing.assert_array_equal(info["terminal_observation"], facts["final_obs"][k])
        assert np.abs(info["terminal_observation"] - seen[k]).max() > 1e-4
        assert info["TimeLimit.truncated"]
        assert info["episode"]["l"] == STEPS
        assert info["episode"]["r"] == pytest.approx(total[k], rel=1e-6)
    ours.close()


@pytest.mark.thorough
def test_stable_baselines_trains_on_a_batch() -> None:
    """PPO takes 256 steps of eight twins, counts their episodes and changes its policy."""
    sb3 = pytest.importorskip("stable_baselines3", reason="needs aam-seals[agents]")
    env = vec_env("SEALS/Hover-v0", 8, overrides=SHORT)
    model = sb3.PPO("MlpPolicy", env, n_steps=16, batch_size=64, n_epochs=2, seed=1, device="cpu")
    before = [p.detach().clone() for p in model.policy.parameters()]
    model.learn(256)
    assert model.num_timesteps == 256
    assert len(model.ep_info_buffer) == 8 * (256 // 8 // STEPS)
    after = list(model.policy.parameters())
    assert all(bool((a != b).any()) for a, b in zip(before, after, strict=True))
    env.close()


@pytest.mark.thorough
def test_stable_baselines_normalises_a_batch() -> None:
    """VecNormalize keeps running statistics of the batch, and its checker has nothing to say."""
    pytest.importorskip("stable_baselines3", reason="needs aam-seals[agents]")
    from stable_baselines3.common.env_checker import check_env
    from stable_baselines3.common.vec_env import VecNormalize

    env = VecNormalize(vec_env("SEALS/Hover-v0", 4, overrides=SHORT), clip_obs=5.0)
    env.seed(7)
    seen, rng = env.reset(), np.random.default_rng(0)
    plain = [env.get_original_obs()]
    for _ in range(3 * STEPS):
        seen, *_ = env.step(rng.uniform(-1.0, 1.0, (4, 3)).astype(np.float32))
        plain.append(env.get_original_obs())
    assert np.abs(seen).max() <= 5.0
    # its mean begins with the weight of a ten-thousandth of an observation
    np.testing.assert_allclose(env.obs_rms.mean, np.mean(plain, axis=(0, 1)), rtol=1e-5, atol=1e-5)
    env.close()
    one = gymnasium.make("SEALS/Hover-v0", overrides=["backend=twin", *SHORT]).unwrapped
    check_env(one)
    one.close()


def test_skrl_trains_on_a_batch(tmp_path: Any) -> None:
    """Its own PPO, memory and trainer, on the vector environment as it is."""
    pytest.importorskip("skrl", reason="needs skrl: pip install skrl")
    from skrl.agents.torch.ppo import PPO, PPO_CFG
    from skrl.envs.wrappers.torch import wrap_env
    from skrl.memories.torch import RandomMemory
    from skrl.trainers.torch import SequentialTrainer
    from skrl.utils.model_instantiators.torch import deterministic_model, gaussian_model

    made = gymnasium.make_vec(
        "SEALS/Hover-v0", 8, vectorization_mode="vector_entry_point", overrides=SHORT
    )
    env = wrap_env(made, verbose=False)
    spaces = {"observation_space": env.observation_space, "action_space": env.action_space}
    layers = [{"name": "net", "input": "OBSERVATIONS", "layers": [16], "activations": "elu"}]
    models = {
        "policy": gaussian_model(**spaces, device="cpu", network=layers, output="ACTIONS"),
        "value": deterministic_model(**spaces, device="cpu", network=layers, output="ONE"),
    }
    agent = PPO(
        models=models,
        memory=RandomMemory(memory_size=16, num_envs=8, device="cpu"),
        cfg=PPO_CFG(rollouts=16, experiment={"directory": str(tmp_path), "write_interval": 0}),
        device="cpu",
        **spaces,
    )
    course = {"timesteps": 32, "headless": True, "close_environment_at_exit": False}
    SequentialTrainer(env=env, agents=agent, cfg=course).train()
    env.close()
    # two rounds of updates have moved the deviations, which begin at one
    assert bool((models["policy"].log_std_parameter != 0.0).all())


@pytest.mark.thorough
def test_processes_that_are_spawned_step_what_this_one_does() -> None:
    """Gymnasium's vectors by processes know the id from its specification alone."""
    found = []
    for mode, kwargs in (("sync", {}), ("async", {"context": "spawn"})):
        words = ["backend=twin", *SHORT]
        envs = gymnasium.make_vec(
            "SEALS/Hover-v0", 2, vectorization_mode=mode, vector_kwargs=kwargs, overrides=words
        )
        first, _ = envs.reset(seed=3)
        found.append((first, *envs.step(np.full((2, 3), 0.5, dtype=np.float32))[:2]))
        envs.close()
    for here, there in zip(*found, strict=True):
        np.testing.assert_array_equal(here, there)


@pytest.mark.slow
def test_hindsight_replay_learns_from_goals() -> None:
    """SAC with HER on Reach: replaced goals are rewarded where the true ones were missed."""
    sb3 = pytest.importorskip("stable_baselines3", reason="needs aam-seals[agents]")
    env = gymnasium.make("SEALS/ReachGoal-v0", overrides=["backend=twin", "task.duration=0.8"])
    model = sb3.SAC(
        "MultiInputPolicy",
        env,
        replay_buffer_class=sb3.HerReplayBuffer,
        learning_starts=60,
        batch_size=16,
        train_freq=20,
        gradient_steps=2,
        policy_kwargs={"net_arch": [16]},
        seed=1,
        device="cpu",
    )
    model.learn(300)
    buffer: Any = model.replay_buffer
    # no flight from the air has come to a target under water within a second
    assert (buffer.rewards[:300] == -1.0).all()
    drawn = buffer.sample(256).rewards
    assert set(drawn.unique().tolist()) == {-1.0, 0.0}
    env.close()


@pytest.mark.parametrize("backend", ["twin", "free"])
def test_rewards_of_goals_are_computed_for_many_at_once(backend: str) -> None:
    """The reward of a step is that of its goals; many rows give what each gives alone."""
    env = gymnasium.make(
        "SEALS/ReachGoal-v0", overrides=[f"backend={backend}", *SHORT], disable_env_checker=True
    ).unwrapped
    seen, _ = env.reset(seed=2)
    goals, ended = [seen], False
    while not ended:
        seen, reward, _, ended, facts = env.step(np.array([0.1, 0.0, -1.0], dtype=np.float32))
        away = float(np.linalg.norm(seen["achieved_goal"] - seen["desired_goal"]))
        # the episode's own distance, and not that of the next start
        assert away == pytest.approx(facts["distance"], abs=1e-5)
        assert reward == env.compute_reward(seen["achieved_goal"], seen["desired_goal"], {})
        assert env.observation_space.contains(seen)
        goals.append(seen)
    hand = np.stack([g["achieved_goal"] for g in goals])
    assert np.abs(np.diff(hand, axis=0)).max() > 1e-4
    wanted = hand + np.linspace(0.0, 0.1, len(hand))[:, None] * [1.0, 0.0, 0.0]
    np.testing.assert_array_equal(
        env.compute_reward(hand, wanted, None), [0.0, 0.0, 0.0, -1.0, -1.0, -1.0]
    )
    env.close()


def test_a_loop_of_one_file_runs_on_the_batch() -> None:
    """Statistics of episodes by Gymnasium's wrapper, and the marks of ends."""
    env = gymnasium.wrappers.vector.RecordEpisodeStatistics(batch())
    seen, _ = env.reset(seed=1)
    policy = torch.nn.Linear(seen.shape[1], 3)
    returns, lengths = [], []
    for _ in range(2 * STEPS):
        with torch.no_grad():
            action = torch.tanh(policy(torch.as_tensor(seen))).numpy()
        seen, reward, terminated, truncated, infos = env.step(action)
        ended = terminated | truncated
        if ended.any():
            assert (infos["_final_obs"] == ended).all()
            lengths += infos["episode"]["l"][ended].tolist()
            returns += infos["episode"]["r"][ended].tolist()
        assert reward.shape == (4,)
    assert lengths == [STEPS] * 8
    assert len(set(returns)) == 8
    env.close()


@pytest.mark.thorough
@pytest.mark.filterwarnings(
    # importing its tests, PettingZoo makes an environment of its own the former way
    "ignore:The old environment creation API:DeprecationWarning"
)
def test_diver_and_crab_are_two_agents() -> None:
    """PettingZoo's own test passes; the crab goes where it is told, and loses what is won."""
    pytest.importorskip("pettingzoo", reason="needs aam-seals[agents]")
    pytest.importorskip("pybullet", reason="a crab in the hand needs contacts")
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    def pair() -> Any:
        return parallel_env("catch", overrides=["task.duration=0.5", "backend=pybullet"])

    parallel_seed_test(pair, num_cycles=5)
    env = parallel_env("catch", overrides=["task.duration=0.5", "backend=pybullet"])
    parallel_api_test(env, num_cycles=7)
    seen, _ = env.reset(seed=3)
    again, _ = env.reset(seed=3)
    np.testing.assert_array_equal(seen["crab"], again["crab"])
    before, still = env._inner.now.target[0].copy(), np.zeros(4, dtype=np.float32)
    while env.agents:
        east = np.array([1.0, 0.0], dtype=np.float32)
        _, reward, _, ended, _ = env.step({"robot": still, "crab": east})
        assert reward["crab"] == -reward["robot"]
    assert ended == {"robot": True, "crab": True}
    way = env._inner.now.target[0] - before
    # half a second at 0.1 m/s, of which the gait needs some to begin
    assert 0.01 < way[0] < 0.06
    assert abs(way[1]) < 0.5 * way[0]
    env.close()


def test_a_task_without_an_object_has_no_second_agent() -> None:
    """The words say which has one."""
    pytest.importorskip("pettingzoo", reason="needs aam-seals[agents]")
    with pytest.raises(ConfigError, match="Choose env=catch"):
        parallel_env("reach", overrides=["backend=free"])
