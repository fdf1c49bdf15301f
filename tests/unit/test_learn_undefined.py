"""Numbers that are not finite stop an environment or a training, in words; modes of autoreset."""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

import seals.envs  # noqa: F401  makes the ids known
from seals.arrays import namespace
from seals.contract import ContractError
from seals.errors import ConfigError, PhysicsError
from seals.learn.training.loop import Training
from seals.learn.training.schedule import TrainingSchedule

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")

STEPS = 10
SHORT = ["task.duration=0.2", "task.rate=50"]
BACKENDS = ("twin", "free")


def many(count: int = 3, **named: Any) -> Any:
    """Some environments of a hover of ten steps."""
    named = {"overrides": SHORT, **named}
    return gymnasium.make_vec(
        "SEALS/Hover-v0", count, vectorization_mode="vector_entry_point", **named
    )


def still(count: int = 3) -> Any:
    """Actions that ask for nothing."""
    return np.zeros((count, 3), dtype=np.float32)


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_action_that_is_no_number_is_refused(backend: str) -> None:
    """A policy that diverged would end its episode early, and so do better than one that flies."""
    envs = many(backend=backend)
    envs.reset(seed=1)
    actions = still()
    actions[1, 2] = np.nan
    with pytest.raises(PhysicsError, match="action of environment 1 is not finite"):
        envs.step(actions)
    envs.close()


@pytest.mark.parametrize("law", ["reward", "observation"])
@pytest.mark.parametrize("backend", BACKENDS)
def test_a_task_that_returns_no_number_is_refused(backend: str, law: str) -> None:
    """Such a reward counted as 0 and the training ended as done."""
    envs = many(backend=backend)
    envs.reset(seed=1)
    task = envs.unwrapped.batched.task
    plain = getattr(task, law)

    def broken(now: Any, *more: Any) -> Any:
        found = plain(now, *more)
        first = found[0] if law == "reward" else found
        xp = namespace(first)
        odd = (
            xp.where(now.time >= 0.09, first * math.nan, first)
            if law == "observation"
            else (xp.where(now.time[:, 0] >= 0.09, first * math.nan, first))
        )
        return (odd, found[1]) if law == "reward" else odd

    object.__setattr__(task, law, broken)
    for _ in range(4):
        envs.step(still())
    with pytest.raises(PhysicsError, match=f"{law} of environment 0 is not finite"):
        envs.step(still())
    envs.close()


