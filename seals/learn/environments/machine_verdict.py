"""Verdict on a control step as machine code: rewards, episodes and observations of a few robots."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from seals.arrays import Array
from seals.pytree import leaves, mapped
from seals.world.scalar_compiler import CannotCompile, compiled


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
