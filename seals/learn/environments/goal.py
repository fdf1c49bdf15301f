"""Goal-conditioned environment: observations hold the desired and the achieved goal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from seals.learn.environments.episodes import FARTHEST
from seals.learn.environments.gym import SealsEnv

GOAL = 3
"""Numbers of a goal: a place in the world [m]."""


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
        """Hide the target from the observation: only ``desired_goal`` tells it."""
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
