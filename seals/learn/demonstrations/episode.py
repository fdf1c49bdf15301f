"""One demonstrated episode, and many of them with their metadata."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from seals.errors import LogError, SealsError

Singles: TypeAlias = NDArray[np.float32]
Flags: TypeAlias = NDArray[np.bool_]
Pixels: TypeAlias = NDArray[np.uint8]


class Who(Enum):
    """Source of the actions of a demonstration: a program or a person."""

    scripted = "scripted"
    """A program: an expert written by hand, or a trained policy."""
    human = "human"
    """A person at a keyboard or a stick."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Episode:
    """Observations, actions and rewards of one episode.

    Args:
        observation: before every step and after the last, shape (steps + 1, observation_size).
        action: as applied, in -1 to 1, shape (steps, action_size).
        reward: of each step, shape (steps,).
        terminated: whether the episode ended itself at a step, shape (steps,).
        truncated: whether it was cut off at a step, shape (steps,).
        success: whether it reached what was asked.
        seed: of its start.
        pixels: images beside the observation, shape (steps + 1, channels, height, width).

    Raises:
        LogError: shapes do not fit, a value is not finite, or the end is not the last step.
    """

    observation: Singles
    action: Singles
    reward: Singles
    terminated: Flags
    truncated: Flags
    success: bool
    seed: int
    pixels: Pixels | None = None

    def __post_init__(self) -> None:
        steps = self.steps
        wanted = {
            "observation": (steps + 1, *self.observation.shape[1:2]),
            "action": (steps, *self.action.shape[1:2]),
            "reward": (steps,),
            "terminated": (steps,),
            "truncated": (steps,),
        }
        for name, shape in wanted.items():
            found = getattr(self, name).shape
            if found != shape or steps < 1 or len(shape) < getattr(self, name).ndim:
                raise LogError(
                    f"episode of seed {self.seed}: '{name}' has the shape {found}.\n"
                    f"Allowed beside {steps} actions: {shape}, and at least one step"
                )
        if self.pixels is not None and (self.pixels.ndim != 4 or len(self.pixels) != steps + 1):
            raise LogError(
                f"episode of seed {self.seed}: 'pixels' has the shape {self.pixels.shape}.\n"
                f"Allowed: ({steps + 1}, channels, height, width)"
            )
        for name in ("observation", "action", "reward"):
            if not np.isfinite(getattr(self, name)).all():
                raise LogError(
                    f"episode of seed {self.seed}: '{name}' holds a value that is not finite.\n"
                    "Record it again."
                )
        ends = np.flatnonzero(self.terminated | self.truncated)
        if ends.tolist() != [steps - 1]:
            raise LogError(
                f"episode of seed {self.seed} ends at steps {ends.tolist()[:4]} of {steps}.\n"
                "Allowed: terminated or truncated at the last step, and nowhere else"
            )

    @property
    def steps(self) -> int:
        """Number of actions."""
        return len(self.action)

    @property
    def earned(self) -> float:
        """Sum of the rewards of the episode."""
        return float(self.reward.sum(dtype=np.float64))


@dataclass(frozen=True, kw_only=True)
class Origin:
    """Provenance of demonstrations.

    Args:
        env: the environment's id or name.
        config_hash: of its configuration, as `seals.learn.metadata.config_hash` makes it.
        who: a person or a program.
        by: the program's or the session's name.
        observation: names of the observation's columns; empty if they have none.
        action: names of the action's columns; empty if they have none.
        rate: decisions a second [Hz].
        config: the configuration itself, plain values.
        tried: episodes that were tried for those that were kept; 0 where nobody counted.
    """

    env: str
    config_hash: str
    who: Who
    by: str = ""
    observation: tuple[str, ...] = ()
    action: tuple[str, ...] = ()
    rate: float = 0.0
    config: Mapping[str, Any] = field(default_factory=dict)
    tried: int = 0


@dataclass(frozen=True, kw_only=True, eq=False)
class Demonstrations:
    """Episodes of one environment.

    Args:
        origin: where they come from.
        episodes: at least one; all of one size.

    Raises:
        LogError: there is none, or sizes differ between episodes or from the names.
    """

    origin: Origin
    episodes: Sequence[Episode]

    def __post_init__(self) -> None:
        if not self.episodes:
            raise LogError("there are no demonstrations.\nRecord some: seals record episodes=10")
        sizes = {
            (e.observation.shape[1], e.action.shape[1], e.pixels is not None and e.pixels.shape[1:])
            for e in self.episodes
        }
        if len(sizes) > 1:
            raise LogError(
                "episodes of different sizes cannot be stored together: "
                f"{sorted(map(str, sizes))}.\n"
                "Record them in one environment."
            )
        both = (self.origin.observation, self.origin.action)
        for names, size in zip(both, self.sizes, strict=True):
            if names and len(names) != size:
                raise LogError(
                    f"{len(names)} names stand for {size} columns: {', '.join(names[:8])}.\n"
                    "Give one name for each column, or none."
                )

    @property
    def sizes(self) -> tuple[int, int]:
        """Sizes of observation and action."""
        first = self.episodes[0]
        return first.observation.shape[1], first.action.shape[1]

    @property
    def steps(self) -> int:
        """Number of actions of all episodes together."""
        return sum(episode.steps for episode in self.episodes)

    def transitions(self) -> dict[str, NDArray[Any]]:
        """Return the steps of all episodes concatenated, for replay buffers.

        Returns:
            ``observation``, ``action``, ``reward``, ``next_observation``, ``terminated``,
            ``truncated`` and ``episode``, the number of the episode; with images ``pixels`` and
            ``next_pixels``, too. The first axis is the step, shape (steps, ...).
        """
        every = self.episodes
        out: dict[str, NDArray[Any]] = {
            "observation": np.concatenate([e.observation[:-1] for e in every]),
            "action": np.concatenate([e.action for e in every]),
            "reward": np.concatenate([e.reward for e in every]),
            "next_observation": np.concatenate([e.observation[1:] for e in every]),
            "terminated": np.concatenate([e.terminated for e in every]),
            "truncated": np.concatenate([e.truncated for e in every]),
            "episode": np.repeat(np.arange(len(every)), [e.steps for e in every]),
        }
        images = [e.pixels for e in every if e.pixels is not None]
        if images:
            out["pixels"] = np.concatenate([image[:-1] for image in images])
            out["next_pixels"] = np.concatenate([image[1:] for image in images])
        return out

    def first(self, count: int) -> Demonstrations:
        """Return the first episodes.

        Raises:
            SealsError: there are fewer.
        """
        if not 1 <= count <= len(self.episodes):
            raise SealsError(
                f"{count} of {len(self.episodes)} demonstrations are requested.\n"
                f"Allowed: 1 to {len(self.episodes)}"
            )
        return dataclasses.replace(self, episodes=self.episodes[:count])

    def shuffled(self, *, seed: int) -> Demonstrations:
        """Return the same episodes with the actions permuted among all steps, as a control.

        A negative control: what is left of the gain from such demonstrations is not from what they
        show. Observations, rewards and ends stay.
        """
        deal = np.random.default_rng(seed).permutation(self.steps)
        actions = np.concatenate([e.action for e in self.episodes])[deal]
        cuts = np.cumsum([e.steps for e in self.episodes])[:-1]
        parts = np.split(actions, cuts)
        pairs = zip(self.episodes, parts, strict=True)
        return dataclasses.replace(
            self, episodes=[dataclasses.replace(e, action=a) for e, a in pairs]
        )
