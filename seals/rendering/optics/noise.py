"""Noise of the image sensor: photon shot noise and readout noise."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from array_api_compat import device
from numpy.typing import NDArray

from seals.arrays import Array, namespace


def standard_normal(like: Array, rng: Any) -> Array:
    """Return normal random numbers of the shape, type and device of an array.

    Args:
        like: an array.
        rng: a NumPy generator, which gives the same numbers for every array library, from a table
            of 2^16 quantiles; or a torch generator on the device of a torch array, which is faster
            there.
    """
    xp = namespace(like)
    if isinstance(rng, np.random.Generator):
        count = math.prod(like.shape)
        # four numbers of 16 bits from each of the generator's words
        drawn = rng.bit_generator.random_raw(-(-count // 4)).view(np.uint16)[:count]
        normal = np.take(_quantiles(), drawn).reshape(like.shape)
        return xp.astype(xp.asarray(normal, device=device(like)), like.dtype)
    return xp.randn(*like.shape, generator=rng, dtype=like.dtype, device=device(like))


@functools.cache
def _quantiles() -> NDArray[np.float32]:
    """Quantiles of the normal distribution at the centres of 2^16 equal intervals."""
    from scipy.special import ndtri

    return np.asarray(ndtri((np.arange(1 << 16) + 0.5) / (1 << 16)), dtype=np.float32)


def noisy(light: Array, rng: Any, *, read: float, shot: float) -> Array:
    """Return light with sensor noise, not negative.

    Equation:
        variance = read^2 + shot light.

    Args:
        light: linear, zero or more, one being the sensor's full scale, any shape.
        rng: random state.
        read: standard deviation of the reading in the dark [1].
        shot: one over the number of photons that fill a pixel [1].
    """
    xp = namespace(light)
    deviation = xp.sqrt(light * shot + read * read)
    return xp.clip(light + deviation * standard_normal(light, rng), 0.0, None)
