"""Denoising of rendered images, by Open Image Denoise where it is installed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]


def denoiser() -> Any:
    """Return pyoidn's ``denoise``, or None where it is not installed or cannot be loaded."""
    try:
        from pyoidn import denoise
    except (ImportError, OSError):
        return None
    return denoise


def cleaned(colour: Image, albedo: Image, normal: Image) -> Image:
    """Return a denoised image; without a denoiser only single bright pixels are removed.

    Args:
        colour: linear, shape (H, W, 3).
        albedo: of what is seen first, 0 to 1.
        normal: of what is seen first.
    """
    denoise = denoiser()
    if denoise is None:
        from scipy.ndimage import median_filter

        # single bright pixels are replaced by the local median
        around = median_filter(colour, size=(3, 3, 1), mode="nearest")
        bright = colour.sum(axis=-1) > 4.0 * (around.sum(axis=-1) + 1e-3)
        return np.where(bright[..., None], around, colour)
    guides = [
        np.ascontiguousarray(np.nan_to_num(x), dtype=np.float32) for x in (colour, albedo, normal)
    ]
    return np.asarray(
        denoise(guides[0], albedo=np.clip(guides[1], 0.0, 1.0), normal=guides[2], hdr=True)
    )
