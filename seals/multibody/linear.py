"""Solution of many small symmetric linear systems at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg.lapack import dgesv

from seals.arrays import Array, Floats, namespace


def solved(matrix: Floats, right: Floats) -> Floats:
    """Solve one system M x = b, faster than `numpy.linalg.solve`.

    Args:
        matrix: M, float64, shape (n, n).
        right: b, float64, shape (n,) or (n, k).

    Raises:
        numpy.linalg.LinAlgError: M is singular.

    Example:
        >>> solved(np.array([[2.0, 0.0], [0.0, 4.0]]), np.array([2.0, 2.0]))
        array([1. , 0.5])
    """
    if not matrix.size:
        # LAPACK refuses what has no unknowns
        return np.array(right, dtype=np.float64)
    _, _, found, trouble = dgesv(matrix, right)
    if trouble:
        raise np.linalg.LinAlgError("Singular matrix")
    result: Floats = found
    return result


def solution(matrix: Array, right: Array) -> Array:
    """Solve the systems M x = b of a batch, on any array library.

    Args:
        matrix: M, shape (1 or B, n, n).
        right: b, shape (B, n).

    Example:
        >>> solution(np.array([[[2.0, 0.0], [0.0, 4.0]]]), np.array([[2.0, 2.0]]))
        array([[1. , 0.5]])
    """
    if type(matrix) is np.ndarray and len(right) == 1:
        return solved(matrix[0], right[0])[None]
    return namespace(matrix).linalg.solve(matrix, right[:, :, None])[:, :, 0]


class Factors:
    """Cholesky factors of many symmetric systems M x = b, for several right sides in turn.

    Substitution goes entry by entry over the whole batch: a tenth of the time of another
    `numpy.linalg.solve`. Where a matrix is not positive definite, that is what is called.

    Args:
        matrix: M, float64, shape (1 or N, n, n).

    Example:
        >>> Factors(np.array([[[2.0, 0.0], [0.0, 4.0]]])).solve(np.array([[2.0, 2.0]]))
        array([[1. , 0.5]])
    """

    def __init__(self, matrix: Floats) -> None:
        self.matrix = matrix
        self._lower: Floats | None = None
        try:
            factor = np.linalg.cholesky(matrix)
        except np.linalg.LinAlgError:
            return
        size = matrix.shape[1]
        # entry first, batch last: each step of a substitution is one operation on a vector
        by_entry: Floats = np.ascontiguousarray(factor.reshape(-1, size * size).T)
        self._lower = by_entry.reshape(size, size, 1, -1)
        self._inverse: Floats = 1.0 / by_entry[:: size + 1, None]

    def solve(self, right: Floats) -> Floats:
        """Return x for b of the shape (N, n) or (N, n, k), in the same shape."""
        columns = right.reshape(*right.shape[:2], -1)
        if self._lower is None:
            found = np.linalg.solve(self.matrix, columns).astype(np.float64, copy=False)
            return found.reshape(right.shape)
        # L z = b downwards, then L^T x = z upwards; divisions were done once
        lower, inverse = self._lower, self._inverse
        x = columns.transpose(1, 2, 0).copy()
        for i in range(len(x)):
            x[i] *= inverse[i]
            x[i + 1 :] -= lower[i + 1 :, i] * x[i]
        for i in reversed(range(len(x))):
            x[i] *= inverse[i]
            x[:i] -= lower[i, :i] * x[i]
        solution: Floats = x.transpose(2, 0, 1).reshape(right.shape)
        return solution


class LeadFactors:
    """Factors of many symmetric systems of which the leading block changes from one to the next.

    Equation:
        With M = [[A, B], [B^T, D]] and D = L L^T, W = L^-1 B^T, S = A - W^T W: S x = b - W^T L^-1 c
        and L^T y = L^-1 c - W x solve M (x, y) = (b, c) (Schur complement); L and W stay.

    Args:
        matrix: M, float64, shape (N, n, n), with D positive definite.
        lead: rows of A.

    Raises:
        numpy.linalg.LinAlgError: D is not positive definite.
    """

    def __init__(self, matrix: Floats, lead: int) -> None:
        self.lead = lead
        lower = np.linalg.cholesky(matrix[:, lead:, lead:])
        across = matrix[:, lead:, :lead]
        self._lower = np.ascontiguousarray(lower.transpose(1, 2, 0))
        self._inverse: Floats = 1.0 / np.einsum("iik->ik", self._lower)
        # W = L^-1 B^T
        self._weights = self._forward(np.ascontiguousarray(across.transpose(1, 2, 0)))
        taken = np.einsum("jak,jbk->kab", self._weights, self._weights)
        # S = A - W^T W; only A changes afterwards
        self._schur: Floats = matrix[:, :lead, :lead] - taken

    def changed(self, change: Floats) -> ChangedLead:
        """Return the factors with A + change, shape (N, lead, lead)."""
        return ChangedLead(self, Factors(self._schur + change))

    def solve(self, schur: Factors, right: Floats) -> Floats:
        """Return x for b of the shape (N, n, k), by the factors of S."""
        both = right.transpose(1, 2, 0)
        # L^-1 c
        below = self._forward(both[self.lead :].copy())
        reduced = both[: self.lead] - np.einsum("jak,jck->ack", self._weights, below)
        first = schur.solve(reduced.transpose(2, 0, 1)).transpose(1, 2, 0)
        below -= np.einsum("jak,ack->jck", self._weights, first)
        # L^T y = L^-1 c - W x
        for i in reversed(range(len(below))):
            below[i] *= self._inverse[i]
            below[:i] -= self._lower[i, :i, None] * below[i]
        found: Floats = np.concatenate((first, below)).transpose(2, 0, 1)
        return found

    def _forward(self, x: Floats) -> Floats:
        """Substitute forward by L in place, shape (n - lead, k, N)."""
        for i in range(len(x)):
            x[i] *= self._inverse[i]
            x[i + 1 :] -= self._lower[i + 1 :, i, None] * x[i]
        return x


class ChangedLead:
    """Factors of `LeadFactors` with one leading block; solves as `Factors` does."""

    def __init__(self, shared: LeadFactors, schur: Factors) -> None:
        self._shared, self._schur = shared, schur

    def solve(self, right: Floats) -> Floats:
        """Return x for b of the shape (N, n) or (N, n, k), in the same shape."""
        columns = right.reshape(*right.shape[:2], -1)
        return self._shared.solve(self._schur, columns).reshape(right.shape)


def solve_symmetric(
    matrix: Sequence[Sequence[Array | None]], right: Sequence[Array]
) -> list[Array]:
    """Solve M x = b for symmetric positive definite matrices by L D L^T without pivoting.

    Every entry is a vector over the batch, so that the cost is a few hundred vector operations
    whatever the batch: several times faster than one factorisation per matrix.

    Args:
        matrix: lower triangle, ``matrix[i][j]`` for j <= i, each shape (1 or N,); None for an
            entry that is zero in the whole batch.
        right: b, one vector (N,) per row.

    Returns:
        x, one vector (N,) per row.
    """
    size = len(right)
    # pivots d_j = m_jj - sum_k l_jk^2 d_k, columns l_ij d_j = m_ij - sum_k l_ik d_k l_jk (Golub and
    # Van Loan, Matrix Computations, chapter 4); `scaled` keeps l_ij d_j
    lower: list[list[Array | None]] = [[None] * size for _ in range(size)]
    scaled: list[list[Array | None]] = [[None] * size for _ in range(size)]
    inverse: list[Array] = []
    for j in range(size):
        pivot: Array = matrix[j][j]
        for k in range(j):
            pivot = _less(pivot, lower[j][k], scaled[j][k])
        inverse.append(1.0 / pivot)
        for i in range(j + 1, size):
            entry = matrix[i][j]
            for k in range(j):
                entry = _less(entry, lower[i][k], scaled[j][k])
            if entry is not None:
                scaled[i][j], lower[i][j] = entry, entry * inverse[j]
    x: list[Array] = []
    for i in range(size):
        value: Array = right[i]
        for k in range(i):
            value = _less(value, lower[i][k], x[k])
        x.append(value)
    # L z = b is done; D y = z, then L^T x = y
    x = [value * inverse[i] for i, value in enumerate(x)]
    for i in reversed(range(size)):
        for k in range(i + 1, size):
            x[i] = _less(x[i], lower[k][i], x[k])
    return x


def _less(value: Array | None, a: Array | None, b: Array | None) -> Array:
    """Return value - a b, where None stands for zero."""
    if a is None or b is None:
        return value
    return -(a * b) if value is None else value - a * b
