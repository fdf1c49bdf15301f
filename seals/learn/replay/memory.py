"""Replay buffer of TorchRL whose first slots hold protected demonstrations."""

from __future__ import annotations

import functools
import logging
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError
from seals.learn.replay.returns import present_names

if TYPE_CHECKING:
    from torch import Generator, Tensor


class Memory:
    """Replay buffer: a ring of experience behind the protected demonstrations.

    Args:
        capacity: transitions of experience; the oldest give way. Demonstrations come on top.
        sampler: from `seals.learn.replay.samplers.as_torchrl_sampler`.
        device: where everything lies.
        generator: the only source of random numbers, on ``device``.
    """

    def __init__(self, *, capacity: int, sampler: Any, device: str, generator: Generator) -> None:
        """Store the sizes; the buffer is allocated with the first transition."""
        self.capacity, self.device = capacity, device
        self.sampler = sampler
        self.sampler.generator = generator
        self.protected = 0
        self._buffer: Any = None

    def __len__(self) -> int:
        """Return the number of transitions, demonstrations included."""
        return 0 if self._buffer is None else len(self._buffer)

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
        if self._buffer is not None:
            raise ConfigError(
                "demonstrations come after experience.\nGive them before the first step."
            )
        count = _length(columns)
        self._make(count)
        self._whole().extend(self._rows(columns))

    def add(self, columns: Mapping[str, Any]) -> None:
        """Add a transition of each environment.

        Args:
            columns: tensors, or mappings of tensors, of equal length.

        Raises:
            ConfigError: more rows than the memory has room for.
        """
        if _length(columns) > self.capacity:
            raise ConfigError(
                f"learner.capacity={self.capacity} is less than {_length(columns)} environments "
                "write in one step.\nAllowed: a multiple of the number of environments."
            )
        self._whole().extend(self._rows(columns))

    def sample(self, count: int) -> Any:
        """Return ``count`` transitions as a TensorDict, with ``index`` and maybe ``weight``."""
        return self._buffer.sample(count)

    def share(self, batch: Any) -> Tensor:
        """Return the fraction of demonstrations in a batch, shape ()."""
        found: Tensor = (batch["index"] < self.protected).float().mean()
        return found

    def update_priorities(self, batch: Any, error: Tensor) -> None:
        """Pass errors (batch,) to a prioritised sampler."""
        self.sampler.update_priorities(batch["index"], error)

    def state(self) -> dict[str, Any]:
        """Return all transitions and the state of the sampler."""
        if self._buffer is None:
            return {"protected": 0, "rows": None}
        rows = self._buffer[:].exclude("index")
        if len(self) < self.protected + self.capacity:
            # a view of a part would be written with the empty rest behind it
            rows = rows.clone()
        return {
            "protected": self.protected,
            "rows": {key: _plain(value) for key, value in rows.items()},
            "cursor": self._buffer.writer.cursor,
            "sampler": dict(self.sampler.state_dict()),
        }

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore what `state` returned.

        Raises:
            ValueError: it is of another size than this memory can have.
        """
        if state["rows"] is None:
            return
        rows = self._rows(present_names(state["rows"]))
        protected, cursor, size = int(state["protected"]), int(state["cursor"]), len(rows)
        # room is made for the protected rows, and the cursor is where the next one is written
        if not 0 <= protected <= size <= protected + self.capacity or not 0 <= cursor <= size:
            raise ValueError(f"{size} transitions, {protected} of them protected, next at {cursor}")
        self._make(protected)
        # the order in the storage is that of the rows, the cursor goes where it was
        self._buffer.writer.fill(rows, cursor)
        self.sampler.load_state_dict(state["sampler"])

    def _whole(self) -> Any:
        """Return the buffer, allocated at the first write."""
        if self._buffer is None:
            self._make(0)
        return self._buffer

    def _make(self, protected: int) -> None:
        from torchrl.data import LazyTensorStorage, TensorDictReplayBuffer

        # it tells every storage that it makes
        logging.getLogger("torchrl").setLevel(logging.WARNING)
        self.protected = self.sampler.protected = protected
        size = protected + self.capacity
        self.sampler.allocate(size, self.device)
        self._buffer = TensorDictReplayBuffer(
            storage=LazyTensorStorage(size, device=self.device),
            sampler=self.sampler,
            writer=_ring_class()(protected=protected),
        )

    def _rows(self, columns: Mapping[str, Any]) -> Any:
        from tensordict import TensorDict

        count = _length(columns)
        return TensorDict(dict(columns), batch_size=[count], device=self.device)


class Ring:
    """Ring writer behind the protected slots.

    Args:
        protected: slots at the front that are written once, all together.
    """

    _storage: Any

    def __init__(self, *, protected: int = 0) -> None:
        """Start at the first unprotected slot."""
        super().__init__()
        self.protected, self.cursor = protected, 0
        self._write_count = 0

    def extend(self, data: Any) -> Tensor:
        """Write rows and return their slots."""
        import torch

        count = len(data)
        room = self._storage.max_size - self.protected
        if self.cursor < self.protected:
            index = torch.arange(count, device=data.device)
            self.cursor = count
        else:
            index = torch.arange(count, device=data.device) + (self.cursor - self.protected)
            index = index % room + self.protected
            self.cursor = (self.cursor - self.protected + count) % room + self.protected
        self._put(index, data)
        return index

    def fill(self, data: Any, cursor: int) -> None:
        """Write all rows from the start, and set the cursor."""
        import torch

        self._put(torch.arange(len(data), device=data.device), data)
        self.cursor = cursor

    def _put(self, index: Tensor, data: Any) -> None:
        data.set("index", index)
        self._storage.set(index, data)
        self._write_count += len(data)

    def add(self, data: Any) -> int:
        """Write one row and return its slot."""
        return int(self.extend(data.unsqueeze(0))[0])

    def state_dict(self) -> dict[str, Any]:
        """Return the cursor."""
        return {"cursor": self.cursor}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Set the cursor."""
        self.cursor = int(state["cursor"])


@functools.cache
def _ring_class() -> type:
    from torchrl.data.replay_buffers.writers import Writer

    def nothing(self: Any, *_: Any, **__: Any) -> None:
        """Keep nothing on disk: the state goes into the checkpoint."""

    return type("WriterRing", (Ring, Writer), dict.fromkeys(("_empty", "dumps", "loads"), nothing))


def _length(columns: Mapping[str, Any]) -> int:
    first = next(iter(columns.values()))
    return _length(first) if isinstance(first, Mapping) else int(first.shape[0])


def _plain(value: Any) -> Any:
    """Turn a TensorDict inside a row into a plain mapping."""
    if hasattr(value, "items"):
        return {key: _plain(child) for key, child in value.items()}
    return value
