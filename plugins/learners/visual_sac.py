"""Soft actor-critic on images: random shifts, one encoder, n-step returns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError, suggestion
from seals.field_roles import roles
from seals.learn import networks
from seals.learn.learner import MOST, Spaces, need_torch, one_of
from seals.plugins.learners.sac import SAC, SacAgent
from seals.schema import count, setting

if TYPE_CHECKING:
    from torch import Generator, Tensor


def random_shift(pixels: Tensor, *, most: int, generator: Generator) -> Tensor:
    """Shift each image by random whole pixels, edges repeated.

    Args:
        pixels: shape (batch, channels, height, width), of any type.
        most: most pixels each way; 0 leaves them as they are.
        generator: source of the draws.

    References:
        Kostrikov et al. 2020, arXiv 2004.13649.
    """
    import torch

    if most == 0:
        return pixels
    batch, _, height, width = pixels.shape
    by = torch.randint(-most, most + 1, (2, batch, 1), generator=generator, device=pixels.device)
    rows = (torch.arange(height, device=pixels.device) + by[0]).clamp(0, height - 1)
    columns = (torch.arange(width, device=pixels.device) + by[1]).clamp(0, width - 1)
    which = torch.arange(batch, device=pixels.device)
    # one index for each axis: an edge that is met again and again repeats itself
    return pixels[which[:, None, None], :, rows[:, :, None], columns[:, None, :]].permute(
        0, 3, 1, 2
    )


NOTHING = ": nothing is left to observe.\nA blind policy has use_pixels=false and use_state=true."
CRITICS = ("same", "state")
ENCODERS = ("one", "two")
SEEN = "Yarats et al. 2021, arXiv 2107.09645"


@roles(data="pool use_pixels use_state critics_see encoders withheld")
@dataclass(kw_only=True)
class VisualSAC(SAC):
    """Soft actor-critic on images, the cameras stacked as channels.

    Pictures are shifted by a few pixels, anew at each update: without it critics on pictures
    overfit. Critics are needed in training only; they may know what a policy has to see for itself,
    and then the encoder learns with the actor. Critics that look at pictures train an encoder, of
    which their slow copies have a slow one; the actor uses it, too, or trains another one.

    Args:
        channels: of each convolution.
        strides: of the convolutions, 3 x 3 pixels each.
        pool: how the last maps become numbers: ``flat``, each value, or ``places``, where a map
            responds most (spatial soft argmax).
        features: numbers that a picture becomes.
        shift: most pixels that a picture is moved by, each way.
        use_pixels: whether the picture is looked at; false makes a blind policy.
        use_state: whether the numbers beside it are.
        critics_see: ``same`` as the policy, or ``state``: all numbers and no picture.
        encoders: of critics that see pictures and their actor: ``one``, or ``two``.
        withheld: numbers that the policy does not see, each by its name or by the first words of
            it, as ``target`` for ``target_x``.

    Limitations:
        Memory holds every picture twice, before and after a step: capacity times 49 kB at
        64 x 64 x 6.

    References:
        Yarats et al. 2021, arXiv 2107.09645 (shifts, encoder, three steps); Pinto et al. 2017,
        arXiv 1710.06542 (critics that see the state); Levine et al. 2016, arXiv
        1504.00702 (places).
    """

    hidden: list[int] = field(default_factory=lambda: [256, 256])
    capacity: int = count(20_000, bounds=(1, MOST))
    batch: int = count(64, bounds=(1, MOST))
    steps: int = count(3, bounds=(1, MOST))
    ratio: float = setting(0.25, "1", bounds=(0.0, 64.0), source="chosen: one CPU core")
    channels: int = count(32, bounds=(1, 4096))
    strides: list[int] = field(default_factory=lambda: [2, 2, 1, 1])
    pool: str = "flat"
    features: int = count(50, bounds=(1, 65_536))
    shift: int = count(4, bounds=(0, 4096))
    use_pixels: bool = True
    use_state: bool = True
    critics_see: str = "same"
    encoders: str = "one"
    withheld: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Refuse unknown words, and a policy that is to see nothing."""
        super().__post_init__()
        one_of("critics_see", self.critics_see, CRITICS)
        one_of("pool", self.pool, networks.POOLS)
        one_of("encoders", self.encoders, ENCODERS)
        if not (self.use_pixels or self.use_state):
            raise ConfigError(f"learner.use_pixels and learner.use_state are both false{NOTHING}")

    def start(self, spaces: Spaces, *, device: str, seed: int) -> VisualSacAgent:
        """Return a fresh agent.

        Raises:
            ConfigError: the task shows no pictures, or has no number of a name that is withheld.
        """
        need_torch()
        if spaces.pixels is None:
            raise ConfigError(
                "learner visual_sac needs pictures, but this task has none.\n"
                "Choose an observation with pixels, or learner=sac"
            )
        return VisualSacAgent(self, spaces, device, seed)


