"""Collecting beside learning, in one process and in two: ``python benchmarks/collecting.py``.

Twins of ``env=reach`` and updates of TorchRL's SAC on what they give, on two cores: TorchRL's
synchronous collector, whose steps and updates take turns, and its asynchronous one, which steps in
a process of its own. Blocks alternate; frames a second of wall time, the median of all blocks.
"""

from __future__ import annotations

import argparse
import logging
import statistics
import time
from collections.abc import Callable
from typing import Any

import torch  # noqa: TID253  it measures nothing else
from learning_parts import loss_of
from torchrl.collectors import AsyncCollector, Collector
from torchrl.data import LazyTensorStorage, TensorDictReplayBuffer

from seals.envs import torchrl_env
from seals.learn.learner import Spaces
from seals.plugins.learners.sac import SAC

COUNT, STEPS = 1024, 5
"""Twins, and steps of each in a batch."""
FRAMES = COUNT * STEPS
BATCHES = 8
"""Of a block; the first of each, in which a process begins, does not count."""
BLOCKS = 5


def flock() -> Any:
    """Return the twins in whatever process calls."""
    return torchrl_env("SEALS/Reach-v0", COUNT)


def learner(observation: int, action: int) -> tuple[Any, Callable[[Any, int], None]]:
    """Return a policy, and what makes so many updates of SAC after a batch.

    Args:
        observation: numbers that are observed.
        action: numbers of an action.
    """
    spaces = Spaces(observation_size=observation, action_size=action, count=COUNT)
    ours = SAC(normalise=False).start(spaces, device="cpu", seed=0)
    loss, soft = loss_of(ours)
    optimiser = torch.optim.Adam(loss.parameters(), lr=ours.learner.learning_rate, fused=True)
    memory = TensorDictReplayBuffer(storage=LazyTensorStorage(40 * FRAMES), batch_size=256)

    def update(batch: Any, count: int) -> None:
        memory.extend(batch.reshape(-1))
        for _ in range(count):
            found = loss(memory.sample())
            optimiser.zero_grad(set_to_none=True)
            (found["loss_actor"] + found["loss_qvalue"] + found["loss_alpha"]).backward()
            optimiser.step()
            soft.step()

    return loss.actor_network, update


def frames_per_second(collector: Any, update: Callable[[Any, int], None], count: int) -> float:
    """Return the frames a second of wall time of collecting with so many updates a batch."""
    begun = 0.0
    for number, batch in enumerate(collector):
        update(batch, count)
        collector.update_policy_weights_()
        if number == 0:
            begun = time.perf_counter()
    taken = time.perf_counter() - begun
    collector.shutdown()
    return (BATCHES - 1) * FRAMES / taken


def main() -> None:
    """Print the frames a second of both, and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--updates", type=int, default=16, help="after each batch")
    parser.add_argument("--blocks", type=int, default=BLOCKS)
    given = parser.parse_args()
    torch.set_num_threads(1)
    logging.getLogger("torchrl").setLevel(logging.WARNING)
    env = flock()
    seen, said = env.observation_spec["observation"].shape[-1], env.action_spec.shape[-1]
    rates: dict[Any, list[float]] = {Collector: [], AsyncCollector: []}
    for _ in range(given.blocks):
        for kind, found in rates.items():
            policy, update = learner(seen, said)
            there = env if kind is Collector else flock
            collector = kind(
                there,
                policy,
                frames_per_batch=FRAMES,
                total_frames=BATCHES * FRAMES,
                auto_register_policy_transforms=False,
            )
            found.append(frames_per_second(collector, update, given.updates))
    both = [statistics.median(found) for found in rates.values()]
    ratios = [b / a for a, b in zip(*rates.values(), strict=True)]
    print(f"synchronous  {both[0]:8,.0f} frames a second")
    print(f"asynchronous {both[1]:8,.0f} frames a second")
    print(f"ratio {statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})")


if __name__ == "__main__":
    main()
