"""Environments that are drawn: images, films by Gymnasium's own wrapper, a window."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import seals.envs  # noqa: F401  makes the ids known
from seals.errors import ConfigError

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")
gymnasium = pytest.importorskip("gymnasium")
pytest.importorskip("pybullet", reason="viewer=tiny needs PyBullet")

SHORT = ["task.duration=0.2"]


def made(name: str = "SEALS/Hover-v0", **more: Any) -> Any:
    """Twins of short episodes."""
    return gymnasium.make(name, overrides=["backend=twin", *SHORT], **more)


def test_an_image_shows_what_the_last_step_reached() -> None:
    """The robot moves in the image; the last one of an episode is not of the next start."""
    env = made(render_mode="rgb_array")
    env.reset(seed=3)
    first = env.render()
    assert first.shape == (300, 480, 3)
    assert first.dtype == np.uint8
    # robot and ball stand before a plain ground
    assert np.unique(first.reshape(-1, 3), axis=0).shape[0] > 50
    full = np.array([0.0, 0.0, 1.0], dtype=np.float32)
    images, ended = [first], False
    while not ended:
        _, _, _, ended, _ = env.step(full)
        images.append(env.render())
    pairs = itertools.pairwise(images)
    changes = [float(np.abs(b.astype(float) - a).mean()) for a, b in pairs]
    assert min(changes[1:]) > 0.0
    env.reset(seed=4)
    assert float(np.abs(env.render().astype(float) - images[-1]).mean()) > max(changes)
    env.close()


@pytest.mark.thorough
def test_gymnasium_records_a_video(tmp_path: Path) -> None:
    """RecordVideo writes a film of an episode."""
    pytest.importorskip("moviepy", reason="RecordVideo needs moviepy")
    env = gymnasium.wrappers.RecordVideo(
        made(render_mode="rgb_array"), str(tmp_path / "films"), disable_logger=True
    )
    env.reset(seed=1)
    ended = False
    while not ended:
        _, _, _, ended, _ = env.step(np.zeros(3, dtype=np.float32))
    env.close()
    films = list((tmp_path / "films").glob("*.mp4"))
    assert len(films) == 1
    assert films[0].stat().st_size > 1000


@pytest.mark.thorough
def test_gymnasium_checks_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Spaces, seeds, steps and both ways of drawing keep Gymnasium's contract."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pytest.importorskip("pygame", reason="a window needs pygame")
    from gymnasium.utils.env_checker import check_env

    check_env(made(render_mode="rgb_array").unwrapped)


@pytest.mark.thorough
def test_a_window_shows_every_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """render_mode="human" draws by itself, and render() returns nothing."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pygame = pytest.importorskip("pygame", reason="a window needs pygame")
    env = made(render_mode="human").unwrapped
    env.reset(seed=3)
    before = pygame.surfarray.array3d(pygame.display.get_surface())
    env.step(np.array([0.0, 0.0, 1.0], dtype=np.float32))
    env.step(np.array([0.0, 0.0, 1.0], dtype=np.float32))
    assert (pygame.surfarray.array3d(pygame.display.get_surface()) != before).any()
    assert env.render() is None
    env.close()
    assert not pygame.display.get_init()


def test_another_way_of_drawing_is_refused() -> None:
    """The nearest one is named."""
    with pytest.raises(ConfigError, match="Did you mean 'rgb_array'"):
        made().unwrapped.__class__("hover", render_mode="rgb_aray")
