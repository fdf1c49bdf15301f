"""Batch environments with image observations next to the state vector."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError
from seals.learn.environments.batch import Environments
from seals.learn.environments.batch_cameras import BatchCameras

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import StepResult


class PixelEnvironments(Environments):
    """Environments whose observations are a mapping of ``state`` and ``pixels``.

    A picture holds the colours of all cameras at this control step and those before: velocities
    cannot be seen in one.

    Args:
        cameras: of the robots.
        frames: control steps in an observation; at a start all of them show it.
        others: those of `Environments`.

    Raises:
        ConfigError: fewer than one.
    """

    def __init__(self, cameras: BatchCameras, frames: int, *others: Any, **named: Any) -> None:
        """Store the size of the pictures."""
        if frames < 1:
            raise ConfigError(f"frames={frames} shows nothing.\nAllowed: 1 or more.")
        super().__init__(*others, **named)
        self.cameras, self._frames = cameras, frames
        channels, height, width = cameras.shape
        self.pixels = (channels * frames, height, width)
        self._film: Any = None

    def reset(self, seeds: Sequence[int] | None = None) -> Any:
        """Reset all environments; see `seals.learn.batched.Batched`."""
        state = super().reset(seeds)
        if seeds is not None:
            self.cameras.seed(seeds[0])
        self._film = self._still(self.cameras.look(self.now))
        return {"state": state, "pixels": self._film}

    def begin_anew(self, rows: Any) -> Any:
        """Restart the episodes of the selected rows, bool (N,); return all observations."""
        import torch

        state = super().begin_anew(rows)
        fresh = torch.as_tensor(rows, device=self._film.device)[:, None, None, None]
        self._film = torch.where(fresh, self._still(self.cameras.look(self.now)), self._film)
        return {"state": state, "pixels": self._film}

    def step(self, action: Tensor) -> StepResult:
        """Step all environments; see `seals.learn.batched.Batched`."""
        import torch

        result = super().step(action)
        image = self.cameras.look(self.reached)
        film = torch.cat([self._film[:, image.shape[1] :], image], 1)
        final = {"state": result.final, "pixels": film}
        ended = (result.terminated | result.truncated)[:, None, None, None]
        if bool(ended.any()):
            film = torch.where(ended, self._still(self.cameras.look(self.now)), film)
        self._film = film
        seen = {"state": result.observation, "pixels": film}
        return result._replace(observation=seen, final=final)

    def snapshot(self) -> Any:
        """Return the complete state, as plain data and tensors."""
        noise = self.cameras.snapshot()
        return {"twins": super().snapshot(), "film": self._film.clone(), "noise": noise}

    def restore(self, kept: Any) -> None:
        """Restore a snapshot of environments of the same settings."""
        super().restore(kept["twins"])
        self._film = kept["film"].to(self.device)
        self.cameras.restore(kept["noise"])

    def close(self) -> None:
        """Release the renderer."""
        self.cameras.close()
        super().close()

    def _still(self, image: Tensor) -> Tensor:
        return image.repeat(1, self._frames, 1, 1)
