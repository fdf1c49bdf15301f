"""Sequential environments: full worlds stepped one after the other behind the batch protocol."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.learn.batched import StepResult
from seals.learn.environments.episode_frame import FrameCallback
from seals.learn.environments.episodes import FARTHEST
from seals.learn.environments.world import WorldEnvironment
from seals.learn.task import Instant, Task

if TYPE_CHECKING:
    from torch import Tensor


class SequentialEnvironments:
    """N environments of one task, each in a world of its own, stepped in turn.

    Args:
        worlds: N of one kind.
        device: of the tensors.
        seed: of the starts that are not asked for by seed.

    Attributes:
        reached: what the last step reached in the first world, before its episode began anew.
    """

    pixels: tuple[int, int, int] | None = None

    def __init__(self, worlds: Sequence[WorldEnvironment], *, device: str, seed: int = 0) -> None:
        """Store the worlds."""
        task: Task = worlds[0].task
        self.worlds, self.task, self.device = list(worlds), task, device
        self.count = len(worlds)
        self.observation_size = len(task.observation_names)
        self.action_size = len(task.action_names)
        self._rng = np.random.default_rng(seed)
        self.reached: Instant = worlds[0].now

    @property
    def now(self) -> Instant:
        """Present state of the first world."""
        return self.worlds[0].now

    def reset(self, seeds: Sequence[int] | None = None) -> Tensor:
        """Reset all environments; see `seals.learn.batched.Batched`."""
        chosen = [self._seed() for _ in self.worlds] if seeds is None else seeds
        pairs = zip(self.worlds, chosen, strict=True)
        return self._tensor([world.reset(int(seed)) for world, seed in pairs])

    def step(self, action: Tensor) -> StepResult:
        """Step all environments; see `seals.learn.batched.Batched`."""
        import torch

        rows = action.detach().cpu().numpy()
        steps = [world.step(row) for world, row in zip(self.worlds, rows, strict=True)]
        self.reached = self.worlds[0].now
        verdicts = [s.verdict for s in steps]
        ended = np.array([bool(v.terminated[0] | v.truncated[0]) for v in verdicts])
        final = self._tensor([s.observation for s in steps]).clamp(-FARTHEST, FARTHEST)
        fresh = final.clone()
        for k in np.flatnonzero(ended):
            fresh[k] = self._tensor([self.worlds[k].reset(self._seed())])[0]

        def flags(name: str) -> Tensor:
            return torch.tensor([bool(getattr(v, name)[0]) for v in verdicts], device=self.device)

        return StepResult(
            observation=fresh,
            reward=self._tensor([v.reward for v in verdicts])[:, 0],
            terminated=flags("terminated"),
            truncated=flags("truncated"),
            final=final,
            success=flags("success") & torch.tensor(ended, device=self.device),
            facts={
                name: self._tensor([v.facts[name] for v in verdicts])[:, 0]
                for name in verdicts[0].facts
            },
        )

    def scripted_policy(self) -> Tensor:
        """Return the actions of the task's scripted policy, shape (N, a)."""
        return self._tensor([world.scripted_policy() for world in self.worlds])

    def snapshot(self) -> Any:
        """Refuse: the state of a rigid-body scene is not available as plain data.

        Raises:
            NotImplementedError: always.
        """
        raise NotImplementedError("worlds of a rigid-body engine are not kept as plain data")

    def restore(self, kept: Any) -> None:
        """Refuse, see `snapshot`.

        Raises:
            NotImplementedError: always.
        """
        raise NotImplementedError("worlds of a rigid-body engine are not kept as plain data")

    def set_frame_callback(self, callback: FrameCallback | None) -> None:
        """Set a callback for frames of the first world; see `WorldEnvironment`."""
        self.worlds[0].set_frame_callback(callback)

    def close(self) -> None:
        """Release all worlds."""
        for world in self.worlds:
            world.close()

    def _seed(self) -> int:
        from seals.learn.starts import TRAINING_END

        return int(self._rng.integers(TRAINING_END))

    def _tensor(self, rows: Sequence[Any]) -> Tensor:
        import torch

        return torch.as_tensor(np.stack(rows), dtype=torch.float32, device=self.device)
