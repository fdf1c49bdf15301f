"""Scores of a policy from given seeds, episode by episode."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from seals.learn.batched import Batched
    from seals.learn.policy import Policy


class Scores(NamedTuple):
    """Scores of episodes, one row each, in the order of the seeds.

    Args:
        seed: of the start, shape (episodes,).
        success: whether it succeeded, bool.
        returns: sum of the rewards.
        length: control steps.
        facts: facts of the last step, by name.
    """

    seed: NDArray[np.int64]
    success: NDArray[np.bool_]
    returns: NDArray[np.float64]
    length: NDArray[np.int64]
    facts: dict[str, NDArray[np.float64]]


def score(
    environment: Batched,
    policy: Policy,
    seeds: Sequence[int],
    *,
    tell: Callable[[int], None] | None = None,
) -> Scores:
    """Run one episode from each seed and return their scores.

    The environments step together; one that is done goes on unheard until all are.

    Args:
        environment: of any count; seeds are taken ``count`` at a time.
        policy: decides without chance.
        seeds: of the starts.
        tell: takes the number of episodes done.
    """
    rounds: list[Scores] = []
    for padded, wanted in rounds_of(seeds, environment.count):
        rounds.append(_round(environment, policy, padded, wanted))
        if tell is not None:
            tell(min(len(rounds) * environment.count, len(seeds)))
    return Scores(
        seed=np.array(seeds, dtype=np.int64),
        success=np.concatenate([each.success for each in rounds]),
        returns=np.concatenate([each.returns for each in rounds]),
        length=np.concatenate([each.length for each in rounds]),
        facts={
            name: np.concatenate([each.facts[name] for each in rounds]) for name in rounds[0].facts
        },
    )


def rounds_of(seeds: Sequence[int], count: int) -> Iterator[tuple[list[int], int]]:
    """Yield seeds for all of so many environments, and how many of them were requested.

    The last round may be short: its spare environments repeat a start and do not count.

    Example:
        >>> list(rounds_of([5, 6, 7], 2))
        [([5, 6], 2), ([7, 7], 1)]
    """
    for first in range(0, len(seeds), count):
        wanted = list(seeds[first : first + count])
        yield wanted + [wanted[-1]] * (count - len(wanted)), len(wanted)


def _round(environment: Batched, policy: Policy, seeds: list[int], counted: int) -> Scores:
    import torch

    observation = environment.reset(seeds)
    policy.begin(seeds)
    running = torch.ones(environment.count, dtype=torch.bool, device=environment.device)
    success = torch.zeros_like(running)
    returns = torch.zeros(environment.count, dtype=torch.float64, device=environment.device)
    length = torch.zeros(environment.count, dtype=torch.int64, device=environment.device)
    facts: dict[str, Any] = {}
    while bool(running.any()):
        result = environment.step(policy.act(observation))
        observation = result.observation
        returns += torch.where(running, result.reward.double(), 0.0)
        length += running
        ended = running & (result.terminated | result.truncated)
        success |= ended & result.success
        for name, value in result.facts.items():
            # of episodes that still run
            facts[name] = torch.where(running, value.float(), facts.get(name, value.float()))
        running = running & ~ended

    def column(values: Any) -> Any:
        return values[:counted].cpu().numpy()

    return Scores(
        seed=np.array(seeds[:counted], dtype=np.int64),
        success=column(success),
        returns=column(returns),
        length=column(length),
        facts={name: column(values).astype(np.float64) for name, values in facts.items()},
    )
