"""Learning environments with the interface of Gymnasium."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from seals import registry
from seals.errors import ConfigError, suggestion
from seals.learn.environments.build import batched_of
from seals.learn.environments.episode_frame import EpisodeFrame
from seals.learn.environments.episodes import FARTHEST
from seals.learn.observations import each

MODES = ("human", "rgb_array")
"""Ways in which one environment is drawn."""
Numbers = NDArray[np.float32]


def composed(env: str, backend: str, overrides: Sequence[str]) -> Any:
    """Return the configuration of an environment; an empty backend is that of the recipe.

    A ``backend=`` among the overrides goes first: makers of environments that know a keyword of
    this name themselves do not pass it on.

    Raises:
        SealsError: an override is wrong.
    """
    from seals.config.compose import compose

    said = any(word.startswith("backend=") for word in overrides)
    engine = [f"backend={backend}"] if backend and not said else []
    return compose([f"env={env}", *engine, *overrides], root="learn")


class SealsEnv(gymnasium.Env[Numbers, Numbers]):
    """Gymnasium environment of one robot and one task.

    Args:
        env: recipe of the group ``env``.
        backend: ``pybullet``, ``mujoco``, ``free`` or ``twin``; empty for the installed engine.
        overrides: Hydra overrides, for instance ``["task.duration=4", "robot=hexacopter"]``.
        render_mode: ``rgb_array`` for images by `render`, ``human`` for a window, None for neither;
            the ``viewer`` draws, ``overrides=["viewer=raycast"]`` chooses one.

    Raises:
        SealsError: an override is wrong, or the robot cannot do the task.
    """

    metadata = {"render_modes": list(MODES)}  # noqa: RUF012  the interface has it so

    def __init__(
        self,
        env: str,
        *,
        backend: str = "",
        overrides: Sequence[str] = (),
        render_mode: str | None = None,
    ) -> None:
        """Build the world once; every episode resets it."""
        if render_mode is not None and render_mode not in MODES:
            raise ConfigError(f"render_mode={render_mode}\n{suggestion(str(render_mode), MODES)}")
        config = composed(env, backend or registry.default_backend(), overrides)
        self.render_mode = render_mode
        self._picture: Any = None
        self._frame: Any = None
        if render_mode is not None:
            from seals.learn.picture import Picture

            self._picture = Picture(config)
        self._batched: Any = batched_of(config, count=1)
        self.metadata = {**type(self).metadata, "render_fps": float(config.task.rate)}
        self.observation_space: Any
        self.observation_space, self.action_space = _spaces(self._batched)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Reset the environment; the seed determines the initial state."""
        super().reset(seed=seed)
        start = int(self.np_random.integers(1_000_000_000)) if seed is None else seed
        found = _numbers(self._batched.reset([start]), 0)
        if self._picture is not None:
            # a callback is told at once what stands where
            self._batched.set_frame_callback(self._see)
            self._picture.begin(self._frame)
            self._show()
        return found, {}

    def step(self, action: Numbers) -> tuple[Numbers, float, bool, bool, dict[str, Any]]:
        """Step one control period; quantities not known yet are left out of ``info``."""
        import torch

        turn = self._batched.step(torch.as_tensor(np.asarray(action, dtype=np.float32))[None])
        self._show()
        values = {name: float(x[0]) for name, x in turn.facts.items()}
        facts = {name: value for name, value in values.items() if not math.isnan(value)}
        ended = bool(turn.terminated[0]), bool(turn.truncated[0])
        return _numbers(turn.final, 0), float(turn.reward[0]), *ended, facts

    def scripted_policy(self) -> Numbers:
        """Return the action of the task's scripted policy."""
        found: Numbers = self._batched.scripted_policy().numpy()[0]
        return found

    def render(self) -> NDArray[np.uint8] | None:
        """Return the image of the state after the last step, shape (height, width, 3).

        None without ``render_mode="rgb_array"``: a window is drawn by every step.
        """
        if self.render_mode != "rgb_array" or self._frame is None:
            return None
        found: NDArray[np.uint8] = self._picture.image(self._frame)
        return found

    def close(self) -> None:
        """Release the world and the window."""
        self._batched.close()
        if self._picture is not None:
            self._picture.close()

    def _see(self, frame: EpisodeFrame) -> None:
        self._frame = frame

    def _show(self) -> None:
        if self.render_mode == "human":
            self._picture.show(self._frame, self._batched.task.rate)


class SealsVectorEnv(VectorEnv[Numbers, Numbers, Any]):
    """Gymnasium vector environment of N robots: one batch, or N worlds.

    An episode that ends begins anew in the same step; its last observation is ``final_obs`` of the
    infos.

    Args:
        env: recipe of the group ``env``.
        num_envs: N.
        backend: ``twin``, ``pybullet``, ``mujoco`` or ``free``; empty for that of the recipe, twins
            where they can do the task.
        overrides: Hydra overrides.
        device: of the twins.
    """

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012  the interface has it so
    autoreset_mode = AutoresetMode.SAME_STEP
    """The same, where Gymnasium's own vector environments have it and TorchRL looks for it."""

    def __init__(
        self,
        env: str,
        *,
        num_envs: int = 1,
        backend: str = "",
        overrides: Sequence[str] = (),
        device: str = "cpu",
    ) -> None:
        """Build all environments."""
        config = composed(env, backend, overrides)
        self.batched = batched_of(config, count=num_envs, device=device)
        self.num_envs = num_envs
        self.single_observation_space, self.single_action_space = _spaces(self.batched)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Any = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Reset all environments."""
        if seed is None or isinstance(seed, int):
            super().reset(seed=seed)
            seeds = self.np_random.integers(1_000_000_000, size=self.num_envs).tolist()
        else:
            seeds = [int(s or 0) for s in seed]
        return _numbers(self.batched.reset(seeds)), {}

    def step(
        self, actions: Numbers
    ) -> tuple[Numbers, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Step all environments by one control period."""
        import torch

        turn = self.batched.step(torch.as_tensor(np.asarray(actions, dtype=np.float32)))
        terminated, truncated = turn.terminated.cpu().numpy(), turn.truncated.cpu().numpy()
        infos: dict[str, Any] = {name: x.cpu().numpy() for name, x in turn.facts.items()}
        ended = terminated | truncated
        if ended.any():
            infos |= {"final_obs": _numbers(turn.final), "_final_obs": ended}
        reward = turn.reward.cpu().numpy().astype(np.float64)
        return _numbers(turn.observation), reward, terminated, truncated, infos

    def close_extras(self, **kwargs: Any) -> None:
        """Release all worlds."""
        self.batched.close()


def _spaces(batched: Any) -> tuple[Any, Any]:
    """Spaces of one observation and of one action."""
    seen: Any = spaces.Box(-FARTHEST, FARTHEST, (batched.observation_size,), np.float32)
    if batched.pixels is not None:
        pixels = spaces.Box(0, 255, batched.pixels, np.uint8)
        seen = spaces.Dict({"state": seen, "pixels": pixels})
    return seen, spaces.Box(-1.0, 1.0, (batched.action_size,), np.float32)


def _numbers(observation: Any, row: int | None = None) -> Any:
    """An observation as NumPy has it, of all environments or of one."""
    return each(lambda leaf: leaf.cpu().numpy()[() if row is None else row], observation)
