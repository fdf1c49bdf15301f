"""Random-shift augmentation of images."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
