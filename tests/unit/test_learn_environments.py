"""Environments of learning: seeds, episodes, success, rewards, Gymnasium, snapshots."""

from __future__ import annotations

import gc
import itertools
import weakref
from typing import Any

import numpy as np
import pytest

from seals.config.compose import compose
from seals.errors import ConfigError
from seals.learn.environments.build import build_learning
from seals.learn.environments.episodes import Episodes
from seals.learn.environments.world import FullWorld
from seals.learn.task import Instant
from seals.plugins.tasks.observation import observation_of, quaternion
from seals.plugins.tasks.reach import TaskReach
from seals.plugins.tasks.rewards import Reward, near, paper_reward

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")

SHORT = ["task.duration=0.4"]


def _twins(count: int, *words: str, **more: Any) -> Any:
    from seals.learn.environments import batched_of

    return batched_of(compose([*SHORT, *words], root="learn"), count=count, **more)


def _instant(distance: float, *, time: float = 0.04, action: float = 0.0) -> Instant:
    """A robot at rest at a distance from its target."""
    row = np.zeros((1, 3))
    one = np.ones((1, 1))
    target = np.array([[distance, 0.0, 0.0]])
    turn = np.eye(3)[None]
    return Instant(
        one * time, row, turn, row, row, row, target, row, 0.0 * one, row + action, one, {}
    )


def test_the_paper_reward_has_its_three_regions() -> None:
    """exp(-d), 1/d and 1000/d_t, with the penalties for haste and for leaving."""
    far, inner, at = np.array([2.0]), np.array([0.25]), np.array([0.005])
    calm, new = np.array([0.1]), np.zeros((1, 2))
    settings: Any = {"close": 0.01, "fastest": 1.5, "patience": 5.0}
    assert paper_reward(far, calm, new, **settings)[0] == pytest.approx(np.exp(-2.0))
    assert paper_reward(inner, calm, new, **settings)[0] == pytest.approx(4.0)
    reward, memory = paper_reward(at, calm, new, **settings)
    assert reward == pytest.approx(1e5)
    assert paper_reward(far, np.array([2.0]), new, **settings)[0] == pytest.approx(
        np.exp(-2.0) - 5.0
    )
    left, _ = paper_reward(inner, calm, memory, **settings)
    assert left == pytest.approx(4.0 - 1e5)
    for _ in range(7):
        _, memory = paper_reward(at, calm, memory, **settings)
    stayed, _ = paper_reward(inner, calm, memory, **settings)
    assert stayed == pytest.approx(4.0)


def test_the_shaped_reward_is_bounded_and_best_at_the_target() -> None:
    """It falls with the distance, and the bonus is one at the target."""
    task = TaskReach()
    still = np.zeros((1, 2))
    rewards = [task.reward(_instant(d), _instant(d), still)[0][0] for d in (0.0, 0.05, 0.5, 3.0)]
    assert rewards[0] == pytest.approx(1.0)
    assert rewards[1] == pytest.approx(np.exp(-0.25) - 0.05)
    assert rewards[3] == pytest.approx(-3.0)
    assert sorted(rewards, reverse=True) == rewards
    jerk = task.reward(_instant(0.5, action=1.0), _instant(0.5, action=-1.0), still)[0][0]
    assert jerk == pytest.approx(rewards[2] - 0.1 * np.sqrt(12.0))
    assert near(np.array([0.1]), 0.1) == pytest.approx(np.exp(-1.0))


def test_progress_sums_to_the_way_gained() -> None:
    """Without bonus and cost the rewards of a way add up to the distance gained, times the rate."""
    task = TaskReach(reward_form=Reward.progress, bonus=0.0, smooth=0.0)
    way = [1.0, 0.7, 0.9, 0.2]
    total = sum(
        task.reward(_instant(b), _instant(a), np.zeros((1, 2)))[0][0]
        for a, b in itertools.pairwise(way)
    )
    assert total == pytest.approx(25.0 * 0.8)


