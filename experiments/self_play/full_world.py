"""Games in full worlds: rigid bodies, contacts, and a crab that walks by its gait."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.experiments.self_play.pursuit import HUNTER, PREY, Pursuit, seen_by
from seals.learn.environments.episodes import Episodes
from seals.learn.policy import Policy
from seals.learn.starts import held_out_seeds
from seals.learn.task import Instant


def full_games(
    pairs: Sequence[tuple[int, int]],
    hunters: Sequence[Policy],
    prey: Sequence[Policy],
    *,
    starts: int,
) -> dict[str, NDArray[np.int64]]:
    """Play pairs from the same held-out starts in worlds of MuJoCo.

    The hand stays open; who is caught is decided as in batch dynamics.

    Args:
        pairs: numbers of hunter and prey.
        hunters: by their numbers.
        prey: likewise.
        starts: of each pair.
    """
    import torch

    from seals.envs import parallel_env

    task = Pursuit(HUNTER, count=1).game
    words = [f"task.{k}={list(getattr(task, k))}" for k in ("start_low", "start_high", "arm")]
    words += [f"task.duration={task.duration}", "initial.drives=rest", "backend.compiled=true"]
    world = parallel_env("catch_fleeing", backend="mujoco", overrides=words, speed=task.pace)
    episodes, rows = Episodes(task), []
    for start in held_out_seeds(starts):
        for h, p in pairs:
            world.reset(seed=start)
            now = _above(world.now, np.zeros(3), task.over)
            ledger, caught, steps = episodes.start(now), False, 0
            while world.agents and not caught:
                seen = {r: torch.as_tensor(seen_by(r, task, now)).float() for r in (HUNTER, PREY)}
                hand = hunters[h].act(seen[HUNTER])[0].numpy()
                legs = prey[p].act(seen[PREY])[0].numpy()
                world.step({"robot": np.append(hand, 0.0), "crab": legs})
                before, now = now, _above(world.now, hand, task.over)
                verdict, ledger = episodes.assess(now, before, ledger)
                caught, steps = bool(verdict.success[0]), steps + 1
            rows.append((h, p, start, int(caught), steps))
    world.close()
    names = (HUNTER, PREY, "start", "caught", "steps")
    columns = zip(*rows, strict=True)
    return {name: np.array(x, dtype=np.int64) for name, x in zip(names, columns, strict=True)}


def _above(now: Instant, action: Floats, over: float) -> Instant:
    """Return the state as `TaskPursuit` has it: the point above the prey, no grip."""
    return now._replace(target=now.target + np.array([0.0, 0.0, over]), action=action[None])
