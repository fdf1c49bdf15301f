"""Sums over the links of a robot as generalised forces and inertias."""

from __future__ import annotations

from seals.arrays import Array, namespace


def generalised(jacobian: Array, wrench: Array) -> Array:
    """Return the sum of J^T f over the links: J (L, 6, n), f (L, 6), result (n,)."""
    size = jacobian.shape[2]
    return jacobian.reshape(-1, size).T @ wrench.reshape(-1)


def generalised_inertia(matrices: Array, jacobian: Array) -> Array:
    """Return the sum of J^T A J over the links: A (L, 6, 6), J (L, 6, n), result (n, n)."""
    size = jacobian.shape[2]
    rows = namespace(jacobian).matmul(matrices, jacobian).reshape(-1, size)
    return jacobian.reshape(-1, size).T @ rows