def _leaning(angle: float) -> Instant:
    """A body that leans about y, its hand 0.5 m below it, the target under the level body."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]])
    row, one = np.zeros((1, 3)), np.ones((1, 1))
    hand = np.array([[-0.5 * s, 0.0, -0.5 * c]])
    target = np.array([[0.0, 0.0, -0.5]])
    return Instant(one, row, turn, row, row, hand, target, row, 0.0 * one, row, one, {})


def test_a_lean_is_seen_apart_from_the_way_and_costs_either_way() -> None:
    """A body above the target is where it should be; a hand leaned to the target is not."""
    task, still = TaskReach(), np.zeros((1, 2))
    level, leaning = _leaning(0.0), _leaning(0.6)
    assert task.distance(level)[0] == pytest.approx(0.0)
    assert task.distance(leaning)[0] == pytest.approx(2.0 * 0.5 * np.sin(0.3))
    assert np.allclose(task.way(leaning), 0.0)
    assert np.allclose(task.observation(leaning)[0, :3], 0.0)
    assert np.allclose(task.scripted_policy(leaning), 0.0)
    away = 2.0 * 0.5 * np.sin(0.3)
    assert task.reward(level, level, still)[0][0] == pytest.approx(1.0)
    assert task.reward(leaning, leaning, still)[0][0] == pytest.approx(
        np.exp(-((away / 0.1) ** 2)) - away
    )
    leaned_to = leaning._replace(target=leaning.tool)
    assert task.distance(leaned_to)[0] == pytest.approx(0.0)
    assert np.allclose(
        task.reward(leaned_to, leaned_to, still)[0], task.reward(leaning, leaning, still)[0]
    )


def test_a_shuffled_target_tells_nothing_and_stays() -> None:
    """What is shown lies in the box, does not follow the target, and is the same every time."""
    task, rng = TaskReach(shuffled=True), np.random.default_rng(3)
    target = task.draw(rng, 2000).goal
    now = _instant(0.0)
    wide = now._replace(
        **{
            name: np.repeat(value, 2000, axis=0)
            for name, value in now._asdict().items()
            if name != "facts"
        }
    )
    shown = task.observation(wide._replace(target=target))[:, :3]
    assert (shown >= task.target_low).all()
    assert (shown <= task.target_high).all()
    pairs = np.corrcoef(shown.T, target.T)[:3, 3:]
    assert np.abs(pairs).max() < 4.0 / np.sqrt(2000.0)
    assert np.array_equal(shown, task.observation(wide._replace(target=target))[:, :3])


def test_success_must_be_held() -> None:
    """Five control steps within the distance count, four do not, and a break starts anew."""
    episodes = Episodes(TaskReach())
    ledger = episodes.start(_instant(1.0))
    wins = []
    for d in [0.04] * 4 + [0.06] + [0.015] * 5 + [1.0]:
        verdict, ledger = episodes.assess(_instant(d), _instant(d), ledger)
        wins.append((bool(verdict.success[0]), float(verdict.facts["success_1cm"][0])))
    assert [w for w, _ in wins] == [False] * 9 + [True, True]
    assert {near for _, near in wins} == {0.0}
    assert float(verdict.facts["success_2cm"][0]) == 1.0


@pytest.mark.parametrize(
    ("task", "ends"),
    [
        (TaskReach(), False),
        (TaskReach(ends=True), True),
        (TaskReach(reward_form=Reward.paper), True),
    ],
)
def test_success_ends_the_episode_where_it_shall(task: TaskReach, ends: bool) -> None:
    """With ``ends``, and with the paper's reward, at the fifth step within the distance."""
    episodes = Episodes(task)
    ledger = episodes.start(_instant(1.0))
    observation_of = []
    for _ in range(5):
        verdict, ledger = episodes.assess(_instant(0.04), _instant(0.04), ledger)
        observation_of.append(bool(verdict.terminated[0]))
    assert observation_of == [False] * 4 + [ends]


def test_an_episode_ends_when_its_time_is_over() -> None:
    """8 s at 25 Hz are 200 steps; the last one is truncated, not terminated."""
    episodes = Episodes(TaskReach())
    ledger = episodes.start(_instant(1.0))
    ends = []
    for _ in range(200):
        verdict, ledger = episodes.assess(_instant(1.0), _instant(1.0), ledger)
        ends.append((bool(verdict.terminated[0]), bool(verdict.truncated[0])))
    assert ends[:-1] == [(False, False)] * 199
    assert ends[-1] == (False, True)


