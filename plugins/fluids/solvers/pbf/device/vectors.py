"""Field of vectors that kernels read and write as a whole."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.plugins.fluids.solvers.pbf.language import ti


@ti.data_oriented
class Vectors:
    """Field of vectors of single precision.

    Args:
        fields: where it lives.
        width: components of a vector.
        count: number of vectors.

    Limitations:
        The compiler loads every component by itself. Two components in each word of 64 bits were
        slower on a CUDA device by a fifth of a substep.
    """

    def __init__(self, fields: Any, width: int, count: int) -> None:
        self.plain: Any = fields.vector(width, ti.f32, count)

    @ti.func
    def get(self, i) -> Any:
        """Vector number ``i``."""
        return self.plain[i]

    @ti.func
    def set(self, i, v):
        """Write vector number ``i``."""
        self.plain[i] = v

    @ti.func
    def set_last(self, i, x):
        """Write the fourth component of vector number ``i``; the others keep their values."""
        self.plain[i][3] = x

    @ti.func
    def add(self, i, v):
        """Add to vector number ``i``."""
        self.plain[i] += v

    def to_numpy(self) -> NDArray[np.float32]:
        """Copy to the host, shape (count, width)."""
        return np.asarray(self.plain.to_numpy())

    def from_numpy(self, values: NDArray[np.float32]) -> None:
        """Copy from the host, shape (count, width)."""
        self.plain.from_numpy(values)
