"""Conversion between linear light and sRGB values."""

from __future__ import annotations

import functools

import numpy as np
from array_api_compat import device
from numpy.typing import NDArray

from seals.arrays import Array, namespace

STEPS = 1 << 14
"""Length of the table from light to levels."""


def to_srgb(linear: Array) -> Array:
    """Return the sRGB values of linear light, both clipped to 0 to 1.

    References:
        IEC 61966-2-1:1999.

    Example:
        >>> import numpy as np
        >>> to_srgb(np.array([0.0, 0.214041, 2.0])).round(4).tolist()
        [0.0, 0.5, 1.0]
    """
    xp = namespace(linear)
    light = xp.clip(linear, 0.0, 1.0)
    # the root of zero has no slope, and no use either: the straight part covers it
    root = 1.055 * xp.clip(light, 0.0031308, 1.0) ** (1.0 / 2.4) - 0.055
    return xp.where(light <= 0.0031308, 12.92 * light, root)


def to_linear(encoded: Array) -> Array:
    """Return the linear light of sRGB values, both 0 to 1.

    Example:
        >>> import numpy as np
        >>> to_linear(np.array([0.0, 0.5, 1.0])).round(6).tolist()
        [0.0, 0.214041, 1.0]
    """
    xp = namespace(encoded)
    light = xp.clip(encoded, 0.0, 1.0)
    return xp.where(light <= 0.04045, light / 12.92, ((light + 0.055) / 1.055) ** 2.4)


def to_bytes(linear: Array) -> Array:
    """Return linear light as an sRGB image of type uint8.

    Taken from a table of 2^14 steps, within a tenth of a level of the formula before rounding.

    Example:
        >>> import numpy as np
        >>> to_bytes(np.array([0.0, 0.214041, 1.0], dtype=np.float32)).tolist()
        [0, 128, 255]
    """
    xp = namespace(linear)
    table = xp.asarray(_encoded(), device=device(linear))
    light = xp.clip(linear, 0.0, 1.0) * (STEPS - 1.0) + 0.5
    index = xp.reshape(xp.astype(light, xp.int32), (-1,))
    return xp.reshape(xp.take(table, index, axis=0), linear.shape)


@functools.cache
def _encoded() -> NDArray[np.uint8]:
    """Table of sRGB levels over `STEPS` even steps of light."""
    light = np.linspace(0.0, 1.0, STEPS)
    table: NDArray[np.uint8] = np.floor(to_srgb(light) * 255.0 + 0.5).astype(np.uint8)
    return table


def from_bytes(picture: Array, dtype: Array | None = None) -> Array:
    """Return the linear light of an sRGB image of type uint8.

    Args:
        picture: of type uint8, any shape.
        dtype: of the result; float32 when left out.

    Example:
        >>> import numpy as np
        >>> from_bytes(np.array([0, 255], dtype=np.uint8)).tolist()
        [0.0, 1.0]
    """
    xp = namespace(picture)
    kind = xp.float32 if dtype is None else dtype
    steps = xp.astype(xp.arange(256, device=device(picture)), kind) / 255.0
    index = xp.astype(xp.reshape(picture, (-1,)), xp.int64)
    return xp.reshape(xp.take(to_linear(steps), index, axis=0), picture.shape)