def test_quaternions_turn_as_their_matrices() -> None:
    """They give the matrix back, for random turns."""
    from seals.frames import matrix_of, quaternion_of_rpy

    rpy = np.random.default_rng(0).uniform(-3.0, 3.0, (50, 3))
    turns = matrix_of(quaternion_of_rpy(rpy))
    np.testing.assert_allclose(matrix_of(quaternion(turns)), turns, atol=1e-9)


def test_a_blind_learner_does_not_see_the_target() -> None:
    """Moving the target changes what others see, and nothing for the blind."""
    for word, same in (("blind", True), ("full", False), ("paper", False)):
        task = TaskReach(sight=type(TaskReach().sight)(word))
        a, b = observation_of(task.sight, _instant(0.1)), observation_of(task.sight, _instant(0.9))
        assert a.shape[1] == len(task.observation_names)
        assert np.array_equal(a, b) is same


def test_a_seed_decides_the_episode() -> None:
    """Equal seeds begin alike and go alike; others begin elsewhere."""
    twins = _twins(3)
    first = twins.reset([7, 8, 7])
    assert torch.equal(first[0], first[2])
    assert not torch.equal(first[0], first[1])
    turn = twins.step(torch.full((3, 3), 0.3))
    assert torch.equal(turn.final[0], turn.final[2])


def test_a_snapshot_continues_bit_for_bit() -> None:
    """Rewards and the starts of later episodes are those of the run that went on."""
    twins = _twins(4)
    twins.reset([1, 2, 3, 4])
    twins.step(twins.scripted_policy())
    kept = twins.snapshot()
    ahead = [twins.step(twins.scripted_policy()) for _ in range(15)]
    other = _twins(4)
    other.restore(kept)
    again = [other.step(other.scripted_policy()) for _ in range(15)]
    for a, b in zip(ahead, again, strict=True):
        assert torch.equal(a.reward, b.reward)
        assert torch.equal(a.observation, b.observation)
    assert any(bool(a.truncated.all()) for a in ahead)


def test_what_ended_begins_anew_at_once() -> None:
    """The observation is that of the next start, ``final`` that of the end."""
    twins = _twins(2)
    twins.reset([1, 2])
    turns = [twins.step(torch.zeros(2, 3)) for _ in range(11)]
    ended = [bool(t.truncated.all()) for t in turns]
    assert ended == [False] * 9 + [True, False]
    assert not torch.equal(turns[9].observation, turns[9].final)
    assert torch.equal(turns[8].observation, turns[8].final)
    assert float(turns[10].facts["time"][0]) == pytest.approx(0.04)


def test_who_never_arrives_has_no_time_of_arrival() -> None:
    """A twin that has not reached its target tells no number, and 0 s least of all."""
    twins = _twins(2)
    twins.reset([1, 2])
    turn = twins.step(torch.zeros(2, 3))
    assert bool(turn.facts["reached_after"].isnan().all())
    assert bool(turn.facts["distance"].isfinite().all())


@pytest.mark.thorough
def test_pytorch_flies_as_numpy_does() -> None:
    """In float64, on the processor, states agree to 1e-9 over a second across the surface."""
    from seals.batch.piloted import PilotedTwin
    from seals.learn.environments.build import build_learning
    from seals.run.assembly import build_model

    settings, task = build_learning(compose([], root="learn"))
    robot, effects = build_model(settings)
    places = []
    for like in (np.zeros(1), torch.zeros(1, dtype=torch.float64)):
        pilot = PilotedTwin(
            settings, robot, effects, joints=task.posture.tolist(), batch=2, like=like, step=0.02
        )
        state = pilot.twin.start(position=[[0, 0, 0.4], [0.1, 0.0, 0.9]], velocity=[0.0, 0.0, -0.5])
        flight = pilot.start(state, like + 670.0 * (like[None] * 0.0 + 1.0))
        wanted = [[0.5, 0.2, -1.0], [0.0, 0.3, -1.0]]
        velocity = torch.tensor(wanted, dtype=torch.float64) if places else np.array(wanted)
        flight = pilot.fly(flight, {"velocity": velocity, "yaw": velocity[:, 0:1] * 0.0}, 50)
        places.append(np.asarray(flight.state.position.tolist()))
    assert places[0][0, 2] < 0.1
    np.testing.assert_allclose(places[1], places[0], atol=1e-9)


