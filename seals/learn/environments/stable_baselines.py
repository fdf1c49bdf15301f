"""Vectorised environment for Stable-Baselines3."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv

from seals.errors import ConfigError, optional_import

with optional_import(
    "environments for its learners need stable-baselines3",
    "Install it: pip install 'aam-seals[agents]'",
):
    from stable_baselines3.common.vec_env import VecEnv


class BatchVecEnv(VecEnv):
    """Vector environment of Gymnasium, stepped as one for a learner of Stable-Baselines3.

    What its ``Monitor`` would add is there: return, length and success of episodes that end.

    Args:
        batch: whose episodes restart in the step that ends them.

    Raises:
        ConfigError: they begin anew at another time.
    """

    def __init__(self, batch: VectorEnv[Any, Any, Any]) -> None:
        """Take over the spaces of one environment."""
        if batch.metadata.get("autoreset_mode") != AutoresetMode.SAME_STEP:
            raise ConfigError(
                "episodes of this vector environment do not restart in the step that ends them."
                "\nMake it by gymnasium.make_vec(..., vectorization_mode='vector_entry_point')"
            )
        self.batch = batch
        super().__init__(batch.num_envs, batch.single_observation_space, batch.single_action_space)
        self._actions: Any = None
        self._begun = time.perf_counter()
        self._length = np.zeros(batch.num_envs, dtype=int)
        self._return = np.zeros(batch.num_envs)

    def reset(self) -> Any:
        """Reset all environments and return the observations."""
        seeded = any(seed is not None for seed in self._seeds)
        seeds: Any = self._seeds if seeded else None
        found, _ = self.batch.reset(seed=seeds)
        self._reset_seeds()
        self._length[:], self._return[:] = 0, 0.0
        return found

    def step_async(self, actions: Any) -> None:
        """Take over the actions of the next `step_wait`, shape (N, a)."""
        self._actions = actions

    def step_wait(self) -> tuple[Any, Any, Any, list[dict[str, Any]]]:
        """Step all environments; return observations, rewards, ends, and infos of each."""
        seen, reward, terminated, truncated, facts = self.batch.step(self._actions)
        ended = terminated | truncated
        self._length += 1
        self._return += reward
        infos: list[dict[str, Any]] = [{"TimeLimit.truncated": False} for _ in range(self.num_envs)]
        for k in np.flatnonzero(ended):
            final = facts["final_obs"]
            infos[k] = {
                "TimeLimit.truncated": bool(truncated[k] and not terminated[k]),
                "terminal_observation": {key: x[k] for key, x in final.items()}
                if isinstance(final, dict)
                else final[k],
                "episode": {
                    "r": float(self._return[k]),
                    "l": int(self._length[k]),
                    "t": time.perf_counter() - self._begun,
                },
            }
            if "success" in facts:
                infos[k]["is_success"] = bool(facts["success"][k])
        self._length[ended], self._return[ended] = 0, 0.0
        return seen, reward.astype(np.float32), ended, infos

    def close(self) -> None:
        """Release all environments."""
        self.batch.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of the batch, once for every requested environment."""
        return [getattr(self.batch, attr_name)] * len(self._rows(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of the batch."""
        setattr(self.batch, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of the batch once; return its result for every requested environment."""
        found = getattr(self.batch, method_name)(*method_args, **method_kwargs)
        return [found] * len(self._rows(indices))

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Return False for each: nothing is wrapped around one robot of a batch."""
        return [False] * len(self._rows(indices))

    def _rows(self, indices: Any) -> Sequence[int]:
        return list(self._get_indices(indices))
