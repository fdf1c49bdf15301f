"""Episode statistics between two log rows: means of losses and of finished episodes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import StepResult


class EpisodeStatistics:
    """Running sums on the device of the environments, read once per log row.

    Args:
        count: environments.
        device: theirs.
    """

    def __init__(self, count: int, device: str) -> None:
        """Start with empty sums."""
        import torch

        self._returns = torch.zeros(count, dtype=torch.float64, device=device)
        self._length = torch.zeros(count, dtype=torch.float64, device=device)
        self._ended = torch.zeros(4, dtype=torch.float64, device=device)
        self._sums: dict[str, Tensor] = {}
        self._updates = 0

    def step(self, result: StepResult) -> None:
        """Accumulate one step of all environments."""
        import torch

        self._returns += result.reward.double()
        self._length += 1.0
        ended = result.terminated | result.truncated
        weight = ended.double()
        self._ended += torch.stack(
            [
                weight.sum(),
                (weight * result.success.double()).sum(),
                (weight * self._returns).sum(),
                (weight * self._length).sum(),
            ]
        )
        self._returns.masked_fill_(ended, 0.0)
        self._length.masked_fill_(ended, 0.0)

    def update(self, figures: Mapping[str, Tensor]) -> None:
        """Accumulate the statistics of one update."""
        for name, value in figures.items():
            self._sums[name] = self._sums[name] + value if name in self._sums else value
        self._updates += 1

    def row(self) -> dict[str, float | int]:
        """Return the means since the last row and reset the sums; unknown ones are left out."""
        episodes, success, returns, length = self._ended.tolist()
        found: dict[str, float | int] = {"episodes": int(episodes)}
        if episodes:
            found |= {
                "success": success / episodes,
                "return": returns / episodes,
                "length": length / episodes,
            }
        found |= {name: float(value) / self._updates for name, value in self._sums.items()}
        self._ended.zero_()
        self._sums, self._updates = {}, 0
        return found

    def fresh_episodes(self) -> None:
        """Discard the running episodes: they were interrupted."""
        self._returns.zero_()
        self._length.zero_()

    def state(self) -> dict[str, Any]:
        """Return all sums."""
        return {
            "returns": self._returns,
            "length": self._length,
            "ended": self._ended,
            "sums": dict(self._sums),
            "updates": self._updates,
        }

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore that state."""
        self._returns.copy_(state["returns"])
        self._length.copy_(state["length"])
        self._ended.copy_(state["ended"])
        self._sums, self._updates = dict(state["sums"]), int(state["updates"])
