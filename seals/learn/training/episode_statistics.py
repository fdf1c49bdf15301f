"""Episode statistics between two log rows: means of losses and of finished episodes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from seals.learn.stateful import Stateful

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import StepResult


class EpisodeStatistics(Stateful):
    """Running sums on the device of the environments, read once per log row.

    Args:
        count: environments.
        device: theirs.
    """

    parts = ("returns", "length", "ended")
    plain = ("sums", "updates")

    def __init__(self, count: int, device: str) -> None:
        """Start with empty sums."""
        import torch

        self.returns = torch.zeros(count, dtype=torch.float64, device=device)
        self.length = torch.zeros(count, dtype=torch.float64, device=device)
        self.ended = torch.zeros(4, dtype=torch.float64, device=device)
        self.sums: dict[str, Tensor] = {}
        self.updates = 0

    def step(self, result: StepResult) -> None:
        """Accumulate one step of all environments."""
        import torch

        self.returns += result.reward.double()
        self.length += 1.0
        ended = result.terminated | result.truncated
        weight = ended.double()
        self.ended += torch.stack(
            [
                weight.sum(),
                (weight * result.success.double()).sum(),
                (weight * self.returns).sum(),
                (weight * self.length).sum(),
            ]
        )
        self.returns.masked_fill_(ended, 0.0)
        self.length.masked_fill_(ended, 0.0)

    def update(self, figures: Mapping[str, Tensor]) -> None:
        """Accumulate the statistics of one update."""
        for name, value in figures.items():
            self.sums[name] = self.sums[name] + value if name in self.sums else value
        self.updates += 1

    def row(self) -> dict[str, float | int]:
        """Return the means since the last row and reset the sums; unknown ones are left out."""
        episodes, success, returns, length = self.ended.tolist()
        found: dict[str, float | int] = {"episodes": int(episodes)}
        if episodes:
            found |= {
                "success": success / episodes,
                "return": returns / episodes,
                "length": length / episodes,
            }
        found |= {name: float(value) / self.updates for name, value in self.sums.items()}
        self.ended.zero_()
        self.sums, self.updates = {}, 0
        return found

    def fresh_episodes(self) -> None:
        """Discard the running episodes: they were interrupted."""
        self.returns.zero_()
        self.length.zero_()
