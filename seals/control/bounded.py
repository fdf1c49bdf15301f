"""Weighted least squares within bounds by an active-set search, row by row on any array library."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Array, Floats, columns, doubt, iterate, namespace, rounds_enough, unasked
from seals.multibody.linear import solution, solve_symmetric

ROUNDS = 24
"""Most changes of the active set, a drive; four or five in all are usual."""
AHEAD = 5
"""Changes a drive where numbers are not asked for, all of them always made: nobody waits to see
whether more are needed. Of 100,000 wrenches, most of them far beyond the drives, all (four drives)
and 99.95 % (six) are settled by then; commands of the rest are within their bounds, and not the
best ones."""
SOFT = 1e-9
"""Stiffness that makes the choice among equally good commands unique, share of the whole."""
BEYOND = 1e-12
"""What counts as beyond a bound, share of the span between bounds."""


class Search(NamedTuple):
    """State of the active-set search, row by row.

    Args:
        h: quadratic form, shape (B, n, n).
        soft: the same with a little more on its diagonal.
        g: linear form, shape (B, n).
        bound: the bound that each share is at or nearest to, shape (B, n).
        free: 1 where a share is at none, shape (B, n).
        fewest: wrong shares at best so far, shape (B,).
        patience: rounds that may pass without fewer of them, shape (B,).
    """

    h: Array
    soft: Array
    g: Array
    bound: Array
    free: Array
    fewest: Array
    patience: Array


def best_within(a: Array, wrench: Array, low: Array, high: Array, weights: Array) -> Array:
    """Return the solutions of weighted least squares A u = w with low <= u <= high, shape (B, n).

    The active set changes by blocks of all drives that break a limit or pull off one; when that
    does not settle, one drive at a time, which always does (Judice and Pires 1992). On a processor
    rows that have found theirs leave the search.

    Args:
        a: shape (B, rows, n).
        wrench: wanted, shape (B, rows).
        low: shape (B, n).
        high: above low, shape (B, n).
        weights: of the rows, shape (rows,); each row counts against the most that it can do.
    """
    h, g, span = weighted(a, wrench, low, high, weights)
    xp, now, count = namespace(h), begun(h, g), g.shape[1]
    if type(g) is np.ndarray:
        x = _row_by_row(now)
    else:
        ahead, enough = unasked(g), rounds_enough()
        rounds = enough or (AHEAD if ahead else ROUNDS) * count
        _, x, wrong = iterate(_turned, (now, g * 0.0, g * 0.0 < 1.0), rounds, _settled)
        if enough is not None:
            doubt(xp.any(wrong))
    return low + xp.minimum(xp.maximum(x, x * 0.0), x * 0.0 + 1.0) * span


def weighted(
    a: Array, wrench: Array, low: Array, high: Array, weights: Array
) -> tuple[Array, Array, Array]:
    """Return quadratic form, linear form and spans of `best_within`, which has the arguments."""
    xp = namespace(wrench)
    # in shares of each drive's range and of each row's reach: numbers near one
    span = high - low
    scaled = a * span[:, None, :]
    reach = xp.sum(xp.abs(scaled), axis=2)
    weight = weights / xp.where(reach > 0.0, reach, reach * 0.0 + 1.0)
    b = scaled * weight[:, :, None]
    target = (wrench - xp.matmul(a, low[:, :, None])[:, :, 0]) * weight
    turned = xp.permute_dims(b, (0, 2, 1))
    return xp.matmul(turned, b), xp.matmul(turned, target[:, :, None])[:, :, 0], span


def begun(h: Array, g: Array) -> Search:
    """Return the search for a minimum of x H x / 2 - g x over 0 <= x <= 1, before any round."""
    xp, count = namespace(h), g.shape[1]
    eye = xp.eye(count, dtype=g.dtype, device=g.device)[None]
    trace = sum(h[:, k, k] for k in range(count))
    soft = h + SOFT * trace[:, None, None] * eye
    zero, one = g * 0.0, g * 0.0 + 1.0
    # first guess: the free optimum; what lies beyond a bound starts at it
    x = solved_rows(soft, g)
    bound = xp.minimum(xp.maximum(x, zero), one)
    free = xp.where(bound == x, one, zero)
    return Search(h, soft, g, bound, free, one[:, 0] * (count + 1.0), one[:, 0] * 3.0)


def tried(now: Search) -> tuple[Array, Array]:
    """Return the optimum for the present active set, and the violated bounds."""
    xp = namespace(now.g)
    h, g, free = now.h, now.g, now.free
    eye = xp.eye(g.shape[1], dtype=g.dtype, device=g.device)[None]
    held = now.bound * (1.0 - free)
    both = free[:, :, None] * free[:, None, :]
    # the rows and columns of held drives become those of the identity
    system = now.soft * both + eye * (1.0 - free)[:, :, None]
    x = solved_rows(system, free * (g - _times(h, held)) + held)
    # where H lacks rank the softening bends the rows: one refinement straightens them
    x = x + solved_rows(system, free * (g - _times(h, x)))
    # Kuhn and Tucker: at a bound the slope must press against it
    slope = _times(h, x) - g
    off = xp.where(now.bound > 0.5, slope, -slope)
    return x, xp.where(free > 0.0, xp.abs(x - 0.5) - 0.5, off) > BEYOND


def changed(now: Search, x: Array, wrong: Array) -> Search:
    """Return the search with all wrong variables switched, or only the last of each row."""
    xp = namespace(x)
    bad = xp.sum(xp.astype(wrong, x.dtype), axis=1)
    patience = xp.where(bad < now.fewest, now.patience * 0.0 + 3.0, now.patience - 1.0)
    # where blocks go round in circles, one drive at a time always ends
    wrong = wrong & ((patience > 0.0)[:, None] | _last(wrong))
    one = x * 0.0 + 1.0
    return now._replace(
        bound=xp.where(wrong, xp.where(x > 0.5, one, x * 0.0), now.bound),
        free=xp.where(wrong, 1.0 - now.free, now.free),
        fewest=xp.minimum(now.fewest, bad),
        patience=patience,
    )


def solved_rows(matrix: Array, right: Array) -> Array:
    """Solve symmetric systems, shapes (B, n, n) and (B, n)."""
    if not unasked(matrix):
        return solution(matrix, right)
    size = range(right.shape[1])
    lower = [[matrix[:, i, j] for j in range(i + 1)] for i in size]
    return columns(*solve_symmetric(lower, [right[:, i] for i in size]))


def _row_by_row(now: Search) -> Floats:
    """Solve every row on NumPy; rows that have converged are left out."""
    found: Floats = np.empty_like(now.g)
    rows = np.arange(len(found))
    for _ in range(ROUNDS * now.g.shape[1]):
        x, wrong = tried(now)
        found[rows] = x
        (left,) = wrong.any(axis=1).nonzero()
        if not len(left):
            break
        rows, x, wrong = rows[left], x[left], wrong[left]
        now = changed(Search(*(part[left] for part in now)), x, wrong)
    return found


def _turned(held: tuple[Search, Array, Array]) -> tuple[Search, Array, Array]:
    """One round of the search: next state, optimum, violated bounds."""
    now, _, _ = held
    x, wrong = tried(now)
    return changed(now, x, wrong), x, wrong


def _settled(held: tuple[Search, Array, Array]) -> Array:
    return ~namespace(held[2]).any(held[2])


def _times(h: Array, x: Array) -> Array:
    return namespace(h).matmul(h, x[:, :, None])[:, :, 0]


def _last(flags: Array) -> Array:
    """Keep only the last set flag of every row."""
    xp = namespace(flags)
    out, later = [], flags[:, 0] & ~flags[:, 0]
    for k in reversed(range(flags.shape[1])):
        out.append(flags[:, k] & ~later)
        later = later | flags[:, k]
    return xp.stack(out[::-1], axis=1)
