"""Traced arrays: entries are nodes of a scalar graph."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.scalar_compiler.graph import ELEMENTWISE, SINGLE, Node

Entries = NDArray[np.object_]

_NAMES = {
    "concatenate": "concat",
    "transpose": "permute_dims",
    "arctan2": "atan2",
    "arcsin": "asin",
    "arccos": "acos",
    "arctan": "atan",
    "true_divide": "divide",
}
"""NumPy's names of functions of the array API."""


class Traced:
    """Array of nodes and numbers, by the array API.

    Args:
        entries: nodes and numbers.
    """

    __slots__ = ("entries",)
    device = "cpu"
    namespace: ClassVar[Any] = None
    """Its functions, which `seals.scalar_compiler.functions` puts here."""

    def __init__(self, entries: Any) -> None:
        self.entries: Entries = np.asarray(entries, dtype=object)

    def __array_namespace__(self, *, api_version: str | None = None) -> Any:
        return Traced.namespace

    def __array__(self, *args: Any, **kwargs: Any) -> Any:
        raise ConfigError("a law asks NumPy for the numbers of an array")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **more: Any) -> Any:
        if method == "reduce" and ufunc is np.add:
            return self._call("sum", inputs, more)
        return self._call(ufunc.__name__, inputs, more) if method == "__call__" else NotImplemented

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        return self._call(func.__name__, args, kwargs)

    def _call(self, name: str, args: Any, kwargs: Any) -> Any:
        found = getattr(self.__array_namespace__(), _NAMES.get(name, name), None)
        return NotImplemented if found is None else found(*args, **kwargs)

    @property
    def shape(self) -> tuple[int, ...]:
        """Return the shape."""
        return self.entries.shape

    @property
    def ndim(self) -> int:
        """Return the number of axes."""
        return self.entries.ndim

    @property
    def size(self) -> int:
        """Return the number of entries."""
        return self.entries.size

    @property
    def dtype(self) -> Any:
        """Return the type of the entries."""
        first = self.entries.flat[0] if self.entries.size else 0.0
        if not isinstance(first, Node):
            return np.dtype(np.bool_ if isinstance(first, bool) else np.float64)
        if first.logical:
            return np.dtype(np.bool_)
        return np.dtype(np.float32 if SINGLE in first.graph and not first.wide else np.float64)

    @property
    def T(self) -> Traced:
        """Return the transposed array."""
        return Traced(self.entries.T)

    @property
    def numbers(self) -> Floats | None:
        """Return the entries as numbers; None with a node among them.

        Example:
            >>> constant([1.0, 2.0]).numbers
            array([1., 2.])
        """
        if any(isinstance(entry, Node) for entry in self.entries.flat):
            return None
        return self.entries.astype(float)

    def __len__(self) -> int:
        return len(self.entries)

    def __getitem__(self, key: Any) -> Traced:
        return Traced(self.entries[_place(key)])

    def __setitem__(self, key: Any, value: Any) -> None:
        self.entries[_place(key)] = constant(value).entries

    def __bool__(self) -> bool:
        return bool(self.entries.item())

    def __matmul__(self, other: Any) -> Any:
        return self._call("matmul", (self, other), {})

    def __rmatmul__(self, other: Any) -> Any:
        return self._call("matmul", (other, self), {})

    def reshape(self, *shape: Any) -> Traced:
        """Return the entries in another shape."""
        return Traced(self.entries.reshape(*shape))

    def tolist(self) -> Any:
        """Return the entries as arrays of one, in nested lists."""
        return [self[k].tolist() for k in range(len(self))] if self.ndim else self

    def transpose(self, *axes: Any) -> Traced:
        """Return the array with its axes in another order."""
        return Traced(self.entries.transpose(*axes))

    def take(self, index: Any, axis: int | None = None) -> Traced:
        """Return entries along an axis."""
        return Traced(self.entries.take(np.asarray(index), axis=axis))


def _place(key: Any) -> Any:
    """Return an index of traced numbers as one of NumPy's."""
    return key.entries.astype(np.int64) if isinstance(key, Traced) else key


def constant(value: Any) -> Traced:
    """Return an array of numbers as a traced one; a traced one stays."""
    if isinstance(value, Traced):
        return value
    array = np.asarray(value)
    kind = bool if array.dtype == np.bool_ else float
    return Traced(array.astype(kind).astype(object))


def elementwise(name: str) -> Any:
    """Return an operation of `ELEMENTWISE` on arrays, with broadcasting."""
    law = ELEMENTWISE[name]
    calls = {n: np.frompyfunc(law, n, 1) for n in (1, 2, 3)}

    def apply(*args: Any) -> Traced:
        return Traced(calls[len(args)](*(constant(x).entries for x in args)))

    return apply


def _bind() -> None:
    """Give the class the operators of Python."""
    for sign, name in _OPERATORS.items():
        apply = elementwise(name)
        setattr(Traced, f"__{sign}__", apply)
        setattr(Traced, f"__r{sign}__", lambda a, b, apply=apply: apply(b, a))
    for sign, name in _ONE_SIDED.items():
        setattr(Traced, f"__{sign}__", elementwise(name))


_OPERATORS = {
    "add": "add",
    "sub": "subtract",
    "mul": "multiply",
    "truediv": "divide",
    "pow": "power",
    "and": "logical_and",
    "or": "logical_or",
}
_ONE_SIDED = {
    "neg": "negative",
    "abs": "absolute",
    "invert": "logical_not",
    "lt": "less",
    "le": "less_equal",
    "gt": "greater",
    "ge": "greater_equal",
    "eq": "equal",
    "ne": "not_equal",
}
_bind()
