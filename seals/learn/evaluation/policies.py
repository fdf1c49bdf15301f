"""Policies by name or folder: trained ones, and the baselines scripted, random and still."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.errors import ConfigError
from seals.learn.evaluation.keys import SUFFIXES, policy_of_keys
from seals.learn.shipped import policy_folder

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import Batched
    from seals.learn.policy import Policy

SCRIPTED, RANDOM, STILL = "scripted", "random", "still"
NAMED = (SCRIPTED, RANDOM, STILL)


class PolicyScripted:
    """Scripted policy of the task; it reads the full state.

    Args:
        environment: in which it acts.
    """

    def __init__(self, environment: Batched) -> None:
        self.environment = environment

    def begin(self, seeds: Sequence[int]) -> None:
        """Do nothing: the scripted policy has no memory."""

    def act(self, observation: Any) -> Tensor:
        """Return the actions of the scripted policy."""
        return self.environment.scripted_policy()


class PolicyRandom:
    """Uniform random actions, determined by each episode's seed.

    Args:
        size: numbers in an action.
        device: of the actions.
        most: largest action; 0 for none at all.
    """

    def __init__(self, size: int, device: str, *, most: float = 1.0) -> None:
        self.size, self.device, self.most = size, device, most
        self._random: list[np.random.Generator] = []

    def begin(self, seeds: Sequence[int]) -> None:
        """Seed a random generator for every episode."""
        self._random = [np.random.default_rng((seed, 1)) for seed in seeds]

    def act(self, observation: Any) -> Tensor:
        """Return the next random actions."""
        import torch

        drawn = np.stack(
            [random.uniform(-self.most, self.most, self.size) for random in self._random]
        )
        return torch.as_tensor(drawn, dtype=torch.float32, device=self.device)


def policy_of(name: str, environment: Batched, *, device: str, key: str = "policy") -> Policy:
    """Return a policy by its name, or from its folder.

    Args:
        name: ``scripted``, ``random``, ``still``, a folder that training wrote, ``ROBOT/POLICY``
            of one that is shipped, or a script of keys (YAML or CSV).
        environment: in which it shall act.
        device: where its network computes.
        key: by which it was asked for, for the words of a refusal.

    Raises:
        ConfigError: there is no such policy, or it belongs to another kind of environment.
    """
    if name == SCRIPTED:
        return PolicyScripted(environment)
    if name == RANDOM:
        return PolicyRandom(environment.action_size, environment.device)
    if name == STILL:
        return PolicyRandom(environment.action_size, environment.device, most=0.0)
    if Path(name).is_file() and Path(name).suffix in SUFFIXES:
        return policy_of_keys(Path(name), environment)
    from seals.learn.policy import load_policy

    found = load_policy(policy_folder(name, besides=NAMED, key=key), device=device)
    wanted = (environment.observation_size, environment.action_size)
    given = (found.metadata["network"].get("observation"), found.metadata["network"].get("action"))
    if given != wanted:
        raise ConfigError(
            f"{key}={name} sees {given[0]} numbers and says {given[1]}; here there are "
            f"{wanted[0]} and {wanted[1]}.\n"
            "Judge it in its own environment: the card.json says which."
        )
    return found
