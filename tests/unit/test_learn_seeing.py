"""Environments that see: pictures beside the numbers, the same in one robot and in many."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.config.compose import compose
from seals.errors import ConfigError

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")

SMALL = [f"sensors.{eye}.{side}=16" for eye in ("front", "belly") for side in ("width", "height")]
WORDS = ["env=reach_seen", "backend=twin", *SMALL]


def _seeing(count: int, *words: str) -> Any:
    from seals.learn.environments import batched_of

    return batched_of(compose([*WORDS, *words], root="learn"), count=count)


def _red(film: Any) -> Any:
    """Where the last picture of each camera is red, shape (N, C, H, W)."""
    colours = film[:, -6:].reshape(len(film), 2, 3, *film.shape[2:]).int()
    return (colours[:, :, 0] > 110) & (colours[:, :, 1] < 70)


@pytest.mark.thorough
def test_every_target_is_in_sight_at_the_start() -> None:
    """One of the two cameras sees the ball, in each of 24 starts at full size."""
    seeing = _seeing(24, "sensors.front.width=64", "sensors.front.height=64",
                     "sensors.belly.width=64", "sensors.belly.height=64")  # fmt: skip
    seen = seeing.reset(list(range(24)))
    assert seen["pixels"].shape == (24, 18, 64, 64)
    assert bool(_red(seen["pixels"]).flatten(1).any(1).all())


def test_the_ball_is_where_the_pinhole_says() -> None:
    """The middle of its red pixels lies within one pixel of the projected target."""
    larger = [word.replace("=16", "=48") for word in SMALL]
    seeing = _seeing(8, "ball=0.15", "optics.noise=false", *larger)
    red = _red(seeing.reset(list(range(8)))["pixels"])
    now, eyes = seeing.now, seeing.cameras
    checked = 0
    for k in range(8):
        for camera in range(2):
            place = now.position[k] + now.rotation[k] @ eyes._mounts[camera].numpy()
            axes = now.rotation[k] @ eyes._axes[camera].numpy()
            point = axes.T @ (now.target[k] - place)
            where = eyes.lens.project(point) - 0.5
            rows, columns = np.nonzero(red[k, camera].numpy())
            # a ball cut off by the rim or hidden by the arm has another middle
            inside = bool(((where > 6) & (where < 41)).all()) and point[2] > 0.0
            whole = len(rows) > 0.6 * np.pi * (0.15 * eyes.lens.fx / point[2]) ** 2
            if inside and whole:
                assert abs(columns.mean() - where[0]) < 1.0
                assert abs(rows.mean() - where[1]) < 1.0
                checked += 1
    assert checked >= 5


def test_a_film_holds_the_steps_before_and_begins_anew_with_an_episode() -> None:
    """At a start all frames are alike; then the oldest leave; the final film is of the old one."""
    seeing = _seeing(2, "task.duration=0.16", "optics.noise=false")
    film = seeing.reset([1, 2])["pixels"]
    assert torch.equal(film[:, :6], film[:, 6:12])
    assert torch.equal(film[:, :6], film[:, 12:])
    for step in range(4):
        turn = seeing.step(torch.full((2, 3), 1.0))
        final = turn.final["pixels"]
        assert torch.equal(final[:, :12], film[:, 6:])
        ended = bool(turn.truncated.all())
        assert ended == (step == 3)
        film = turn.observation["pixels"]
        assert torch.equal(film, final) != ended
    assert torch.equal(film[:, :6], film[:, 12:])


def test_water_lies_before_the_eyes() -> None:
    """In turbid coastal water what is seen differs from what is seen without."""
    clear, turbid = (
        _seeing(2, f"water_type={kind}", "optics.noise=false").reset([1, 2])["pixels"]
        for kind in ("none", "coastal_9")
    )
    assert float((clear.float() - turbid.float()).abs().mean()) > 5.0


def test_a_snapshot_continues_bit_for_bit() -> None:
    """Pictures, their noise and the frames under way go on."""
    seeing = _seeing(2)
    seeing.reset([1, 2])
    seeing.step(seeing.scripted_policy())
    kept = seeing.snapshot()
    ahead = [seeing.step(seeing.scripted_policy()).observation["pixels"] for _ in range(3)]
    other = _seeing(2)
    other.restore(kept)
    again = [other.step(other.scripted_policy()).observation["pixels"] for _ in range(3)]
    assert all(torch.equal(a, b) for a, b in zip(ahead, again, strict=True))


def test_gymnasium_finds_nothing_to_say() -> None:
    """One robot that sees passes the checks of the interface."""
    from gymnasium.utils.env_checker import check_env

    from seals.learn.environments.gym import SealsEnv

    env = SealsEnv("reach_seen", backend="twin", overrides=[*SMALL, "task.duration=0.2"])
    check_env(env, skip_render_check=True)
    env.close()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["viewer=tiny"], "viewer=raycast"),
        (["sensors.belly.fov=1.0"], "equal width"),
        (["sensors.front.link=nowhere"], "Links"),
        (["frames=0"], "1 or more"),
    ],
)
def test_what_cannot_be_seen_is_refused_in_words(words: list[str], said: str) -> None:
    """The words say what to change."""
    with pytest.raises(ConfigError, match=said):
        _seeing(1, *words)


def test_a_world_without_cameras_is_named_as_before() -> None:
    """Frames and ball make no other world of one that shows no pictures."""
    from seals.learn.metadata import world_hash

    plain, other = (compose(["env=reach", *w], root="learn") for w in ([], ["ball=0.2"]))
    assert world_hash(plain) == world_hash(other)
    seen, larger = (compose([*WORDS, *w], root="learn") for w in ([], ["ball=0.2"]))
    assert world_hash(seen) != world_hash(larger)


def _training(size: int, folder: Path) -> list[str]:
    course = ["course.steps=24", "course.look_every=24", "course.episodes=2", "task.duration=0.3"]
    learner = ["learner=visual_sac", "learner.use_state=false", "learner.random_steps=8"]
    small = ["learner.batch=4", "learner.capacity=64", "count=4", "learner.steps=1"]
    eyes = [word.replace("=16", f"={size}") for word in SMALL]
    return ["train", *WORDS[:2], *eyes, *course, *learner, *small, f"hydra.run.dir={folder}"]


def test_a_learner_that_sees_is_trained(tmp_path: Path) -> None:
    """A short training of pictures alone ends with a policy of pictures."""
    assert main(_training(32, tmp_path)) == 0
    assert '"pixels"' in (tmp_path / "policy" / "card.json").read_text()


def test_pictures_too_small_for_the_layers_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The words say how large they must be."""
    assert main(_training(16, tmp_path)) == 2
    assert "from 23 pixels on" in capsys.readouterr().err
