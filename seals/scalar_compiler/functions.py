"""Array API namespace for traced arrays: the functions that effects use."""

from __future__ import annotations

import functools
import itertools
import math
import operator
import sys
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from seals.multibody.linear import solve_symmetric
from seals.pytree import leaves, mapped
from seals.scalar_compiler.graph import ELEMENTWISE, Loop, Node, Table, given, narrow, widen
from seals.scalar_compiler.traced import Traced, constant, elementwise

float32, float64, int64 = np.dtype(np.float32), np.dtype(np.float64), np.dtype(np.int64)

globals().update({name: elementwise(name) for name in ELEMENTWISE})
globals()["abs"] = globals()["absolute"]
_apply: dict[str, Any] = {name: globals()[name] for name in ELEMENTWISE}


def asarray(value: Any, *, dtype: Any = None, device: Any = None, copy: Any = None) -> Traced:
    """Return numbers as an array."""
    return constant(value)


def astype(x: Traced, dtype: Any, *, copy: bool = True) -> Traced:
    """Return conditions as numbers, and numbers in another precision."""
    if x.dtype == np.bool_ and dtype in {float32, float64}:
        x = _where(x, 1.0, 0.0)
    if dtype in {float32, float64}:
        return Traced(np.frompyfunc(widen if dtype == float64 else narrow, 1, 1)(x.entries))
    return x


def table(value: Any) -> Table:
    """Return numbers that are looked up by an index, see `take`."""
    return Table(value)


def isnan(x: Any) -> Traced:
    """Return whether values are no numbers."""
    found: Traced = _apply["not_equal"](x, x)
    return found


def isfinite(x: Any) -> Traced:
    """Return whether values are finite."""
    found: Traced = _apply["less"](_apply["absolute"](x), math.inf)
    return found


def _where(*args: Any) -> Traced:
    found: Traced = _apply["where"](*args)
    return found


def clip(x: Any, low: Any = None, high: Any = None, **more: Any) -> Traced:
    """Return values within bounds."""
    low, high = more.get("min", low), more.get("max", high)
    found = x if low is None else _apply["maximum"](x, low)
    return constant(found if high is None else _apply["minimum"](found, high))


def _moving(name: str, *, several: bool = False) -> Any:
    """Return NumPy's function, which moves entries without looking at them."""
    law = getattr(np, name)

    def apply(x: Any, *args: Any, **more: Any) -> Traced:
        given = [constant(part).entries for part in x] if several else constant(x).entries
        return Traced(law(given, *args, **more))

    return apply


concat, stack = _moving("concatenate", several=True), _moving("stack", several=True)
permute_dims, reshape, squeeze = (_moving(n) for n in ("transpose", "reshape", "squeeze"))
expand_dims, broadcast_to, repeat = (_moving(n) for n in ("expand_dims", "broadcast_to", "repeat"))


def take(x: Any, index: Any, *, axis: int) -> Traced:
    """Return entries along an axis, by an index of numbers; of a table by any one."""
    if isinstance(x, Table):
        rows = constant(index).entries
        found = np.empty((*rows.shape, x.columns), dtype=object)
        for place in np.ndindex(rows.shape):
            found[place] = [x.entry(rows[place], k) for k in range(x.columns)]
        return Traced(found.reshape(rows.shape + x.shape[1:]))
    places = index.entries.astype(np.int64) if isinstance(index, Traced) else np.asarray(index)
    return Traced(constant(x).entries.take(places, axis=axis))


def zeros(shape: Any, *, dtype: Any = None, device: Any = None) -> Traced:
    """Return zeros."""
    return constant(np.zeros(shape))


def zeros_like(x: Any, **more: Any) -> Traced:
    """Return zeros."""
    return constant(np.zeros(x.shape))


def ones_like(x: Any, **more: Any) -> Traced:
    """Return ones."""
    return constant(np.ones(x.shape))


def eye(size: int, *, dtype: Any = None, device: Any = None) -> Traced:
    """Return the identity."""
    return constant(np.eye(size))


