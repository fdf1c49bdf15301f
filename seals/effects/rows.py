"""Rows of links: selection and scattering."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Array, namespace


def rows_of(links: tuple[int, ...], count: int, batch: int) -> Any:
    """Rows of some links in link-by-link order.

    None stands for all; contiguous links make a slice, and so do evenly spaced ones of one robot,
    such as one link of every leg; others make an index array.
    """
    if len(links) == count:
        return None
    if links == tuple(range(links[0], links[0] + len(links))):
        return slice(links[0] * batch, (links[-1] + 1) * batch)
    apart = links[1] - links[0]
    if batch == 1 and apart > 0 and links == tuple(range(links[0], links[-1] + 1, apart)):
        return slice(links[0], links[-1] + 1, apart)
    return np.concatenate([np.arange(k * batch, (k + 1) * batch) for k in links])


def spread(velocity: Array, rows: Any, like: Array) -> Array:
    """Return a flow on some rows as a flow on all rows of ``like``, zero elsewhere."""
    xp = namespace(like)
    index = np.arange(like.shape[0])
    inside = np.zeros((like.shape[0], 1))
    inside[index[rows]] = 1.0
    if velocity.shape[0] == 1:
        return velocity * xp.asarray(inside, dtype=like.dtype)
    source = np.zeros(like.shape[0], dtype=np.int64)
    source[index[rows]] = np.arange(velocity.shape[0])
    return xp.take(velocity, xp.asarray(source), axis=0) * xp.asarray(inside, dtype=like.dtype)
