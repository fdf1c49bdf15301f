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

from seals.errors import ConfigError, refuse_unlisted
from seals.learn.environments.build import batched_of
from seals.learn.environments.episodes import FARTHEST
from seals.pytree import mapped

FEW = 8
"""Worlds up to which the laws of all are compiled, however long they are stepped."""
ENGINE = "mujoco"
"""Engine of environments of one robot that name none: the quickest with contacts."""
MODES = ("human", "rgb_array")
"""Ways in which one environment is drawn."""
GOAL = 3
"""Numbers of a goal: a place in the world [m]."""
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
        backend: ``pybullet``, ``mujoco``, ``free`` or ``twin``; empty for MuJoCo.
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
        if render_mode is not None:
            refuse_unlisted(str(render_mode), MODES, f"render_mode={render_mode}")
        config = composed(env, backend or ENGINE, overrides)
        self.render_mode, self._picture = render_mode, _picture_of(config, render_mode)
        self._batched: Any = batched_of(config, count=1, lasting=True, coded=True)
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
            self._picture.begin(self._batched)
            self._show()
        return found, {}

    def step(self, action: Numbers) -> tuple[Numbers, float, bool, bool, dict[str, Any]]:
        """Step one control period; quantities not known yet are left out of ``info``."""
        import torch

        turn = self._batched.step(torch.as_tensor(np.asarray(action, dtype=np.float32))[None])
        self._show()
        values = {name: x.item() for name, x in turn.facts.items()}
        facts = {name: value for name, value in values.items() if not math.isnan(value)}
        ended = turn.terminated.item(), turn.truncated.item()
        return _numbers(turn.final, 0), turn.reward.item(), *ended, facts

    def scripted_policy(self) -> Numbers:
        """Return the action of the task's scripted policy."""
        found: Numbers = self._batched.scripted_policy().numpy()[0]
        return found

    def render(self) -> NDArray[np.uint8] | None:
        """Return the image of the state after the last step, shape (height, width, 3).

        None without ``render_mode="rgb_array"``: a window is drawn by every step.
        """
        if self.render_mode != "rgb_array" or self._picture.frame is None:
            return None
        found: NDArray[np.uint8] = self._picture.image()
        return found

    def close(self) -> None:
        """Release the world and the window."""
        self._batched.close()
        if self._picture is not None:
            self._picture.close()

    def _show(self) -> None:
        if self.render_mode == "human":
            self._picture.show()


