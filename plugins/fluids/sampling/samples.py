"""Boundary samples of a solid in a particle fluid, each with the volume it displaces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats


class Samples(NamedTuple):
    """Samples of one solid.

    Args:
        points: [m], shape (b, 3).
        volumes: displaced by each sample [m^3], shape (b,).
        bulk: 1 for samples of thick solids, weighed by area; 0 for those of thin ones, weighed
            by volume; blended between; shape (b,). None for 1.
    """

    points: Floats
    volumes: Floats
    bulk: Floats | None = None

    def placed(self, position: Floats, rotation: Floats) -> Samples:
        """Return the samples in other axes."""
        return self._replace(points=position + self.points @ rotation.T)

    @property
    def thick(self) -> Floats:
        """`bulk` of every sample, shape (b,)."""
        return np.ones(len(self.points)) if self.bulk is None else self.bulk


def joined(parts: Sequence[Samples]) -> Samples:
    """Concatenate several sets of samples.

    Example:
        >>> joined([]).points.shape
        (0, 3)
    """
    points = [part.points for part in parts] or [np.zeros((0, 3))]
    volumes = [part.volumes for part in parts] or [np.zeros(0)]
    bulk = [part.thick for part in parts] or [np.zeros(0)]
    return Samples(np.concatenate(points), np.concatenate(volumes), np.concatenate(bulk))