@pytest.mark.parametrize(
    ("law", "found", "said"),
    [
        ("scripted_policy", lambda now: now.position * 0.0 + 2.0, "actions of size 2"),
        ("observation", lambda now: now.position, r"observation returns shapes \[\(5, 3\)\]"),
        (
            "distance",
            lambda now: now.time[:, 0] * math.nan,
            "(reward|distance) returns numbers that are",
        ),
    ],
)
@pytest.mark.parametrize("backend", BACKENDS)
def test_a_task_that_breaks_a_promise_makes_no_environment(
    backend: str, law: str, found: Any, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What `seals.check_task` refuses is refused before the first step, in the same words."""
    from seals.plugins.tasks.hover import TaskHover

    monkeypatch.setattr(TaskHover, law, lambda self, now: found(now))
    with pytest.raises(ContractError, match=f"TaskHover: .*{said}"):
        many(backend=backend)


def test_a_training_whose_figures_are_no_numbers_stops(tmp_path: Any) -> None:
    """A loss that diverged, or the return of an unfinished episode on an accelerator."""
    envs = many()
    course = TrainingSchedule(steps=10)
    training = Training(envs.unwrapped.batched, _Agent(), course=course, folder=tmp_path)
    training._statistics.update({"loss": torch.tensor(math.nan)})
    with pytest.raises(PhysicsError, match=r"loss.* not finite by step 0"):
        training._log()
    training._statistics.returns[1] = math.nan
    with pytest.raises(PhysicsError, match="return of an unfinished episode"):
        training._log()
    envs.close()


class _Agent:
    """An agent that reports its loss."""

    reports = ("loss",)
    interactive = True


def test_seeds_of_none_are_chance() -> None:
    """Each environment starts elsewhere, and a seed beside them counts."""
    envs = many(4)
    first, _ = envs.reset(seed=[None, None, None, 7])
    again, _ = envs.reset(seed=[None, None, None, 7])
    assert len(np.unique(first[:, 0])) == 4
    assert np.array_equal(first[3], again[3])
    assert not np.array_equal(first[:3], again[:3])
    envs.close()


@pytest.mark.thorough
@pytest.mark.parametrize("backend", BACKENDS)
def test_an_episode_begins_anew_in_the_next_step(backend: str) -> None:
    """The step that ends it shows its last observation; the next one ignores the action."""
    same, later = many(backend=backend), many(backend=backend, autoreset_mode="NextStep")
    assert later.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    first, _ = later.reset(seed=[1, 2, 3])
    same.reset(seed=[1, 2, 3])
    for _ in range(STEPS):
        seen, reward, _, truncated, _ = later.step(still())
        fresh, wanted, *_, infos = same.step(still())
        assert np.array_equal(reward, wanted)
    assert truncated.all()
    assert np.array_equal(seen, infos["final_obs"])
    assert not np.array_equal(seen, fresh)
    moved, reward, terminated, truncated, _ = later.step(still() + 1.0)
    assert not reward.any()
    assert not (terminated | truncated).any()
    # as far from its target as any start, and not where the last episode ended
    assert np.abs(moved - seen).max() > 1e-3
    for k in range(STEPS):
        *_, truncated, _ = later.step(still())
        assert truncated.all() == (k == STEPS - 1)
    assert first.shape == moved.shape
    same.close()
    later.close()


@pytest.mark.parametrize("backend", BACKENDS)
def test_without_autoreset_rows_begin_anew_when_asked(backend: str) -> None:
    """The others go on."""
    envs = many(backend=backend, autoreset_mode=AutoresetMode.DISABLED)
    envs.reset(seed=[1, 2, 3])
    for _ in range(STEPS):
        seen, _, _, truncated, _ = envs.step(still())
    assert truncated.all()
    mask = np.array([True, False, True])
    begun, _ = envs.reset(options={"reset_mask": mask})
    assert np.array_equal(begun[1], seen[1])
    assert (np.abs(begun - seen)[mask].max(axis=1) > 1e-3).all()
    with pytest.raises(ConfigError, match="one flag for each"):
        envs.reset(options={"reset_mask": np.array([True])})
    envs.close()


def test_wrappers_of_statistics_take_it() -> None:
    """Gymnasium's own, which refuse episodes that begin anew in the same step."""
    envs = NormalizeObservation(RecordEpisodeStatistics(many(autoreset_mode="NextStep")))
    envs.reset(seed=1)
    for _ in range(STEPS):
        *_, infos = envs.step(still())
    assert infos["episode"]["l"].tolist() == [STEPS] * 3
    envs.close()


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_batch_shows_all_robots(backend: str) -> None:
    """One picture each; the robots are at starts of their own."""
    envs = many(backend=backend, render_mode="rgb_array")
    envs.reset(seed=1)
    envs.step(still())
    images = envs.render()
    assert len(images) == 3
    assert all(image.dtype == np.uint8 and image.std() > 5.0 for image in images)
    assert np.abs(images[0].astype(int) - images[1].astype(int)).max() > 20
    envs.close()


def test_gymnasium_films_a_batch(tmp_path: Any) -> None:
    """Its own wrapper for vectors, which tiles the pictures of all robots."""
    pytest.importorskip("moviepy", reason="RecordVideo: pip install 'aam-seals[agents]'")
    from gymnasium.wrappers.vector import RecordVideo

    films = str(tmp_path / "films")
    envs = RecordVideo(many(autoreset_mode="NextStep", render_mode="rgb_array"), films)
    envs.reset(seed=1)
    for _ in range(STEPS + 1):
        envs.step(still())
    envs.close()
    # of the episode from the reset on, and of the one after it
    names = sorted(path.name for path in (tmp_path / "films").iterdir())
    assert names == ["rl-video-episode-0.mp4", "rl-video-episode-1.mp4"]


@pytest.mark.parametrize(
    "words", [{"autoreset_mode": "NextStp"}, {"render_mode": "human"}], ids=["autoreset", "render"]
)
def test_unknown_modes_are_refused(words: dict[str, Any]) -> None:
    """With the modes that there are."""
    with pytest.raises(ConfigError, match="_mode="):
        many(**words)
