"""Replay buffer whose first slots hold protected demonstrations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError

if TYPE_CHECKING:
    from torch import Generator, Tensor

    from seals.learn.replay.samplers import Sampler


class Memory:
    """Replay buffer: a ring of experience behind the protected demonstrations, in a TensorDict.

    TorchRL's buffer overwrites demonstrations, and its sum tree is not in every wheel; what this
    one gains in speed: ``benchmarks/learning_parts.py``.

    Args:
        capacity: transitions of experience; the oldest give way. Demonstrations come on top.
        sampler: chooses what is drawn.
        device: where everything lies.
        generator: the only source of random numbers, on ``device``.
    """

    def __init__(
        self, *, capacity: int, sampler: Sampler, device: str, generator: Generator
    ) -> None:
        """Store the sizes; the rows are allocated with the first transition."""
        self.capacity, self.device = capacity, device
        self.sampler = sampler
        self.sampler.generator = generator
        self.protected = self._stored = self._cursor = 0
        self._rows: Any = None

    def __len__(self) -> int:
        """Return the number of transitions, demonstrations included."""
        return self._stored

    @property
    def experience(self) -> int:
        """Return the number of transitions that are not demonstrations."""
        return len(self) - self.protected

    def protect(self, columns: Mapping[str, Any]) -> None:
        """Store demonstrations in the protected slots, before any experience.

        Args:
            columns: tensors, or mappings of tensors, of equal length.

        Raises:
            ConfigError: there is experience already.
        """
        if self._rows is not None:
            raise ConfigError(
                "demonstrations come after experience.\nGive them before the first step."
            )
        rows = self._table(columns)
        self._make(rows, protected=len(rows))
        self._put(rows, 0)

    def add(self, columns: Mapping[str, Any]) -> None:
        """Add a transition of each environment.

        Args:
            columns: tensors, or mappings of tensors, of equal length.

        Raises:
            ConfigError: more rows than the memory has room for.
        """
        rows = self._table(columns)
        if len(rows) > self.capacity:
            raise ConfigError(
                f"learner.capacity={self.capacity} is less than {len(rows)} environments "
                "write in one step.\nAllowed: a multiple of the number of environments."
            )
        if self._rows is None:
            self._make(rows, protected=0)
        self._put(rows, self._cursor)

    def sample(self, count: int) -> Any:
        """Return ``count`` transitions as a TensorDict, with ``index`` and maybe ``weight``."""
        index, weight = self.sampler.sample(self._stored, count)
        batch = self._rows[index]
        batch.set("index", index)
        return batch if weight is None else batch.set("weight", weight)

    def share(self, batch: Any) -> Tensor:
        """Return the fraction of demonstrations in a batch, shape ()."""
        found: Tensor = (batch["index"] < self.protected).float().mean()
        return found

    def update_priorities(self, batch: Any, error: Tensor) -> None:
        """Pass errors (batch,) to a prioritised sampler."""
        self.sampler.update_priorities(batch["index"], error)

    def state(self) -> dict[str, Any]:
        """Return all transitions and the state of the sampler."""
        if self._rows is None:
            return {"protected": 0, "rows": None}
        rows = self._rows[: self._stored]
        if self._stored < len(self._rows):
            # a view of a part would be written with the empty rest behind it
            rows = rows.clone()
        return {
            "protected": self.protected,
            "rows": rows.to_dict(),
            "cursor": self._cursor,
            "sampler": self.sampler.state(),
        }

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore what `state` returned.

        Raises:
            ValueError: it is of another size than this memory can have.
        """
        if state["rows"] is None:
            return
        rows = self._table(state["rows"])
        protected, cursor, size = int(state["protected"]), int(state["cursor"]), len(rows)
        # room is made for the protected rows, and the cursor is where the next one is written
        if not 0 <= protected <= size <= protected + self.capacity or not 0 <= cursor <= size:
            raise ValueError(f"{size} transitions, {protected} of them protected, next at {cursor}")
        self._make(rows, protected=protected)
        self._rows[:size] = rows
        self._stored, self._cursor = size, cursor
        self.sampler.load(state["sampler"])

    def _make(self, rows: Any, *, protected: int) -> None:
        """Allocate rows like those given."""
        size = protected + self.capacity
        self.protected = self.sampler.protected = protected
        self.sampler.allocate(size, self.device)
        self._rows = rows.apply(lambda x: x.new_zeros((size, *x.shape[1:])), batch_size=[size])

    def _put(self, rows: Any, first: int) -> None:
        """Write rows from a slot on, around the ring behind the protected ones."""
        import torch

        count, size = len(rows), len(self._rows)
        index = torch.arange(first, first + count, device=self.device)
        index = torch.where(index < size, index, index - self.capacity)
        self._rows[index] = rows
        self._stored = max(self._stored, min(first + count, size))
        end = first + count
        self._cursor = end if end < size else end - self.capacity
        self.sampler.extend(index)

    def _table(self, columns: Mapping[str, Any]) -> Any:
        """Return columns as a TensorDict on the device."""
        from tensordict import TensorDict

        found = TensorDict(dict(columns), device=self.device)
        found.batch_size = next(iter(found.values(True, True))).shape[:1]
        return found
