"""Recording of episodes of a policy: observations, actions and rewards."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.learn.demonstrations.episode import Episode
from seals.learn.training.scoring import rounds_of

if TYPE_CHECKING:
    from seals.learn.batched import Batched
    from seals.learn.policy import Policy


def record(
    environment: Batched,
    policy: Policy,
    seeds: Sequence[int],
    *,
    noise: float = 0.0,
    labels: Policy | None = None,
    tell: Callable[[int], None] | None = None,
) -> list[Episode]:
    """Run one episode from each seed and record all its steps.

    Args:
        environment: of any count; seeds are taken ``count`` at a time.
        policy: decides.
        seeds: of the starts.
        noise: standard deviation of what is added to the actions; what is kept is the sum, cut to
            -1 to 1, since that is what was done.
        labels: whose actions are kept in place of those that were done, on what was seen; None for
            those that were done.
        tell: takes the number of episodes done.

    Returns:
        Episodes in the order of the seeds.
    """
    kept: list[Episode] = []
    for padded, wanted in rounds_of(seeds, environment.count):
        kept += _round(environment, policy, padded, noise, labels)[:wanted]
        if tell is not None:
            tell(len(kept))
    return kept


def _round(
    environment: Batched, policy: Policy, seeds: list[int], noise: float, labels: Policy | None
) -> list[Episode]:
    """Run one episode in every environment, until all have ended."""
    import torch

    observation = environment.reset(seeds)
    for each in (policy,) if labels is None else (policy, labels):
        each.begin(seeds)
    shake = [np.random.default_rng((seed, 2)) for seed in seeds]
    lasts = np.full(environment.count, -1)
    success = np.zeros(environment.count, dtype=bool)
    rows: list[dict[str, Any]] = []
    seen = [_parts(observation)]
    while (lasts < 0).any():
        action = policy.act(observation)
        if noise > 0.0:
            drawn = np.stack([r.normal(0.0, noise, action.shape[1]) for r in shake])
            action = action + torch.as_tensor(drawn, dtype=action.dtype, device=action.device)
        action = action.clamp(-1.0, 1.0)
        said = action if labels is None else labels.act(observation).clamp(-1.0, 1.0)
        turn = environment.step(action)
        observation = turn.observation
        flags = {n: _plain(getattr(turn, n)) for n in ("terminated", "truncated")}
        rows.append({"action": _plain(said), "reward": _plain(turn.reward), **flags})
        seen.append(_parts(turn.final))
        ended = (flags["terminated"] | flags["truncated"]) & (lasts < 0)
        lasts[ended] = len(rows)
        success[ended] = _plain(turn.success)[ended]
    return [
        _episode(rows[: lasts[k]], seen[: lasts[k] + 1], k, seed=seeds[k], success=bool(success[k]))
        for k in range(environment.count)
    ]


def _episode(
    rows: Sequence[Mapping[str, Any]],
    seen: Sequence[Mapping[str, Any]],
    k: int,
    *,
    seed: int,
    success: bool,
) -> Episode:
    """Return the rows of one environment as an episode."""
    images = [part["pixels"][k] for part in seen if "pixels" in part]
    return Episode(
        observation=np.stack([part["state"][k] for part in seen]).astype(np.float32),
        action=np.stack([row["action"][k] for row in rows]).astype(np.float32),
        reward=np.array([row["reward"][k] for row in rows], dtype=np.float32),
        terminated=np.array([row["terminated"][k] for row in rows], dtype=bool),
        truncated=np.array([row["truncated"][k] for row in rows], dtype=bool),
        success=success,
        seed=seed,
        pixels=np.stack(images) if images else None,
    )


def _parts(observation: Any) -> dict[str, Any]:
    """Copy the numbers and images of an observation."""
    if isinstance(observation, Mapping):
        return {name: _plain(values).copy() for name, values in observation.items()}
    return {"state": _plain(observation).copy()}


def _plain(values: Any) -> Any:
    return values.detach().cpu().numpy()
