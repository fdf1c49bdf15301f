"""Demonstrations played again: their own actions from their own seeds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.learn.demonstrations.episode import Episode
from seals.learn.demonstrations.recording import record


class Played:
    """Policy that does what episodes did, and nothing after their end.

    Args:
        episodes: one in each environment.
    """

    def __init__(self, episodes: Sequence[Episode]) -> None:
        import torch

        longest = max(episode.steps for episode in episodes)
        rows = [np.pad(e.action, ((0, longest - e.steps), (0, 0))) for e in episodes]
        self._rows = iter(torch.as_tensor(np.stack(rows, axis=1)))

    def begin(self, seeds: Sequence[int]) -> None:
        """Do nothing: there is one beginning."""

    def act(self, observation: Any) -> Any:
        """Return the next actions."""
        return next(self._rows)


def replayed(environment: Any, episodes: Sequence[Episode]) -> list[Episode]:
    """Play the actions of episodes from their seeds; return the new episodes."""
    return record(environment, Played(episodes), [episode.seed for episode in episodes])
