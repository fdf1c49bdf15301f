"""Array type aliases and the one way to find an array's namespace.

Arrays may come from NumPy, PyTorch or array-api-strict.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any, TypeAlias

import numpy as np
from array_api_compat import array_namespace
from numpy.typing import NDArray

Array: TypeAlias = Any
"""An array of any library that follows the array API; shapes are given in docstrings."""

Floats: TypeAlias = NDArray[np.float64]
"""A NumPy array of float64."""


def namespace(*arrays: Array) -> ModuleType:
    """Return the array-API namespace of the arrays; NumPy is recognised at once.

    Example:
        >>> namespace(np.zeros(3)).__name__
        'numpy'
    """
    if type(arrays[0]) is np.ndarray:
        return np
    found: ModuleType = array_namespace(*arrays)
    return found


def columns(*parts: Array) -> Array:
    """Join vectors of shape (N,) into an array of shape (N, k), stored column by column.

    Column-wise storage keeps every component contiguous, which makes broadcasting a scalar per row
    against a vector per row several times faster for large batches.
    """
    return namespace(*parts).stack(parts, axis=0).T


def as_like(value: Any, like: Array) -> Array:
    """Return ``value`` as an array of the library, type and device of ``like``."""
    if type(like) is np.ndarray:
        return np.asarray(value, dtype=like.dtype)
    xp = namespace(like)
    return xp.asarray(value, dtype=like.dtype, device=like.device)


def column_of(value: Any, like: Array) -> Array:
    """Return a number as an array (1, 1) of the library of ``like``; an array (N, 1) stays."""
    if isinstance(value, int | float):
        return as_like([[value]], like)
    return as_like(value, like)