def test_gymnasium_finds_nothing_to_say() -> None:
    """Its own check is clean for one environment, and a batch tells the last observations."""
    gymnasium = pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env

    import seals.envs  # noqa: F401  makes the ids known

    one = gymnasium.make("SEALS/Reach-v0", backend="free", overrides=SHORT)
    check_env(one.unwrapped, skip_render_check=True)
    one.close()
    many = gymnasium.make_vec(
        "SEALS/Hover-v0", 3, vectorization_mode="vector_entry_point", overrides=SHORT
    )
    first, _ = many.reset(seed=5)
    assert first.shape == (3, many.single_observation_space.shape[0])
    infos = [many.step(np.zeros((3, 3), dtype=np.float32))[4] for _ in range(10)]
    assert "final_obs" not in infos[8]
    assert infos[9]["final_obs"].shape == first.shape
    many.close()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["~env", "robot=aam"], "task is not given"),
        (["guide=hover"], "guide=commanded"),
        (["task.start_low=[0,0,2]"], "do not define a box"),
        (["task.arm=[0.1]"], "task.arm has 1 values"),
        (["task.rate=200", "backend=pybullet", "time.step=0.01"], "above 100"),
        (["+objects.thing={robot: ball, position: [0, 0, 1]}"], "has no option objects"),
    ],
)
def test_what_cannot_be_is_refused_in_words(words: list[str], said: str) -> None:
    """The message says what is wrong and what to do."""
    from seals.errors import SealsError
    from seals.learn.environments import batched_of

    own = [] if "~env" in words else SHORT
    with pytest.raises(SealsError, match=said):
        batched_of(compose([*own, *words], root="learn"), count=1)


def test_no_environments_are_refused() -> None:
    """Zero of them cannot be stepped."""
    with pytest.raises(ConfigError, match="0 environments"):
        _twins(0)


def test_environments_go_with_their_last_name() -> None:
    """No reference cycle keeps environments, their batch dynamics or their tables alive."""
    gc.collect()
    gc.disable()
    try:
        twins = _twins(2, "env=hover", "backend=twin")
        twins.reset([0, 1])
        twins.step(torch.zeros(2, twins.action_size))
        parts = [
            weakref.ref(x)
            for x in (twins, twins.simulator.twin, twins.simulator.twin.twin, twins.robot)
        ]
        del twins
        assert [part() for part in parts] == [None] * 4
    finally:
        gc.enable()


@pytest.mark.thorough
def test_laws_are_compiled_where_all_episodes_together_are_long() -> None:
    """One reach of 2,000 steps is not worth it, a hundred are; so is a training of as many."""
    pytest.importorskip("mujoco")
    pytest.importorskip("llvmlite")
    from seals.learn.environments import batched_of

    for root, words, compiled in (
        ("evaluate", ("episodes=1",), False),
        ("evaluate", ("episodes=100",), True),
        ("train", ("course.steps=100", "learner=sac"), False),
        ("train", ("course.steps=20000", "learner=sac"), True),
        ("train", ("course.steps=20000", "learner=sac", "backend.compiled=false"), False),
    ):
        config = compose(["env=reach", "backend=mujoco", *words], root=root)
        found: Any = batched_of(config, count=1)
        assert (found.simulator.worlds[0].actor.compiled is not None) == compiled, (root, words)
        found.close()


def test_the_noise_of_sensors_follows_the_seed_of_the_episode() -> None:
    """In a world: another seed, other noise; the same one, the same."""
    words = ["env=hover", "backend=mujoco", "backend.compiled=false", "robot=hexacopter"]
    words += ["+sensor@sensors.felt=imu", "sensors.felt.accelerometer_noise=0.1"]
    settings, task = build_learning(compose(words, root="learn"))
    one = FullWorld(settings, task)
    draw, read = task.draw(np.random.default_rng(4), 1), []
    for seed in (1, 1, 2):
        one.begin(draw, seed)
        one.world.advance(40)
        read.append(one.actor.readings["felt"]["specific_force"].copy())
    one.world.close()
    assert np.array_equal(read[0], read[1])
    assert not np.array_equal(read[1], read[2])
