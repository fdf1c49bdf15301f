"""Whitened outputs of the windows, marginalised over start states and gusts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats


class Marginal(NamedTuple):
    """Start states and gusts of the windows.

    Args:
        outputs: by each of them, whitened, shape (W, K * ny, q).
        products: of these outputs, shape (W, q, q).
    """

    outputs: Floats
    products: Floats


class Weights(NamedTuple):
    """Normal matrix of start states and gusts, priors included.

    Args:
        scale: that makes its diagonal one, shape (W, q).
        factor: Cholesky factor of the scaled matrix, shape (W, q, q).
        inverse: of the factor, shape (W, q, q).
    """

    scale: Floats
    factor: Floats
    inverse: Floats


@dataclass(frozen=True, kw_only=True)
class Whitened:
    """Whitened outputs of windows, and their projection on start states and gusts.

    Args:
        outputs: shape (W, K * ny, c).
        absorbed: shape (W, q, c).
        cross: products of start states and gusts with the outputs, shape (W, q, c).
    """

    outputs: Floats
    absorbed: Floats
    cross: Floats

    def each(self, change: Callable[..., Floats], *others: Whitened) -> Whitened:
        """Return the result of a function of each of the three arrays, of others beside them."""
        parts = zip(*((w.outputs, w.absorbed, w.cross) for w in (self, *others)), strict=True)
        outputs, absorbed, cross = (change(*part) for part in parts)
        return Whitened(outputs=outputs, absorbed=absorbed, cross=cross)

    def beside(self, other: Whitened) -> Whitened:
        """Return the columns of both side by side."""
        return self.each(lambda *both: np.concatenate(both, axis=2), other)

    def less(self, other: Whitened) -> Whitened:
        """Return the difference column by column."""
        return self.each(np.subtract, other)

    def product(self, other: Whitened) -> Floats:
        """Marginalised inner products with other outputs, shape (W, c, c')."""
        full = np.matmul(self.outputs.transpose(0, 2, 1), other.outputs)
        table: Floats = full - np.matmul(self.absorbed.transpose(0, 2, 1), other.absorbed)
        return table
