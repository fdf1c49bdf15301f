"""Sum tree: sampling in proportion to weights, and updates, in logarithmic time."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torch import Tensor

FANOUT = 64
"""Children of a node: three levels hold 262,144 weights, four hold 16.8 million."""


class SumTree:
    """Sum tree of fan-out FANOUT; a batch is drawn with one pass per level.

    Sums are made anew from their children, never by differences: they cannot drift.

    Args:
        size: number of weights, all zero at first.
        device: where they lie.

    Example:
        >>> import pytest
        >>> torch = pytest.importorskip("torch")
        >>> tree = SumTree(3)
        >>> tree.put(torch.tensor([0, 2]), torch.tensor([1.0, 3.0]))
        >>> float(tree.total), tree.draw(torch.tensor([0.5, 1.5])).tolist()
        (4.0, [0, 2])
    """

    def __init__(self, size: int, device: str = "cpu") -> None:
        """Allocate the weights."""
        import torch

        self.size = size
        self.levels: list[Tensor] = []
        width = size
        while True:
            blocks = -(-width // FANOUT)
            self.levels.append(torch.zeros((blocks, FANOUT), dtype=torch.float64, device=device))
            if blocks == 1:
                break
            width = blocks

    @property
    def total(self) -> Tensor:
        """Return the sum of all weights, shape ()."""
        return self.levels[-1].cumsum(-1)[0, -1]

    def get(self, index: Tensor) -> Tensor:
        """Return the weights at ``index``."""
        return self.levels[0].reshape(-1)[index]

    def put(self, index: Tensor, weight: Tensor) -> None:
        """Set the weights at ``index``; for a repeated index one of its weights is kept."""
        value = weight.to(self.levels[0].dtype)
        for level in self.levels:
            level.view(-1)[index] = value
            index = index // FANOUT
            # the last of the running sums, not sum(): `draw` compares with these very numbers
            value = level[index].cumsum(-1)[:, -1]

    def draw(self, at: Tensor) -> Tensor:
        """Return the index whose interval of the cumulative sum contains each value.

        Args:
            at: values from 0 on, below `total`, shape (batch,).
        """
        import torch

        left = at.to(self.levels[0].dtype)
        index = torch.zeros_like(at, dtype=torch.long)
        for level in reversed(self.levels):
            children = level[index]
            sums = children.cumsum(-1)
            # rounding may leave a value at the very end of its block
            left = torch.minimum(left, sums[:, -1] * (1.0 - 1e-15))
            child = (sums <= left[:, None]).sum(-1).clamp(max=FANOUT - 1)
            before = torch.where(
                child > 0, sums.gather(1, (child - 1).clamp(min=0)[:, None])[:, 0], 0.0
            )
            left = left - before
            index = index * FANOUT + child
        return index

    def leaves(self) -> Tensor:
        """Return all weights, shape (size,)."""
        return self.levels[0].reshape(-1)[: self.size].clone()

    def fill(self, weights: Tensor) -> None:
        """Set all weights and their sums."""
        import torch

        value = weights.to(self.levels[0])
        for level in self.levels:
            flat = torch.zeros_like(level).reshape(-1)
            flat[: len(value)] = value
            level.copy_(flat.reshape(level.shape))
            value = level.cumsum(-1)[:, -1]