class SealsGoalEnv(SealsEnv):
    """Environment of one robot whose goal can be replaced afterwards (hindsight).

    Observations are a mapping: ``observation`` without the target, ``achieved_goal``, the place of
    the hand, and ``desired_goal``, that of the target, world [m], shape (3,) each.

    Equation:
        r = -1 for |achieved - desired| > d, else 0, with the success distance d of the task; with
        ``dense`` r = -|achieved - desired|.

    Args:
        env: recipe of the group ``env`` whose task knows ``task.sight``.
        backend: as in `SealsEnv`.
        overrides: Hydra overrides.
        render_mode: as in `SealsEnv`.
        dense: whether the reward is the distance itself.

    References:
        Andrychowicz et al. 2017, arXiv 1707.01495 (hindsight experience replay); Plappert et al.
        2018, arXiv 1802.09464 (the interface).
    """

    def __init__(
        self,
        env: str,
        *,
        backend: str = "",
        overrides: Sequence[str] = (),
        render_mode: str | None = None,
        dense: bool = False,
    ) -> None:
        # only ``desired_goal`` tells the target
        words = ["task.sight=blind", *overrides]
        super().__init__(env, backend=backend, overrides=words, render_mode=render_mode)
        self._dense, self._within = dense, float(self._batched.task.success_distance)
        place = spaces.Box(-FARTHEST, FARTHEST, (GOAL,), np.float32)
        self.observation_space = spaces.Dict(
            {"observation": self.observation_space, "achieved_goal": place, "desired_goal": place}
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Reset the environment; the seed determines the initial state and the goal."""
        seen, facts = super().reset(seed=seed, options=options)
        return self._with_goals(seen, self._batched.now), facts

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Step one control period; the reward is that of `compute_reward`."""
        seen, _, terminated, truncated, facts = super().step(action)
        found = self._with_goals(seen, self._batched.reached)
        reward = self.compute_reward(found["achieved_goal"], found["desired_goal"], facts)
        return found, float(reward), terminated, truncated, facts

    def compute_reward(
        self, achieved_goal: Any, desired_goal: Any, info: Any
    ) -> NDArray[np.float32]:
        """Return the rewards of achieved under wanted goals, shape (...), of goals (..., 3).

        Args:
            achieved_goal: places of the hand [m].
            desired_goal: places that were wanted [m].
            info: not looked at.
        """
        away = np.linalg.norm(np.asarray(achieved_goal) - np.asarray(desired_goal), axis=-1)
        found = -away if self._dense else -(away > self._within).astype(float)
        return np.asarray(found, dtype=np.float32)

    @staticmethod
    def _with_goals(seen: Any, now: Any) -> dict[str, Any]:
        hand, target = (
            np.array(x[0].cpu() if hasattr(x, "cpu") else x[0], dtype=np.float32)
            for x in (now.tool, now.target)
        )
        return {"observation": seen, "achieved_goal": hand, "desired_goal": target}


class SealsVectorEnv(VectorEnv[Numbers, Numbers, Any]):
    """Gymnasium vector environment of N robots: one batch, or N worlds.

    An episode that ends begins anew in the same step, and its last observation is ``final_obs`` of
    the infos; or in the next one, whose action it ignores; or when ``reset`` is called with its
    row in ``options={"reset_mask": ...}``.

    Args:
        env: recipe of the group ``env``.
        num_envs: N.
        backend: ``twin``, ``pybullet``, ``mujoco`` or ``free``; empty for that of the recipe, twins
            where they can do the task.
        overrides: Hydra overrides.
        device: of the twins.
        autoreset_mode: of Gymnasium, or its value: ``SameStep``, ``NextStep``, ``Disabled``.
        render_mode: ``rgb_array`` for pictures, None for none.

    Raises:
        SealsError: an override is wrong, the robot cannot do the task, or a mode is not known.
    """

    def __init__(
        self,
        env: str,
        *,
        num_envs: int = 1,
        backend: str = "",
        overrides: Sequence[str] = (),
        device: str = "cpu",
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        render_mode: str | None = None,
    ) -> None:
        modes = {mode.value: mode for mode in AutoresetMode}
        mode = autoreset_mode if isinstance(autoreset_mode, str) else autoreset_mode.value
        refuse_unlisted(str(mode), modes, f"autoreset_mode={mode}")
        if render_mode not in (None, "rgb_array"):
            raise ConfigError(f"render_mode={render_mode}\nAllowed for many: rgb_array, or none.")
        config = composed(env, backend, overrides)
        self.autoreset_mode, self.render_mode = modes[mode], render_mode
        self.metadata = {
            "autoreset_mode": self.autoreset_mode,
            "render_modes": ["rgb_array"],
            "render_fps": float(config.task.rate),
        }
        same = self.autoreset_mode is AutoresetMode.SAME_STEP
        # each world follows its laws by itself, for seconds
        few = num_envs <= FEW
        self.batched: Any = batched_of(
            config, count=num_envs, device=device, renew=same, lasting=few, coded=True
        )
        self.num_envs = num_envs
        self.single_observation_space, self.single_action_space = _spaces(self.batched)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._ended = np.zeros(num_envs, dtype=bool)
        self._picture = _picture_of(config, render_mode)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Any = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Reset all environments, or those of ``options["reset_mask"]``, shape (N,).

        Args:
            seed: of all, or one each; None leaves an environment to chance.
            options: may hold the mask.

        Raises:
            ConfigError: a mask of another shape, or seeds of some environments only.
        """
        mask = (options or {}).get("reset_mask")
        if mask is not None:
            rows = np.asarray(mask, dtype=bool)
            if rows.shape != (self.num_envs,) or seed is not None:
                raise ConfigError(
                    f"a reset_mask of shape {rows.shape} for {self.num_envs} environments, or a "
                    "seed beside it.\nGive one flag for each of them, and no seed."
                )
            return _numbers(self.batched.begin_anew(rows)), {}
        self._ended[:] = False
        if seed is None or isinstance(seed, int):
            super().reset(seed=seed)
            seeds = self.np_random.integers(1_000_000_000, size=self.num_envs).tolist()
        else:
            fresh = self.np_random.integers(1_000_000_000, size=self.num_envs).tolist()
            seeds = [f if s is None else int(s) for s, f in zip(seed, fresh, strict=True)]
        found = _numbers(self.batched.reset(seeds))
        if self._picture is not None:
            self._picture.begin(self.batched)
        return found, {}

    def step(
        self, actions: Numbers
    ) -> tuple[Numbers, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Step all environments by one control period."""
        import torch

        turn = self.batched.step(torch.as_tensor(np.asarray(actions, dtype=np.float32)))
        terminated, truncated = turn.terminated.cpu().numpy(), turn.truncated.cpu().numpy()
        infos: dict[str, Any] = {name: x.cpu().numpy() for name, x in turn.facts.items()}
        reward = turn.reward.cpu().numpy().astype(np.float64)
        seen, ended = turn.observation, terminated | truncated
        if self.autoreset_mode is AutoresetMode.NEXT_STEP:
            # what moved on after its end is put back, to a start
            before, self._ended = self._ended, ended & ~self._ended
            if before.any():
                seen = self.batched.begin_anew(before)
                reward[before], terminated, truncated = (
                    0.0,
                    terminated & ~before,
                    truncated & ~before,
                )
        elif self.autoreset_mode is AutoresetMode.SAME_STEP and ended.any():
            infos |= {"final_obs": _numbers(turn.final), "_final_obs": ended}
        return _numbers(seen), reward, terminated, truncated, infos

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Return one picture for each robot, shape (height, width, 3); None without a mode."""
        if self._picture is None or self._picture.frame is None:
            return None
        return tuple(self._picture.image(frame) for frame in self.batched.frames())

    def close_extras(self, **kwargs: Any) -> None:
        """Release all worlds, and the renderer."""
        self.batched.close()
        if self._picture is not None:
            self._picture.close()


def _picture_of(config: Any, render_mode: str | None) -> Any:
    """What draws the first robot; None where nothing is drawn."""
    if render_mode is None:
        return None
    from seals.learn.film import Picture

    return Picture(config)


def _spaces(batched: Any) -> tuple[Any, Any]:
    """Spaces of one observation and of one action."""
    seen: Any = spaces.Box(-FARTHEST, FARTHEST, (batched.observation_size,), np.float32)
    if batched.pixels is not None:
        pixels = spaces.Box(0, 255, batched.pixels, np.uint8)
        seen = spaces.Dict({"state": seen, "pixels": pixels})
    return seen, spaces.Box(-1.0, 1.0, (batched.action_size,), np.float32)


def _numbers(observation: Any, row: int | None = None) -> Any:
    """An observation as NumPy has it, of all environments or of one."""
    return mapped(observation, lambda leaf: leaf.cpu().numpy()[() if row is None else row])
