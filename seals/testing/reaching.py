"""Point-reaching environment, for tests of learners."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from seals.learn.batched import StepResult
from seals.pytree import mapped

if TYPE_CHECKING:
    from torch import Tensor

NEAR = 0.1
"""Distance at which the point has arrived [m]."""
STRIDE = 0.1
"""Longest way in one step along each axis [m]."""
REWARD = 5.0
"""On arrival."""


class PointReach:
    """Environment of points in a cube of edge 2 m with targets; actions are steps along the axes.

    The reward is minus the distance, and 5 on arrival, which ends the episode.

    Args:
        count: points at once.
        size: of the picture [pixels]; 0 shows none.
        length: control steps after which an episode is cut off.
        device: of all tensors.
    """

    action_size = 3
    observation_size = 6

    def __init__(
        self, count: int = 1, *, size: int = 0, length: int = 40, device: str = "cpu"
    ) -> None:
        self.count, self.length, self.device = count, length, device
        self.pixels = (6, size, size) if size else None
        self.reset(list(range(count)))

    def reset(self, seeds: Sequence[int] | None = None) -> Any:
        """Reset all environments; without seeds each continues its own random sequence."""
        import torch

        if seeds is not None:
            self._seed = torch.tensor(seeds, dtype=torch.float64, device=self.device)
        else:
            self._seed = self._seed + 0.5
        self._age = torch.zeros(self.count, device=self.device)
        self._state = self._start()
        return self._shown(self._state)

    def _start(self) -> Tensor:
        """Return a low-discrepancy start for each seed.

        The sequence is that of Weyl: evenly spread, and a function of the seed alone.
        """
        import torch

        roots = torch.tensor([2.0, 3.0, 5.0, 7.0, 11.0, 13.0], dtype=torch.float64).sqrt()
        turns = (self._seed[:, None] + 1.0) * roots.to(self.device)
        return ((turns - turns.floor()) * 2.0 - 1.0).float()

    def step(self, action: Tensor) -> StepResult:
        """Move every point."""
        import torch

        place = self._state[:, :3] + STRIDE * action.clamp(-1.0, 1.0)
        final = torch.cat([place, self._state[:, 3:]], 1)
        distance = (place - self._state[:, 3:]).norm(dim=1)
        self._age = self._age + 1.0
        arrived = distance < NEAR
        late = (self._age >= self.length) & ~arrived
        ended = arrived | late
        self._seed = torch.where(ended, self._seed + 0.5, self._seed)
        self._state = torch.where(ended[:, None], self._start(), final)
        self._age = torch.where(ended, 0.0, self._age)
        return StepResult(
            observation=self._shown(self._state),
            reward=REWARD * arrived.float() - distance,
            terminated=arrived,
            truncated=late,
            final=self._shown(final),
            success=arrived,
            facts={"distance": distance},
        )

    def scripted_policy(self) -> Tensor:
        """Return the step straight towards the target."""
        away = self._state[:, 3:] - self._state[:, :3]
        return (away / STRIDE).clamp(-1.0, 1.0)

    def snapshot(self) -> Any:
        """Return the complete state."""
        return {"seed": self._seed, "age": self._age, "state": self._state}

    def restore(self, kept: Any) -> None:
        """Restore a snapshot."""
        self._seed, self._age, self._state = kept["seed"], kept["age"], kept["state"]

    def close(self) -> None:
        """Do nothing: there are no resources."""

    def _shown(self, state: Tensor) -> Any:
        """Return the state, and an image of point and target in three views."""
        import torch

        if self.pixels is None:
            return state.clone()
        size = self.pixels[1]
        grid = torch.linspace(-1.2, 1.2, size, device=self.device)
        views = []
        for across, up in ((0, 1), (0, 2), (1, 2)):
            for first in (0, 3):
                x = (grid - state[:, first + across, None]).square()
                y = (grid - state[:, first + up, None]).square()
                views.append(torch.exp(-(y[:, :, None] + x[:, None, :]) / 0.03))
        pixels = (255.0 * torch.stack(views, 1)).to(torch.uint8)
        return {"state": state.clone(), "pixels": pixels}


def demonstrations(episodes: int, *, size: int = 0) -> Mapping[str, Any]:
    """Return episodes of the scripted policy, for `seals.learn.learner.Agent`.

    Args:
        episodes: how many.
        size: of the picture [pixels]; 0 for none.
    """
    import torch

    environment = PointReach(episodes, size=size)
    observation = environment.reset(list(range(10_000, 10_000 + episodes)))
    running = torch.ones(episodes, dtype=torch.bool)
    found: dict[str, list[Any]] = {}
    while bool(running.any()):
        action = environment.scripted_policy()
        result = environment.step(action)
        row = {
            "observation": observation,
            "action": action,
            "reward": result.reward,
            "next_observation": result.final,
            "terminated": result.terminated,
            "truncated": result.truncated,
            "episode": torch.arange(episodes),
        }
        for key, value in row.items():
            found.setdefault(key, []).append(mapped(value, lambda leaf, on=running: leaf[on]))
        observation = result.observation
        running = running & ~(result.terminated | result.truncated)
    return {
        key: mapped(p[0], lambda *leaves: torch.cat(leaves), *p[1:]) for key, p in found.items()
    }
