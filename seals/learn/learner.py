"""Protocols `Learner` (hyper-parameters, creates an agent) and `Agent` (acts and updates).

A learner plug-in is a keyword-only dataclass of hyper-parameters. The agent that it starts decides
when it updates: the trainer asks how many updates are due and makes them one by one, so that every
learner, on-policy or off-policy, runs in one loop and can be cut off between two updates.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from seals.errors import MissingExtra, refuse_unlisted

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import StepResult


Observation = Any
"""A tensor (N, d), or a mapping with ``state`` (N, d) and ``pixels`` (N, C, H, W) uint8."""
MOST = 10**12
"""Highest number of steps, updates or transitions that may be asked for: no training is longer."""


@dataclass(frozen=True, kw_only=True)
class Spaces:
    """Sizes of observation and action.

    Args:
        observation_size: numbers in an observation; of ``state`` where there are pixels.
        action_size: numbers in an action, each from -1 to 1.
        count: number of parallel environments.
        pixels: channels, height and width of the picture, or None.
        names: of the numbers of an observation; empty where nobody named them.
    """

    observation_size: int
    action_size: int
    count: int = 1
    pixels: tuple[int, int, int] | None = None
    names: tuple[str, ...] = ()


@runtime_checkable
class Agent(Protocol):
    """Agent: acts, stores experience, and updates its networks.

    ``interactive`` is False for agents that learn from demonstrations alone, ``wants`` says whether
    they take demonstrations: ``"no"``, ``"may"`` or ``"must"``. ``reports`` names what `update`
    returns.
    """

    interactive: bool
    wants: str
    reports: tuple[str, ...]

    def add_demonstrations(self, columns: Mapping[str, Any]) -> None:
        """Add demonstrations, before any step.

        Args:
            columns: arrays over all steps of all episodes: ``observation``, ``action``,
                ``reward``, ``next_observation``, ``terminated``, ``truncated``, ``episode``.
        """

    def act(self, observation: Observation, *, explore: bool) -> Tensor:
        """Return actions (N, a) in [-1, 1]."""

    def observe(self, observation: Observation, action: Tensor, result: StepResult) -> None:
        """Store one step of all environments."""

    def due(self) -> int:
        """Return the number of updates to make now."""

    def update(self) -> Mapping[str, Tensor]:
        """Run one update; return its statistics as numbers."""

    def state(self) -> dict[str, Any]:
        """Return the complete state, as nested plain data and tensors.

        Shapes are those of a fresh agent, but below entries ``rows``, where first lengths may grow.
        """

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore what `state` returned."""

    def policy(self) -> tuple[dict[str, Any], dict[str, Tensor]]:
        """Return the deterministic policy: its description in plain data, and its tensors."""


@runtime_checkable
class Advised(Protocol):
    """Further method of agents that ask the task's scripted policy before every step."""

    def advise(self, action: Tensor) -> None:
        """Receive what it would do in the present states, shape (N, a)."""


@runtime_checkable
class Learner(Protocol):
    """Hyper-parameters that start an agent."""

    def start(self, spaces: Spaces, *, device: str, seed: int) -> Agent:
        """Return a fresh agent.

        Args:
            spaces: sizes of observation and action.
            device: of the networks and the memory, ``"cpu"`` or ``"cuda"``.
            seed: of the first weights and of all draws.
        """


def one_of(name: str, value: str, allowed: tuple[str, ...]) -> None:
    """Refuse a value that is not among the allowed ones.

    Raises:
        ConfigError: it is another word.

    Example:
        >>> one_of("reward_form", "plain", ("plain", "symlog"))
    """
    refuse_unlisted(value, allowed, f"learner.{name}={value} is not allowed")


def need_torch() -> None:
    """Raise an error with the missing extra if PyTorch or TorchRL is absent.

    Raises:
        MissingExtra: torch, torchrl or tensordict is not installed.
    """
    try:
        import tensordict  # noqa: F401
        import torch  # noqa: F401
        import torchrl  # noqa: F401
    except ImportError as cause:
        raise MissingExtra(
            f"learning needs {cause.name or cause}, which is not installed.\n"
            "Install it: pip install 'aam-seals[learn]'"
        ) from cause
