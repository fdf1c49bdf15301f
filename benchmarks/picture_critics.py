"""What helps critics that see pictures alone: ``python benchmarks/picture_critics.py``.

Points in a cube reach for targets that three small pictures show. A memory of random actions is
learned from, without acting: told is the cosine between the slope of the critics over an action of
zero and the way to the target, which is the best action. One line for each case.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any

POINTS, SIZE, STEPS, SHOWN = 64, 16, 250, 512
PROGRESS = 10.0
"""Reward for each metre that a step came nearer [1/m]."""
NEAR = 3.0
"""Points farther from their target have left the pictures [m]."""
COMMON: dict[str, Any] = {
    "hidden": [128, 128],
    "channels": 8,
    "strides": [2, 1],
    "batch": 128,
    "random_steps": 1_000_000,
    "capacity": 20_000,
    "gamma": 0.95,
    "learning_rate": 1e-3,
    "use_state": False,
    "encoders": "two",
}
CASES: dict[str, tuple[bool, dict[str, Any]]] = {
    "critics on the state": (False, {"critics_see": "state", "shift": 1}),
    "pictures": (False, {"shift": 1}),
    "pictures, not shifted": (False, {"shift": 0}),
    "pictures, reward for progress": (True, {"shift": 1}),
    "pictures, progress, not shifted": (True, {"shift": 0}),
    "pictures, progress, not shifted, places": (True, {"shift": 0, "pool": "places"}),
}
"""Whether progress is rewarded in place of the distance, and words of the learner, by name."""


def agent_of(progress: bool, words: dict[str, Any]) -> Any:
    """Return an agent whose memory holds steps of random actions."""
    from seals.learn.learner import Spaces
    from seals.plugins.learners.visual_sac import VisualSAC
    from seals.testing.reaching import PointReach

    spaces = Spaces(
        observation_size=6,
        action_size=3,
        count=POINTS,
        pixels=(6, SIZE, SIZE),
        names=tuple("abcdef"),
    )
    agent = VisualSAC(**{**COMMON, **words}).start(spaces, device="cpu", seed=0)
    points = PointReach(POINTS, size=SIZE)
    seen = points.reset(list(range(POINTS)))
    for _ in range(STEPS):
        action = agent.act(seen, explore=True)
        result = points.step(action)
        if progress:
            gained = way(seen).norm(dim=1) - result.facts["distance"]
            result = result._replace(reward=PROGRESS * gained + result.terminated.float())
        agent.observe(seen, action, result)
        seen = result.observation
    return agent


def way(seen: Any) -> Any:
    """Return the way from each point to its target [m], shape (N, 3)."""
    return seen["state"][:, 3:] - seen["state"][:, :3]


def cosine(agent: Any) -> float:
    """Return the mean cosine between slopes of the critics and the way to the target."""
    import torch

    seen = agent.memory.sample(SHOWN)["observation"]
    action = torch.zeros(SHOWN, 3, requires_grad=True)
    known = agent._critic_inputs(seen, agent._actor_inputs(seen)).detach()
    (slope,) = torch.autograd.grad(agent.nets.values(known, action).mean(0).sum(), action)
    ahead = way(seen)
    found = torch.nn.functional.cosine_similarity(slope, ahead)
    return float(found[ahead.norm(dim=1) < NEAR].mean())


def main(given: list[str] | None = None) -> int:
    """Learn, and print one line for each case."""
    import torch

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--updates", type=int, default=1500)
    parser.add_argument("--looks", type=int, default=5)
    chosen = parser.parse_args(given)
    torch.set_num_threads(1)
    for name, (progress, words) in CASES.items():
        agent, begin, told = agent_of(progress, words), time.perf_counter(), []
        for number in range(1, chosen.updates + 1):
            agent.update()
            if number % (chosen.updates // chosen.looks) == 0:
                told.append(f"{cosine(agent):.2f}")
        print(f"{name}: {', '.join(told)} ({time.perf_counter() - begin:.0f} s)", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