def _remaining_columns(names: Sequence[str], withheld: Sequence[str]) -> list[int] | None:
    """Return the indices of the observations that are given to the policy; None for all.

    Raises:
        ConfigError: there is no such name.

    Example:
        >>> _remaining_columns(["target_x", "target_y", "height"], ["target"])
        [2]
    """
    hidden: set[int] = set()
    for word in withheld:
        found = {k for k, n in enumerate(names) if n == word or n.startswith(f"{word}_")}
        if not found:
            raise ConfigError(
                f"learner.withheld: no number of an observation is named '{word}'.\n"
                f"{suggestion(word, names, label='Names')}"
            )
        hidden |= found
    return [k for k in range(len(names)) if k not in hidden] if withheld else None


class VisualSacAgent(SacAgent):
    """Agent of soft actor-critic with an image encoder."""

    learner: VisualSAC

    def __init__(self, learner: VisualSAC, spaces: Spaces, device: str, seed: int) -> None:
        import torch

        self._remaining = _remaining_columns(spaces.names, learner.withheld)
        if self._remaining == [] and not learner.use_pixels:
            raise ConfigError(
                f"learner.withheld removes all numbers, use_pixels=false the pictures{NOTHING}"
            )
        self._columns = (
            None if self._remaining is None else torch.tensor(self._remaining, device=device)
        )
        super().__init__(learner, spaces, device, seed)

    def _encoder_options(self) -> dict[str, Any]:
        learner = self.learner
        return {
            "shape": [int(size) for size in self.spaces.pixels or ()],
            "channels": learner.channels,
            "strides": [int(stride) for stride in learner.strides],
            "pool": learner.pool,
            "features": learner.features,
            "use_pixels": learner.use_pixels,
            "use_state": learner.use_state,
            "columns": self._remaining,
        }

    def _encoders(self) -> dict[str, Any]:
        learner = self.learner
        if not learner.use_pixels:
            return {}
        names = ["actor"] if learner.critics_see == "state" else ["critics"]
        names += ["actor"] if learner.critics_see == "same" and learner.encoders == "two" else []
        options = self._encoder_options()
        return {name: networks.encoder_of(options).to(self.device) for name in names}

    def _features(self) -> int:
        return networks.features_of(self.spaces.observation_size, self._encoder_options())

    def _augmented(self, observation: Any) -> Any:
        if not self.encoders:
            return observation
        moved = random_shift(
            observation["pixels"], most=self.learner.shift, generator=self.generator
        )
        return {"state": observation["state"], "pixels": moved}

    def _actor_inputs(self, observation: Any) -> Tensor:
        own = self.encoders.get("actor", self.encoders.get("critics"))
        return self._seen(observation, own)

    def _critic_inputs(self, observation: Any, seen: Tensor, *, slow: bool = False) -> Tensor:
        if self.learner.critics_see == "state":
            return self.inputs(observation)
        if not slow and "actor" not in self.encoders:
            return seen
        own = self.nets.slow_encoder if slow else self.encoders.get("critics")
        return self._seen(observation, own)

    def _seen(self, observation: Any, encoder: Any) -> Tensor:
        use_state = self.learner.use_state
        return self.inputs(observation, encoder=encoder, use_state=use_state, columns=self._columns)

    def _critic_input_size(self) -> int | None:
        return self.spaces.observation_size if self.learner.critics_see == "state" else None

    def _described(self) -> dict[str, Any]:
        return {"pixels": self._encoder_options()}
