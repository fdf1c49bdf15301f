"""Replay buffer whose first slots hold protected demonstrations.

It is sampled evenly, with a fixed share of demonstrations, or by priority.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError
from seals.learn.batched import picked
from seals.learn.stateful import Stateful
from seals.pytree import mapped

if TYPE_CHECKING:
    from torch import Generator, Tensor


class Sampler(Stateful):
    """Uniform sampling, or a fixed share of demonstrations.

    Args:
        share: of a batch that comes from the protected demonstrations, from 0 to 1; None draws
            demonstrations and experience alike, in proportion to their number.
    """

    protected = 0
    generator: Generator | None = None

    def __init__(self, *, share: float | None = None) -> None:
        """Store the share."""
        self.share = share

    def allocate(self, size: int, device: str) -> None:
        """Do nothing: uniform sampling has no priorities."""

    def update_priorities(self, index: Tensor, error: Tensor) -> None:
        """Do nothing: uniform sampling has no priorities to update."""

    def sample(self, stored: int, count: int) -> tuple[Tensor, Tensor | None]:
        """Return indices (count,) of so many stored transitions, and weights or None."""
        import torch

        kept = self.protected
        draw = functools.partial(
            torch.randint, generator=self.generator, device=_device(self.generator)
        )
        if self.share is None or kept in (0, stored):
            return draw(0, stored, (count,)), None
        shown = round(self.share * count)
        return torch.cat([draw(0, kept, (shown,)), draw(kept, stored, (count - shown,))]), None

    def extend(self, index: Tensor) -> None:
        """Do nothing: uniform sampling keeps no record of transitions."""


class Prioritised(Sampler):
    """Prioritised sampling by temporal-difference error, with a bonus for demonstrations.

    Equation:
        p_i = (|delta_i| / s + epsilon + epsilon_d d_i)^alpha,  P(i) = p_i / sum p
        w_i = (n P(i))^-beta / max_j w_j

    s is a running mean of |delta|: the bonus epsilon_d of demonstrations (d_i = 1) then has the
    same meaning whatever the size of the reward. A new transition has the largest |delta| / s seen
    of late.

    Args:
        alpha: 0 draws all alike, 1 in proportion to the error.
        beta: correction of the bias at first, from 0 to 1; it rises to 1.
        anneal: updates over which it rises.
        epsilon: added to every error, in units of the mean error.
        bonus: added to that of a demonstration, in units of the mean error.

    References:
        Schaul et al. 2016, arXiv 1511.05952; Vecerik et al. 2017, arXiv 1707.08817.
    """

    parts = ("priorities", "largest", "scale")
    plain = ("updates", "weight")
    MEMORY = 0.999
    """Share of the running mean of |delta| that stays from one batch to the next."""

    def __init__(
        self, *, alpha: float, beta: float, anneal: int, epsilon: float, bonus: float
    ) -> None:
        """Store the parameters; priorities are allocated with the first transition."""
        super().__init__()
        self.alpha, self.beta, self.anneal = alpha, beta, anneal
        self.epsilon, self.bonus = epsilon, bonus
        self.priorities: Any = None
        self.updates = 0
        self.weight = 0.0
        self.largest: Any = None
        self.scale: Any = None

    def allocate(self, size: int, device: str) -> None:
        """Allocate the priorities of ``size`` transitions, all zero."""
        import torch

        self.priorities = torch.zeros(size, dtype=torch.float64, device=device)
        self.largest, self.scale = self.priorities.new_ones(()), self.priorities.new_zeros(())

    def sample(self, stored: int, count: int) -> tuple[Tensor, Tensor | None]:
        """Return indices (count,) and their weights, largest 1.

        Running sums of all priorities are made anew for each batch: one pass over the memory, and
        nothing that could drift.
        """
        import torch

        device = _device(self.generator)
        at = torch.rand(count, generator=self.generator, device=device, dtype=torch.float64)
        sums = self.priorities[:stored].cumsum(0)
        index = torch.searchsorted(sums, at * sums[-1], right=True).clamp(max=stored - 1)
        share = self.priorities[index] / sums[-1]
        rise = min(1.0, self.updates / max(self.anneal, 1))
        weight = (stored * share) ** -(self.beta + (1.0 - self.beta) * rise)
        return index, (weight / weight.max()).float()

    def extend(self, index: Tensor) -> None:
        """Give new transitions the largest recent error."""
        self.priorities[index] = self._priority(index, self.largest.expand(index.shape))

    def update_priorities(self, index: Tensor, error: Tensor) -> None:
        """Update the priorities of drawn transitions by their errors (batch,)."""
        import torch

        size = error.detach().double().abs()
        self.scale = self.MEMORY * self.scale + (1.0 - self.MEMORY) * size.mean()
        self.weight = self.MEMORY * self.weight + (1.0 - self.MEMORY)
        scaled = size / (self.scale / self.weight).clamp(min=1e-12)
        self.largest = torch.maximum(scaled.max(), 0.999 * self.largest)
        self.priorities[index] = self._priority(index, scaled)
        self.updates += 1

    def _priority(self, index: Tensor, scaled: Tensor) -> Tensor:
        shown = (index < self.protected).to(scaled.dtype)
        return (scaled + self.epsilon + self.bonus * shown) ** self.alpha


def _device(generator: Generator | None) -> Any:
    return "cpu" if generator is None else generator.device


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


STEP = ("step_reward", "step_discount", "step_next_observation")
"""Columns of the single step, beside those over several."""


class Returns(Stateful):
    """Conversion of steps of many environments to transitions of up to ``length`` steps.

    Equation:
        reward    = sum over k < m of gamma^k r_(t+k)
        discount  = gamma^m, or 0 where the episode was terminated
        next_observation = the observation reached by the last of the m steps

    m is ``length``, or less where the episode ends before. An episode that was truncated could have
    gone on: its discount stays, and ``next_observation`` is the last observation it reached, not
    the first of the next episode. A transition comes out ``length`` - 1 steps after it began, for
    all environments at once, so that the shapes never change.

    Args:
        length: most steps of a transition.
        gamma: discount of one step.
        both: whether the columns of the single step come along.
    """

    plain = ("under_way",)

    def __init__(self, *, length: int, gamma: float, both: bool = False) -> None:
        """Start with an empty window."""
        self.length, self.gamma, self.both = length, gamma, both
        self.under_way: list[dict[str, Any]] = []

    def push(
        self,
        observation: Any,
        action: Tensor,
        *,
        reward: Tensor,
        terminated: Tensor,
        truncated: Tensor,
        final: Any,
    ) -> dict[str, Any] | None:
        """Add one step of N environments; return N transitions once the first are complete.

        Args:
            observation: before the step.
            action: what was done, (N, a).
            reward: of the step, (N,).
            terminated: whether the episode ended for good, (N,).
            truncated: whether it was cut off, (N,).
            final: observation that the step reached, in the same episode.
        """
        import torch

        alive = ~(terminated | truncated)
        discount = self.gamma * (~terminated).to(reward.dtype)
        for item in self.under_way:
            running = item["alive"]
            item["reward"] = item["reward"] + torch.where(
                running, item["discount"] * reward, torch.zeros_like(reward)
            )
            item["discount"] = torch.where(running, item["discount"] * discount, item["discount"])
            item["next_observation"] = picked(final, item["next_observation"], running)
            item["alive"] = running & alive
        begun = {
            "observation": observation,
            "action": action,
            "reward": reward,
            "discount": discount,
            "next_observation": final,
            "alive": alive,
        }
        if self.both:
            begun |= dict(zip(STEP, (reward, discount, final), strict=True))
        self.under_way.append(begun)
        return self._out() if len(self.under_way) == self.length else None

    def drain(self) -> list[dict[str, Any]]:
        """Return the transitions left in the window after the episodes have ended."""
        return [self._out() for _ in range(len(self.under_way))]

    def _out(self) -> dict[str, Any]:
        item = self.under_way.pop(0)
        del item["alive"]
        return item


def of_episodes(columns: Mapping[str, Any], returns: Returns) -> dict[str, Any]:
    """Return all transitions of whole episodes, such as demonstrations, as tensors.

    Args:
        columns: as `seals.learn.learner.Agent.add_demonstrations` takes them, already tensors.
        returns: fresh, of the length and discount wanted; nothing stays under way.
    """
    import torch

    def cat(*leaves: Any) -> Any:
        return torch.cat(leaves)

    episode = columns["episode"]
    found: list[dict[str, Any]] = []
    for number in torch.unique(episode):
        steps = torch.nonzero(episode == number)[:, 0]
        for step in steps:
            at = slice(int(step), int(step) + 1)
            last = bool(step == steps[-1])
            # a demonstration that ends without a word was cut off
            cut = columns["truncated"][at] | (~columns["terminated"][at] if last else False)
            item = returns.push(
                mapped(columns["observation"], lambda leaf, at=at: leaf[at]),
                columns["action"][at],
                reward=columns["reward"][at],
                terminated=columns["terminated"][at],
                truncated=cut,
                final=mapped(columns["next_observation"], lambda leaf, at=at: leaf[at]),
            )
            if item is not None:
                found.append(item)
        found.extend(returns.drain())
    return {key: mapped(found[0][key], cat, *[item[key] for item in found[1:]]) for key in found[0]}
