"""Policies by name or folder: trained ones, and the baselines scripted, random and still."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.control.key_events import JOINTS, Event, Stick, held_after, read_track, stick_of
from seals.errors import ConfigError, suggestion
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
        name: ``scripted``, ``random``, ``still``, folder of a trained policy, ``ROBOT/POLICY``
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
        world: Any = environment
        task = world.task
        return PolicyKeys(
            read_track(Path(name)),
            list(task.action_names),
            rate=task.rate,
            device=environment.device,
        )
    from seals.learn.policy import load_policy

    found = load_policy(policy_folder(name, besides=NAMED, key=key), device=device)
    wanted = (environment.observation_size, environment.action_size)
    given = (found.metadata["network"].get("observation"), found.metadata["network"].get("action"))
    if given != wanted:
        raise ConfigError(
            f"{key}={name} takes {given[0]} observations and returns {given[1]} actions; this "
            f"environment has {wanted[0]} and {wanted[1]}.\n"
            "Use the environment of its training; card.json of the policy names it."
        )
    pixels = found.metadata["network"].get("pixels") or {}
    shape = tuple(pixels["shape"]) if pixels.get("use_pixels") else environment.pixels
    if shape != environment.pixels:
        has = "none" if environment.pixels is None else f"those of {environment.pixels}"
        raise ConfigError(
            f"{key}={name} looks at pictures of {shape}, channels, height and width; this "
            f"environment has {has}.\n"
            "Use the environment of its training with its cameras, and backend=twin."
        )
    return found


SUFFIXES = (".yaml", ".yml", ".csv")
"""Of files that are scripts of keys."""
_SHARES = {
    "velocity_x": "forward",
    "velocity_y": "left",
    "velocity_z": "up",
    "yaw_rate": "turn",
    "grip": "grip",
}
"""Parts of a stick by the name of an action."""


class PolicyKeys:
    """Policy that replays keys, the same in each environment.

    Args:
        events: of the keys, in the order of their time.
        names: of the numbers of an action, each one that a stick can give.
        rate: decisions a second [Hz].
        device: of the actions.

    Raises:
        ConfigError: an action is none that a stick can give.
    """

    def __init__(
        self, events: Sequence[Event], names: Sequence[str], *, rate: float, device: str
    ) -> None:
        known = [*_SHARES, *(f"joint_{k + 1}" for k in range(JOINTS))]
        strange = [name for name in names if name not in known]
        if strange or not names:
            raise ConfigError(
                f"keys cannot give the action '{', '.join(strange) or 'without a name'}'.\n"
                f"{suggestion(strange[0] if strange else '', known)}"
            )
        self.events, self.names, self.rate, self.device = list(events), list(names), rate, device
        self._count = self._step = 0

    def begin(self, seeds: Sequence[int]) -> None:
        """Restart the script."""
        self._count, self._step = len(seeds), 0

    def act(self, observation: Any) -> Tensor:
        """Return the action of the keys held now."""
        import torch

        now = self._step / self.rate
        held = held_after({}, [event for event in self.events if event.time <= now + 1e-9])
        self._step += 1
        row = _action_of(stick_of(held), self.names)
        return torch.tensor([row] * self._count, dtype=torch.float32, device=self.device)


def _action_of(stick: Stick, names: Sequence[str]) -> list[float]:
    """Return the action of a stick input.

    Example:
        >>> _action_of(Stick(forward=0.5, joints=(0, -1, 0, 0, 0, 0)), ["velocity_x", "joint_2"])
        [0.5, -1.0]
    """
    joints = {f"joint_{k + 1}": share for k, share in enumerate(stick.joints)}
    shares = {name: getattr(stick, part) for name, part in _SHARES.items()} | joints
    return [float(shares[name]) for name in names]
