"""n-step returns: truncated at the end of an episode, with the bootstrap observation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from seals.learn.observations import picked
from seals.learn.stateful import Stateful
from seals.pytree import mapped

if TYPE_CHECKING:
    from torch import Tensor

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
