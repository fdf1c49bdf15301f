"""Machine code in place of laws of arrays: twins row by row, verdicts on a few robots."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from seals.arrays import Array, doubting
from seals.pytree import leaves, mapped
from seals.scalar_compiler import CannotCompile, compiled, constant
from seals.scalar_compiler.rows import RowKernel

ROUNDS = (6, 16)
"""Turns of the search for the best command within the drives' bounds, of the first and next law."""


class MachineLaw:
    """Law on nests of arrays as machine code, row by row.

    Rows that a law doubts (`seals.arrays.doubt`) are given the next one, the last ones NumPy: those
    that ask their drives for more than they can do in an unusual way. What is no law of machine
    code stays with NumPy.

    Args:
        laws: of one row, on traced arrays, the quickest first.

    Attributes:
        refused: whether the law has no machine code, as its first call shows.
    """

    def __init__(self, laws: Sequence[Callable[..., Any]]) -> None:
        self._laws = list(laws)
        self._kernels: list[RowKernel] = []
        self._form: Any = None
        self.refused = False

    def __call__(self, plain: Callable[..., Any], chosen: Callable[..., Any], *given: Any) -> Any:
        """Return the results for nests of arrays.

        Args:
            plain: the law of all rows, by NumPy.
            chosen: takes its results, those of machine code, and a mask (N,) of the rows of the
                first.
            given: nests of arrays, of which the last one has N rows.
        """
        if self.refused:
            return plain(*given)
        flat = list(leaves(given))
        try:
            first = self._kernel(0, given, flat)
            block = first.block(flat)
            out = first.run(block)
            for k in range(1, len(self._laws)):
                rows = np.flatnonzero(out[:, -1])
                if len(rows):
                    out[rows] = self._kernel(k, given, flat).run(block[rows])
        except CannotCompile:
            self.refused = True
            return plain(*given)
        *found, _ = first.results(out)
        results, unsure = iter(found), out[:, -1] != 0.0
        whole = mapped(self._form, lambda leaf: next(results))
        if unsure.any():
            whole = chosen(plain(*given), whole, unsure)
        return whole

    def _kernel(self, k: int, given: Any, flat: list[Any]) -> RowKernel:
        """Return a law as machine code, compiled when it is first needed."""
        if k == len(self._kernels):
            self._kernels.append(self._compiled(self._laws[k], ROUNDS[k], given, flat))
        return self._kernels[k]

    def _compiled(
        self, law: Callable[..., Any], rounds: int, given: Any, flat: list[Any]
    ) -> RowKernel:
        count = np.shape(flat[-1])[0]
        shapes = [(np.shape(x)[0] // count, *np.shape(x)[1:]) for x in flat]

        def whole(*arrays: Array) -> list[Array]:
            more = iter(arrays)
            with doubting(rounds) as doubts:
                self._form = law(*mapped(given, lambda leaf: next(more)))
            nothing: Any = constant(np.zeros(1))
            sure = nothing > 0.0
            unsure = functools.reduce(lambda a, b: a | b.reshape((1,)), doubts, sure)
            return [*leaves(self._form), unsure]

        return RowKernel(whole, shapes)


class MachineVerdict:
    """Law of the array API on nests of arrays, compiled for the shapes of its first call.

    A law that asks for more than arrays of the array API can do goes on as it is.

    Args:
        law: pure; takes nests of arrays and returns one.

    Attributes:
        refused: whether the law has no machine code, as its first call shows.
    """

    def __init__(self, law: Callable[..., Any]) -> None:
        self._law = law
        self._kernel: Any = None
        self._shapes: list[Any] = []
        self._form: Any = None
        self._built: Callable[[Iterator[Any]], Any] = _builder(None)
        self.refused = False

    def __call__(self, *given: Any) -> Any:
        """Return what the law does."""
        flat = list(leaves(given))
        shapes = [np.shape(x) for x in flat]
        if self.refused or (self._kernel is not None and shapes != self._shapes):
            return self._law(*given)
        if self._kernel is None:
            self._shapes = shapes
            try:
                self._kernel = self._compiled(given, shapes)
            except CannotCompile:
                self.refused = True
                return self._law(*given)
        found = iter(self._kernel(*flat))
        return self._built(found)

    def _compiled(self, given: Any, shapes: list[Any]) -> Any:
        """Compile the law; note the form of what it returns."""

        def law(*arrays: Array) -> list[Array]:
            more = iter(arrays)
            whole = self._law(*mapped(given, lambda leaf: _entries(next(more), leaf)))
            self._form = mapped(whole, lambda leaf: leaf.dtype == np.bool_)
            return list(leaves(whole))

        kernel = compiled(law, shapes)
        self._built = _builder(self._form)
        return kernel


def _entries(traced: Array, like: Any) -> Array:
    """Return an argument as the law has it: conditions come as numbers."""
    return traced > 0.5 if np.asarray(like).dtype == np.bool_ else traced


def _builder(form: Any) -> Callable[[Iterator[Any]], Any]:
    """Return what makes a nest of results in order; leaves of its form say which are conditions.

    Example:
        >>> _builder((False, {"a": True}))(iter(np.array([[3.0], [1.0]])))
        (array([3.]), {'a': array([ True])})
    """
    if isinstance(form, dict):
        named = [(name, _builder(part)) for name, part in form.items()]
        return lambda found: {name: part(found) for name, part in named}
    if isinstance(form, tuple):
        parts, kind = [_builder(part) for part in form], type(form)
        if hasattr(form, "_fields"):
            return lambda found: kind(*[part(found) for part in parts])
        return lambda found: tuple([part(found) for part in parts])
    if form is None:
        return lambda found: None
    return (lambda found: next(found) != 0.0) if form else next
