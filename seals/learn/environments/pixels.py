"""Batch environments with image observations next to the state vector."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError
from seals.learn.environments.batch import Environments
from seals.learn.environments.batch_cameras import BatchCameras
from seals.learn.environments.episode_frame import FrameCallback

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import StepResult


class PixelEnvironments:
    """Environments whose observations are a mapping of ``state`` and ``pixels``.

    A picture holds the colours of all cameras at this control step and those before: velocities
    cannot be seen in one.

    Args:
        batch: the environments.
        cameras: their cameras.
        frames: control steps in an observation; at a start all of them show it.

    Raises:
        ConfigError: fewer than one.
    """

    def __init__(self, batch: Environments, cameras: BatchCameras, *, frames: int) -> None:
        """Store the sizes of the environments."""
        if frames < 1:
            raise ConfigError(f"frames={frames} shows nothing.\nAllowed: 1 or more.")
        self.batch, self.cameras, self._frames = batch, cameras, frames
        self.count, self.device = batch.count, batch.device
        self.observation_size, self.action_size = batch.observation_size, batch.action_size
        channels, height, width = cameras.shape
        self.pixels: tuple[int, int, int] | None = (channels * frames, height, width)
        self.task = batch.task
        self._film: Any = None

    def reset(self, seeds: Sequence[int] | None = None) -> Any:
        """Reset all environments; see `seals.learn.batched.Batched`."""
        state = self.batch.reset(seeds)
        if seeds is not None:
            self.cameras.seed(seeds[0])
        self._film = self._still(self.cameras.look(self.batch.now))
        return self._observed(state, self._film)

    def step(self, action: Tensor) -> StepResult:
        """Step all environments; see `seals.learn.batched.Batched`."""
        import torch

        result = self.batch.step(action)
        image = self.cameras.look(self.batch.reached)
        film = torch.cat([self._film[:, image.shape[1] :], image], 1)
        final = self._observed(result.final, film)
        ended = (result.terminated | result.truncated)[:, None, None, None]
        if bool(ended.any()):
            film = torch.where(ended, self._still(self.cameras.look(self.batch.now)), film)
        self._film = film
        return result._replace(observation=self._observed(result.observation, film), final=final)

    def scripted_policy(self) -> Tensor:
        """Return the actions of the task's scripted policy, which needs no images."""
        return self.batch.scripted_policy()

    @property
    def now(self) -> Any:
        """Present state of all robots."""
        return self.batch.now

    def snapshot(self) -> Any:
        """Return the complete state, as plain data and tensors."""
        return {
            "twins": self.batch.snapshot(),
            "film": self._film.clone(),
            "noise": self.cameras.snapshot(),
        }

    def restore(self, kept: Any) -> None:
        """Restore a snapshot of environments of the same settings."""
        self.batch.restore(kept["twins"])
        self._film = kept["film"].to(self.device)
        self.cameras.restore(kept["noise"])

    def set_frame_callback(self, callback: FrameCallback | None) -> None:
        """Set a callback that receives the first robot's frame after each control step, or None."""
        self.batch.set_frame_callback(callback)

    def close(self) -> None:
        """Release the renderer."""
        self.cameras.close()
        self.batch.close()

    def _still(self, image: Tensor) -> Tensor:
        return image.repeat(1, self._frames, 1, 1)

    @staticmethod
    def _observed(state: Tensor, film: Tensor) -> dict[str, Tensor]:
        return {"state": state, "pixels": film}
