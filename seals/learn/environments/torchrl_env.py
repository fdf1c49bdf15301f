"""Environment of TorchRL: N robots as one batch of tensors, on a processor or an accelerator."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.errors import SealsError, optional_import
from seals.learn.environments.build import batched_of
from seals.learn.environments.episodes import FARTHEST
from seals.learn.environments.gym import composed

with optional_import(
    "environments of TorchRL need torchrl", "Install it: pip install 'aam-seals[learn]'"
):
    from tensordict import TensorDict
    from torchrl.data import Binary, Bounded, Composite, Unbounded
    from torchrl.envs import EnvBase

ENDS = ("done", "terminated", "truncated")


class SealsEnvBase(EnvBase):
    """TorchRL environment of N robots, without a way over NumPy.

    Observations are ``observation`` (N, d), or ``state`` (N, d) and ``pixels`` (N, C, H, W) uint8;
    ``success`` (N, 1) says of a step that ends an episode whether it had succeeded. Episodes that
    end begin anew when TorchRL resets them.

    Args:
        env: recipe of the group ``env``.
        num_envs: N.
        backend: as in `seals.learn.environments.gym.SealsVectorEnv`.
        overrides: Hydra overrides.
        device: of all tensors, ``cpu`` or ``cuda``.

    Raises:
        SealsError: an override is wrong, or the robot cannot do the task.
    """

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
        import torch

        self.batched = batched = batched_of(
            composed(env, backend, overrides), count=num_envs, device=device
        )
        super().__init__(device=device, batch_size=[num_envs])
        self._random = np.random.default_rng()
        self._fresh: Any = None
        self._ended: Any = None
        shape, real = (num_envs, batched.observation_size), {"device": device}
        seen: dict[str, Any] = {"state": Bounded(-FARTHEST, FARTHEST, shape, **real)}
        if batched.pixels is not None:
            size = (num_envs, *batched.pixels)
            seen["pixels"] = Bounded(0, 255, size, dtype=torch.uint8, **real)
        else:
            seen = {"observation": seen["state"]}
        flag = Binary(n=1, shape=(num_envs, 1), dtype=torch.bool, **real)
        self.observation_spec = Composite(seen, success=flag, shape=(num_envs,))
        self.action_spec = Bounded(-1.0, 1.0, (num_envs, batched.action_size), **real)
        self.reward_spec = Unbounded((num_envs, 1), **real)
        self.done_spec = Composite({name: flag.clone() for name in ENDS}, shape=(num_envs,))

    def _reset(self, tensordict: Any = None, **kwargs: Any) -> Any:
        """Reset all, or those of a mask ``_reset``: which must be those whose episode has ended."""
        import torch

        wanted = None if tensordict is None else tensordict.get("_reset", None)
        if wanted is None or bool(wanted.all()):
            seeds = self._random.integers(1_000_000_000, size=self.batched.count)
            self._fresh = self.batched.reset(seeds.tolist())
        elif self._ended is None or bool((wanted[:, 0] & ~self._ended).any()):
            raise SealsError(
                "only environments whose episode has ended are reset alone.\nReset all of them."
            )
        none = torch.zeros((self.batched.count, 1), dtype=torch.bool, device=self.device)
        self._ended = none[:, 0]
        return self._told(self._fresh, dict.fromkeys((*ENDS, "success"), none))

    def _step(self, tensordict: Any) -> Any:
        found = self.batched.step(tensordict["action"])
        self._fresh, self._ended = found.observation, found.terminated | found.truncated
        flags = (self._ended, found.terminated, found.truncated, found.success)
        flagged = {
            name: flag[:, None] for name, flag in zip((*ENDS, "success"), flags, strict=True)
        }
        return self._told(found.final, {"reward": found.reward[:, None], **flagged})

    def _told(self, observation: Any, rest: dict[str, Any]) -> Any:
        seen = observation if isinstance(observation, dict) else {"observation": observation}
        return TensorDict({**seen, **rest}, batch_size=self.batch_size, device=self.device)

    def _set_seed(self, seed: int | None) -> None:
        """Seed the starts of whole resets; what begins by itself goes on as the batch draws it."""
        self._random = np.random.default_rng(seed)

    def close(self, **kwargs: Any) -> None:
        """Release all robots."""
        self.batched.close()
        super().close(**kwargs)
