"""Weighted least squares within bounds by an active-set search, row by row on any array library."""

from __future__ import annotations

from typing import NamedTuple

from seals.arrays import Array, columns, namespace, unasked
from seals.multibody.linear import solve_symmetric

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


def weighted(
    a: Array, wrench: Array, low: Array, high: Array, weights: Array
) -> tuple[Array, Array, Array]:
    """Return quadratic form, linear form and spans of `seals.control.allocation.best_within`.

    Args:
        a: shape (B, rows, n).
        wrench: wanted, shape (B, rows).
        low: shape (B, n).
        high: above low, shape (B, n).
        weights: of the rows, shape (rows,).
    """
    xp = namespace(wrench)
    ends = a * low[:, None, :], a * high[:, None, :]
    most, least = xp.sum(xp.maximum(*ends), axis=2), xp.sum(xp.minimum(*ends), axis=2)
    wanted = xp.minimum(xp.maximum(wrench, least), most)
    span = high - low
    scaled = a * span[:, None, :]
    weight = weights / xp.sum(xp.abs(scaled), axis=2)
    b = scaled * weight[:, :, None]
    target = (wanted - xp.matmul(a, low[:, :, None])[:, :, 0]) * weight
    turned = xp.permute_dims(b, (0, 2, 1))
    return xp.matmul(turned, b), xp.matmul(turned, target[:, :, None])[:, :, 0], span


def begun(h: Array, g: Array) -> Search:
    """Return the search for a minimum of x H x / 2 - g x over 0 <= x <= 1, before any round."""
    xp, count = namespace(h), g.shape[1]
    eye = xp.eye(count, dtype=g.dtype, device=g.device)[None]
    trace = sum(h[:, k, k] for k in range(count))
    soft = h + SOFT * trace[:, None, None] * eye
    zero, one = g * 0.0, g * 0.0 + 1.0
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
    system = now.soft * both + eye * (1.0 - free)[:, :, None]
    x = solved_rows(system, free * (g - _times(h, held)) + held)
    x = x + solved_rows(system, free * (g - _times(h, x)))
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
        return namespace(matrix).linalg.solve(matrix, right[:, :, None])[:, :, 0]
    size = range(right.shape[1])
    lower = [[matrix[:, i, j] for j in range(i + 1)] for i in size]
    return columns(*solve_symmetric(lower, [right[:, i] for i in size]))


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