def loop(
    law: Callable[[Any], Any],
    state: Any,
    count: int,
    done: Callable[[Any], Any] | None = None,
) -> Any:
    """Return a nest after a law has changed it some times, as a loop of the graph.

    Entries that are numbers, and that the law leaves as they are, stay numbers.
    """
    arrays = [constant(x) for x in leaves(state)]
    first = [entry for x in arrays for entry in x.entries.flat]
    graph = next((x.graph for x in first if isinstance(x, Node)), None)
    if graph is None:
        return functools.reduce(lambda held, _: law(held), range(count), state)
    # what a carried entry is like: itself before the first pass, or after one
    kinds = list(first)
    while True:
        whole = Loop(count, first)
        carried = [
            whole.node("carried", k, like) if isinstance(like, Node) else like
            for k, like in enumerate(kinds)
        ]
        after = law(_refilled(state, arrays, carried))
        whole.last = [entry for x in leaves(after) for entry in constant(x).entries.flat]
        wrong = [
            k
            for k, (like, entry) in enumerate(zip(carried, whole.last, strict=True))
            if _moves(like, entry)
        ]
        if not wrong:
            break
        for k in wrong:
            kinds[k] = whole.last[k] if isinstance(whole.last[k], Node) else given(-1, graph)
    if done is not None:
        whole.done = constant(done(after)).entries.item()
    results = [
        first[k] if entry is like else whole.node("looped", k, like)
        for k, (like, entry) in enumerate(zip(carried, whole.last, strict=True))
    ]
    return _refilled(after, [constant(x) for x in leaves(after)], results)


def _moves(entry: Any, after: Any) -> bool:
    """Return whether a pass made of a number another one, or of an entry a more precise one."""
    if isinstance(entry, Node):
        return isinstance(after, Node) and after.wide and not entry.wide
    return isinstance(after, Node) or repr(after) != repr(entry)


def _refilled(nest: Any, like: Sequence[Traced], entries: Sequence[Any]) -> Any:
    """Return a nest of the same form and shapes with other entries, in order."""
    rest = iter(entries)
    parts = iter(
        [
            Traced(np.array([next(rest) for _ in range(x.size)], dtype=object).reshape(x.shape))
            for x in like
        ]
    )
    return mapped(nest, lambda _: next(parts))


def _reduced(x: Any, name: str, axis: Any, keepdims: bool, empty: Any) -> Traced:
    """Combine the entries along some axes in their order."""
    entries, law = constant(x).entries, ELEMENTWISE[name]
    chosen = range(entries.ndim) if axis is None else np.atleast_1d(axis)
    for k in sorted((int(a) % entries.ndim for a in chosen), reverse=True):
        parts = list(np.moveaxis(entries, k, 0))
        whole = functools.reduce(np.frompyfunc(law, 2, 1), parts) if parts else empty
        entries = np.asarray(whole, dtype=object)
        entries = np.expand_dims(entries, k) if keepdims else entries
    return Traced(entries)


def _reduction(name: str, empty: Any) -> Any:
    def apply(x: Any, axis: Any = None, *, keepdims: bool = False, dtype: Any = None) -> Traced:
        return _reduced(x, name, axis, keepdims, empty)

    return apply


sum = _reduction("add", 0.0)
any, all = _reduction("logical_or", False), _reduction("logical_and", True)
max, min = _reduction("maximum", None), _reduction("minimum", None)


def cumulative_sum(x: Any, *, axis: int = -1, dtype: Any = None) -> Traced:
    """Return sums of the entries up to each one along an axis."""
    parts = np.moveaxis(constant(x).entries, axis, 0)
    sums = list(itertools.accumulate(parts, np.frompyfunc(ELEMENTWISE["add"], 2, 1)))
    return Traced(np.stack(sums, axis=axis) if sums else constant(x).entries)


def matmul(a: Any, b: Any) -> Traced:
    """Return products of matrices; sums are taken in the order of the entries."""
    x, y = constant(a).entries, constant(b).entries
    if y.ndim == 1:
        return matmul(a, Traced(y[:, None]))[..., 0]
    if x.ndim == 1:
        return matmul(Traced(x[None]), b)[..., 0, :]
    products = _apply["multiply"](Traced(x[..., :, :, None]), Traced(y[..., None, :, :]))
    found: Traced = sum(products, axis=-2)
    return found


def _solve(matrix: Any, right: Any) -> Traced:
    """Solve symmetric positive definite systems, shapes (B, n, n) and (B, n, k)."""
    m, b = constant(matrix).entries, constant(right).entries
    out = np.empty(b.shape, dtype=object)
    for k in np.ndindex(b.shape[:-2]):
        own = m[k if len(m) > 1 else 0]
        rows = [
            [None if (not isinstance(x, Node) and operator.eq(x, 0.0)) else _scalar(x) for x in row]
            for row in own
        ]
        for column in range(b.shape[-1]):
            place = (*k, slice(None), column)
            found = solve_symmetric(rows, [_scalar(x) for x in b[place]])
            out[place] = [x.entries.item() for x in found]
    return Traced(out)


def _scalar(entry: Any) -> Traced:
    return Traced(np.array(entry, dtype=object))


linalg = SimpleNamespace(solve=_solve)
Traced.namespace = sys.modules[__name__]
