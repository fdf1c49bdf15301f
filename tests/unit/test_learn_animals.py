"""Tasks with animals: catching a crab, and walking as one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.config.compose import compose
from seals.errors import SealsError
from seals.learn.environments.episodes import Episodes
from seals.learn.task import Instant
from seals.plugins.tasks.catch import TaskCatch
from seals.plugins.tasks.rewards import Reward
from seals.plugins.tasks.walk import TaskWalk
from seals.robot.model import RobotModel

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")

NEW = np.zeros((1, 2))


def _robot(name: str) -> RobotModel:
    from seals.config.source import find_robot
    from seals.robot.build import build_robot
    from seals.run.objects import object_robot

    return build_robot(object_robot(find_robot(name)))


def _diver(
    target: list[float],
    *,
    tool: list[float] | None = None,
    grip: float = 0.0,
    touch: float = 0.0,
    closed: float | None = None,
    last: float = -1.0,
) -> Instant:
    """A level robot at rest, its hand 0.42 m below the body unless said otherwise."""
    hand = np.array([tool or [0.0, 0.0, -0.8]])
    row, one = np.zeros((1, 3)), np.ones((1, 1))
    action = np.array([[0.0, 0.0, 0.0, last]])
    made = grip if closed is None else closed
    facts = {"grip": grip * one, "closed": made * one, "touch": touch + row, "level": 0.0 * one}
    body = hand + np.array([0.0, 0.0, 0.42])
    turn = np.eye(3)[None]
    place = np.array([target])
    return Instant(one, body, turn, row, row, hand, place, row, one, action, one, facts)


def _crab(
    x: float, y: float = 0.0, *, yaw: float = 0.0, tilt: float = 0.0, power: float = 0.0
) -> Instant:
    """A crab at rest at a place, its target at the origin."""
    row, one = np.zeros((1, 3)), np.ones((1, 1))
    c, s, ct, st = np.cos(yaw), np.sin(yaw), np.cos(tilt), np.sin(tilt)
    turn = np.array([[[c, -s, 0], [s, c, 0], [0, 0, 1]]]) @ [[1, 0, 0], [0, ct, -st], [0, st, ct]]
    facts = {"phase": np.zeros((1, 12)), "power": power * one, "slip": 0.0 * one}
    place = np.array([[x, y, 0.029]])
    goal = np.array([[0.0, 0.0, 0.029]])
    still = np.zeros((1, 7))
    return Instant(one, place, turn, row, row, place, goal, row, 0 * one, still, one, facts)


def test_a_catch_is_rewarded_stage_by_stage() -> None:
    """Near is better than far, gripped better than near, lifted better than gripped."""
    task = TaskCatch()
    far = _diver([0.5, 0.0, -0.97])
    close = _diver([0.0, 0.0, -0.81])
    gripped = _diver([0.0, 0.0, -0.81], grip=1.0, touch=3.0)
    lifted = _diver([0.0, 0.0, 0.2], tool=[0.0, 0.0, 0.2], grip=1.0, touch=3.0)
    untouched = _diver([0.0, 0.0, 0.2], tool=[0.0, 0.0, 0.2], grip=1.0)
    rewards = [float(task.stages(now)[0]) for now in (far, close, gripped, lifted)]
    assert rewards == sorted(rewards)
    assert min(np.diff(rewards)) > 0.5
    # the height counts only with an animal in the hand: 1 for nearness is all there is
    assert task.stages(untouched)[0] == pytest.approx(1.0)
    assert task.stages(lifted)[0] == pytest.approx(6.0, abs=0.01)


def test_a_catch_is_won_above_the_water_and_in_the_hand() -> None:
    """What is lacking is height and nearness; a crab that jumps is not caught."""
    task = TaskCatch(height=0.2, grasp=0.07)
    below = _diver([0.0, 0.0, -0.8])
    held = _diver([0.0, 0.0, 0.25], tool=[0.0, 0.03, 0.25])
    loose = _diver([0.0, 0.0, 0.25], tool=[0.0, 0.5, 0.25])
    assert task.distance(below)[0] == pytest.approx(1.0)
    assert task.distance(held)[0] == 0.0
    assert task.distance(loose)[0] == pytest.approx(0.43)


def test_what_is_out_of_sight_is_not_observed() -> None:
    """Outside of the cone below the body, place and velocity of the target are zeros."""
    task = TaskCatch(view=0.5)
    task.bind(_robot("aam"))
    inside = _diver([0.3, 0.0, -0.97])
    outside = _diver([0.4, 0.0, -0.97])
    names = task.observation_names
    assert task.seen(inside)[0, 0] == 1.0
    assert task.seen(outside)[0, 0] == 0.0
    first, second = task.observation(inside)[0], task.observation(outside)[0]
    assert first.shape == (len(names),)
    assert first[names.index("target_x")] == pytest.approx(0.3)
    assert not second[: names.index("seen") + 1].any()


@pytest.mark.parametrize(
    ("now", "up", "grips"),
    [
        (_diver([0.0, 0.0, -1.5]), -1, False),
        (_diver([0.0, 0.0, -0.796]), 0, True),
        (_diver([0.0, 0.0, -0.796], grip=0.5, last=1.0), 0, True),
        (_diver([0.0, 0.0, -0.796], grip=0.5, last=-1.0), 1, False),
        (_diver([0.0, 0.0, -0.81], grip=0.9, closed=0.6, touch=2.0, last=1.0), 1, True),
        (_diver([0.0, 0.0, -0.796], grip=0.9, closed=0.6, touch=0.1, last=1.0), 0, True),
        (_diver([0.0, 0.0, -0.81], grip=1.0, last=1.0), 1, False),
        (_diver([0.2, 0.0, -0.97], grip=1.0, last=1.0), 1, False),
        (_diver([2.0, 0.0, -0.97]), 1, False),
    ],
    ids=["above", "at it", "closing", "opening", "held", "loose", "empty", "slipped", "unseen"],
)
def test_the_diver_knows_what_to_do(now: Instant, up: int, grips: bool) -> None:
    """It descends, closes, goes on closing or opening, lifts, opens again, and looks from above."""
    action = TaskCatch().scripted_policy(now)[0]
    assert np.sign(np.round(action[2], 1)) == up
    assert bool(action[3] > 0.0) is grips


def test_a_leaning_body_is_led_by_where_its_hand_will_hang() -> None:
    """A body right above the animal whose lean swings the hand away need not move."""
    lean = 0.3
    c, s = np.cos(lean), np.sin(lean)
    turn = np.array([[[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]])
    now = _diver([0.0, 0.0, -0.97])
    arm = turn[0] @ [0.0, 0.0, -0.42]
    leaning = now._replace(rotation=turn, tool=now.position + arm)
    np.testing.assert_allclose(TaskCatch().scripted_policy(leaning)[0, :2], 0.0, atol=1e-12)


def test_a_hand_that_swings_does_not_close() -> None:
    """At the animal it closes when the body hangs quietly, neither leaning much nor turning."""
    task, calm = TaskCatch(), _diver([0.0, 0.0, -0.796])
    c, s = np.cos(0.25), np.sin(0.25)
    turn = np.array([[[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]])
    assert task.scripted_policy(calm)[0, 3] > 0.0
    assert task.scripted_policy(calm._replace(rotation=turn))[0, 3] < 0.0
    assert (
        task.scripted_policy(calm._replace(angular_velocity=np.array([[0.5, 0.0, 0.0]])))[0, 3]
        < 0.0
    )


def test_a_hand_comes_down_only_over_the_animal() -> None:
    """Open fingers beside the animal stay above it, even if the level hand would hang over it."""
    task, over = TaskCatch(), _diver([0.0, 0.0, -0.85])
    beside = over._replace(tool=over.tool + np.array([[0.05, 0.0, 0.0]]))
    assert task.scripted_policy(over)[0, 2] < 0.0
    assert task.scripted_policy(beside)[0, 2] > 0.0


def test_a_closing_hand_keeps_its_own_pace() -> None:
    """What it jostles moves fast and is not followed; an open hand follows and leads, up to a pace.

    The lead is that of a body which leans against the drag of its pace; a third of a change is
    asked for in a step.
    """
    task, eased = TaskCatch(), 0.35
    jostled = np.array([[0.5, 0.0, 0.0]])
    opened = _diver([0.0, 0.0, -1.0])._replace(target_velocity=jostled)
    closing = _diver([0.0, 0.0, -0.796], grip=0.5, last=1.0)._replace(target_velocity=jostled)
    lead = 3.5 * 0.12**2
    assert task.scripted_policy(opened)[0, 0] * task.speed == pytest.approx(
        eased * (0.12 + 1.2 * lead)
    )
    beside = opened._replace(target_velocity=jostled[:, [1, 0, 2]])
    assert task.scripted_policy(beside)[0, 1] * task.speed == pytest.approx(eased * 0.5 * 0.12)
    assert task.scripted_policy(closing)[0, 0] == pytest.approx(0.0)
    drifting = closing._replace(velocity=np.array([[0.03, 0.0, 0.0]]))
    lead = 3.5 * 0.03**2
    assert task.scripted_policy(drifting)[0, 0] * task.speed == pytest.approx(
        eased * (0.03 + 1.2 * lead)
    )


def test_a_walk_is_rewarded_for_its_terms() -> None:
    """Progress, power and lean each change the reward by what the equation says."""
    task = TaskWalk(bonus=0.0, smooth=0.0, heading=0.0)
    task.bind(_robot("crab"))

    def reward(now: Instant) -> float:
        return float(task.reward(now, _crab(0.5), NEW)[0][0])

    assert reward(_crab(0.5)) == pytest.approx(0.0)
    assert reward(_crab(0.45)) == pytest.approx(5.0 * 0.05 / 0.25)
    weight = 9.81 * float(_robot("crab").mass.sum())
    assert reward(_crab(0.5, power=1.0)) == pytest.approx(-0.1 / (weight * 0.25))
    assert reward(_crab(0.5, tilt=0.5)) == pytest.approx(-0.5 * (1.0 - np.cos(0.5)))
    paper = TaskWalk(reward_form=Reward.paper)
    assert paper.reward(_crab(0.5), _crab(0.5), NEW)[0][0] == pytest.approx(2.0)


def test_a_side_faces_the_way() -> None:
    """The heading term is largest with a side to the target, for either side, and 0 in front."""
    task = TaskWalk(bonus=0.0, heading=1.0, smooth=0.0)
    task.bind(_robot("crab"))
    faced = []
    for yaw in (0.0, 0.25 * np.pi, 0.5 * np.pi, -0.5 * np.pi):
        now = _crab(0.5, yaw=yaw)
        faced.append(float(task.reward(now, now, NEW)[0][0]))
    np.testing.assert_allclose(faced, [0.0, np.sqrt(0.5), 1.0, 1.0], atol=1e-12)


def test_velocities_of_a_walk_are_in_body_axes() -> None:
    """A crab that faces north and wants to go ahead goes north; manners span their ranges."""
    task = TaskWalk(speed=0.2, manner={"lift": [0.004, 0.02]})
    aim = task.aim(np.array([[1.0, 0.0, 0.5, 0.5]]), _crab(0.5, yaw=0.5 * np.pi))
    np.testing.assert_allclose(aim.velocity, [0.0, 0.2, 0.0], atol=1e-12)
    assert aim.yaw_rate == pytest.approx(1.0)
    assert aim.manner == {"lift": pytest.approx(0.016)}


def test_starts_of_a_walk_lie_on_a_ring() -> None:
    """All distances are those asked for, and all directions and headings occur."""
    task = TaskWalk(goal=[1.0, 2.0], nearest=0.3, farthest=0.4)
    draw = task.draw(np.random.default_rng(3), 400)
    away = draw.position[:, :2] - [1.0, 2.0]
    far = np.hypot(*away.T)
    assert far.min() >= 0.3
    assert far.max() <= 0.4
    for angles in (np.arctan2(away[:, 1], away[:, 0]), draw.yaw[:, 0]):
        assert (np.histogram(angles, bins=8, range=(-np.pi, np.pi))[0] > 25).all()


def test_a_fall_ends_the_walk() -> None:
    """Sixty degrees are too much."""
    task = TaskWalk()
    assert not task.ended(_crab(0.5, tilt=1.0), NEW)[0]
    assert task.ended(_crab(0.5, tilt=1.1), NEW)[0]


def test_the_account_of_a_walk_closes_at_the_target() -> None:
    """Time and cost of transport are those of the step at which the target had been held."""
    task = TaskWalk(rate=5.0, hold=0.4, success_distance=0.03)
    robot = _robot("crab")
    task.bind(robot)
    episodes = Episodes(task)
    now = _crab(0.4)._replace(start=np.array([[0.4]]))
    ledger, told = episodes.start(now), []
    for k, x in enumerate((0.2, 0.02, 0.01, 0.005, 0.5)):
        then = _crab(x, power=1.0)._replace(start=now.start, time=np.array([[0.2 * (k + 1)]]))
        verdict, ledger = episodes.assess(then, now, ledger)
        told.append([float(verdict.facts[n][0]) for n in ("reached_after", "cost_of_transport")])
        now = then
    # three steps of 0.2 s at 1 W over 0.39 m
    cost = 3 * 0.2 / (9.81 * float(robot.mass.sum()) * 0.39)
    assert np.isnan(told[:2]).all()
    np.testing.assert_allclose(told[2:], [[0.6, cost]] * 3, rtol=1e-12)


def _worlds(env: str, *words: str) -> Any:
    from seals.learn.environments import batched_of

    return batched_of(compose([f"env={env}", *words], root="learn"), count=1)


def test_the_scripted_crab_comes_to_its_target() -> None:
    """It holds the target within its time, at the cost of transport of the scripted gait."""
    pytest.importorskip("pybullet")
    walks = _worlds("crab_walk")
    walks.reset([2_000_000_000])
    task, costs, slips = walks.task, [], []
    for _ in range(15):
        turn = walks.step(walks.scripted_policy())
        now = walks.now
        speed = float(np.hypot(*now.velocity[0, :2]))
        if 0.8 < now.time[0, 0] < 1.9:
            costs.append(now.facts["power"][0, 0] / (task._weight * speed))
            slips.append(now.facts["slip"][0, 0])
    assert turn.facts["success"][0] == 1.0
    # docs/animals.md has 0.99 for the tripod; the speed at one instant is not the mean of a step
    assert 0.6 < np.mean(costs) < 1.5
    assert 0.0 < np.mean(slips) < 0.1
    # it stands now
    assert now.facts["power"][0, 0] < 0.01
    walks.close()


@pytest.mark.thorough
def test_the_diver_lifts_a_crab_from_the_bottom() -> None:
    """From above the crab it closes, and takes it 10 cm up."""
    pytest.importorskip("pybullet")
    box = ["task.start_low=[-0.15,0,-0.4]", "task.start_high=[-0.15,0,-0.4]"]
    place = ["task.target_low=[0,0,0]", "task.target_high=[0,0,0]"]
    dives = _worlds("catch", *box, *place, "objects.crab.guide=freeze", "initial.drives=rest")
    dives.reset([1])
    low = float(dives.now.target[0, 2])
    for _ in range(100):
        dives.step(dives.scripted_policy())
        now = dives.now
        if now.target[0, 2] > low + 0.1:
            break
    assert now.target[0, 2] > low + 0.1
    assert float(np.linalg.norm(now.target - now.tool)) < 0.07
    assert (now.facts["touch"] > 0.3).sum() >= 2
    dives.close()


def test_a_seed_places_the_animal() -> None:
    """Equal seeds begin alike, place and heading of the crab included; others elsewhere."""
    pytest.importorskip("pybullet")
    dives = _worlds("catch", "task.view=3.2")
    first, again, other = (dives.reset([seed]) for seed in (4, 4, 5))
    assert torch.equal(first, again)
    assert not torch.equal(first[:, :3], other[:, :3])
    place = dives.task.draw(np.random.default_rng(5), 1).goal[0]
    np.testing.assert_allclose(dives.now.target[0, :2], place[:2], atol=1e-6)
    dives.close()


def test_an_episode_begins_with_a_fresh_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    """The engine's state of the beginning is put back before the bodies are placed.

    Contacts of a long grip change the next episode in the 14th digit otherwise, and its end.
    """
    pytest.importorskip("pybullet")
    walks = _worlds("crab_walk")
    world, calls = walks.simulator.worlds[0].world, []
    restore, reset = world.backend.restore, world.reset
    monkeypatch.setattr(world.backend, "restore", lambda s: (calls.append(s), restore(s)))
    monkeypatch.setattr(world, "reset", lambda c: (calls.append("placed"), reset(c)))
    walks.reset([7])
    walks.reset([8])
    assert [c == "placed" for c in calls] == [False, True, False, True]
    assert calls[0] is calls[2]
    walks.close()


@pytest.mark.thorough
@pytest.mark.parametrize("env", ["SEALS/Catch-v0", "SEALS/CrabWalk-v0"])
def test_gymnasium_finds_nothing_to_say(env: str) -> None:
    """Its own check is clean, and a batch takes the backend of the recipe."""
    gymnasium = pytest.importorskip("gymnasium")
    pytest.importorskip("pybullet")
    from gymnasium.utils.env_checker import check_env

    import seals.envs  # noqa: F401  makes the ids known

    one = gymnasium.make(env, overrides=["task.duration=0.4"])
    check_env(one.unwrapped, skip_render_check=True)
    one.close()
    many = gymnasium.make_vec(env, 2, vectorization_mode="vector_entry_point")
    assert many.reset(seed=1)[0].shape == (2, many.single_observation_space.shape[0])
    many.close()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("env", "words", "said"),
    [
        ("catch", ["backend=twin", "~objects"], "backend=twin simulates robots with held joints"),
        ("catch", ["task.object=lobster"], "object 'lobster', which is not in the run"),
        ("catch", ["robot=crazyflie"], "needs a gripper with tips"),
        ("catch", ["environment.water_level=null", "water=none"], "needs water"),
        ("reach", ["task=walk"], "task walk needs legs"),
        ("crab_walk", ["task.nearest=1.0"], "task.nearest=1.0 is above task.farthest=0.4"),
        ("crab_walk", ["task.manner.lift=[2.0,1.0]"], "is not a range"),
        ("crab_walk", ["+task.manner.bounce=[0.0,1.0]"], "no parameter 'bounce'"),
    ],
)
def test_what_cannot_be_is_refused_in_words(env: str, words: list[str], said: str) -> None:
    """The message says what is wrong and what to do."""
    pytest.importorskip("pybullet")
    with pytest.raises(SealsError, match=said):
        _acted(env, *words)


def _acted(env: str, *words: str) -> None:
    worlds = _worlds(env, *words)
    worlds.step(torch.zeros(1, worlds.action_size))


def test_an_engine_that_gives_up_ends_the_episode(monkeypatch: pytest.MonkeyPatch) -> None:
    """A step that is refused terminates, is told as a fact, and the next episode begins."""
    pytest.importorskip("pybullet")
    from seals.errors import PhysicsError

    walks = _worlds("crab_walk")
    walks.reset([1])
    still = torch.zeros(1, walks.action_size)
    assert walks.step(still).facts["broken"][0] == 0.0
    world = walks.simulator.worlds[0].world

    def refuse() -> None:
        raise PhysicsError("too fast.\nTake a smaller step.")

    with monkeypatch.context() as patch:
        patch.setattr(world, "step", refuse)
        turn = walks.step(still)
    assert bool(turn.terminated[0])
    assert not bool(turn.success[0])
    assert turn.facts["broken"][0] == 1.0
    assert walks.step(still).facts["broken"][0] == 0.0
    walks.close()
