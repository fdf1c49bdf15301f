"""Array type aliases, and helpers that work on any array library.

Arrays may come from NumPy, PyTorch or array-api-strict.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
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
    return array_namespace(*arrays)


def columns(*parts: Array) -> Array:
    """Join vectors of shape (N,) into an array of shape (N, k), stored column by column.

    Column-wise storage keeps every component contiguous, which makes broadcasting a scalar per row
    against a vector per row several times faster for large batches.

    Example:
        >>> columns(np.array([1.0, 2.0]), np.array([3.0, 4.0]))
        array([[1., 3.],
               [2., 4.]])
    """
    return namespace(*parts).stack(parts, axis=0).T


def gathered(values: Sequence[Any], like: Array) -> Array:
    """Return an array of numbers in nested lists, in the library of ``like``.

    Example:
        >>> gathered([[1.0, 2.0]], np.zeros(1))
        array([[1., 2.]])
    """
    if type(like) is np.ndarray:
        return np.array(values, dtype=float)
    xp = namespace(like)
    parts = [gathered(x, like) if isinstance(x, Sequence) else xp.asarray(x) for x in values]
    return xp.stack(parts, axis=0)


def some(flags: Array) -> bool:
    """Return whether any flag is set; True for traced arrays, whose values are unknown.

    Whoever asks must be right, if slower, with yes; see `unasked`.

    Example:
        >>> some(np.zeros(3) > 1.0)
        False
    """
    if type(flags) is np.ndarray:
        # a fifth of the time of ``any``
        return bool(np.count_nonzero(flags))
    return unasked(flags) or bool(namespace(flags).any(flags))


_DECIDING = [True]


def deciding() -> bool:
    """Return whether laws may branch on the values of an array."""
    return _DECIDING[-1]


@contextlib.contextmanager
def undecided() -> Iterator[None]:
    """Let laws called inside evaluate every branch for all rows, as on an accelerator."""
    _DECIDING.append(False)
    try:
        yield
    finally:
        _DECIDING.pop()


def iterate(
    law: Callable[[Any], Any],
    state: Any,
    count: int,
    done: Callable[[Any], Any] | None = None,
) -> Any:
    """Return a state after a law has been applied to it some times.

    A tracer may follow the law once and write a loop, see `looping`; any other array library
    repeats it. The law must not depend on how often it was called.

    Args:
        law: takes the state, nested tuples and mappings of arrays, and returns the next one.
        state: before; its leaves keep their shapes.
        count: how often.
        done: tells of a state, of all rows, that the law changes nothing more that matters.

    Example:
        >>> iterate(lambda x: 2.0 * x, np.ones(1), 3)
        array([8.])
    """
    if _LOOPS and count > 1:
        return _LOOPS[-1](law, state, count, done)
    for _ in range(count):
        state = law(state)
        if done is not None and not unasked(over := done(state)) and bool(over):
            break
    return state


_LOOPS: list[Callable[..., Any]] = []


@contextlib.contextmanager
def looping(loop: Callable[..., Any]) -> Iterator[None]:
    """Let a tracer write what laws `iterate` as loops: it takes the same arguments."""
    _LOOPS.append(loop)
    try:
        yield
    finally:
        _LOOPS.pop()


_DOUBTS: list[tuple[list[Any], int]] = []


@contextlib.contextmanager
def doubting(rounds: int = 6) -> Iterator[list[Any]]:
    """Yield a list of conditions under which what the laws called inside return is not to be used.

    They may then answer for usual cases alone, and say by `doubt` where one is none.

    Args:
        rounds: turns of a search, all of them always made, that are thought enough.

    Example:
        >>> with doubting() as doubts:
        ...     doubt(np.array([3.0]) > 2.0)
        >>> doubts, rounds_enough()
        ([array([ True])], None)
    """
    _DOUBTS.append(([], rounds))
    try:
        yield _DOUBTS[-1][0]
    finally:
        _DOUBTS.pop()


def doubt(condition: Any) -> None:
    """Note a condition where anybody collects them, see `doubting`."""
    if _DOUBTS:
        _DOUBTS[-1][0].append(condition)


def rounds_enough() -> int | None:
    """Return turns of a search that are thought enough, see `doubting`; None for any number."""
    return _DOUBTS[-1][1] if _DOUBTS else None


def unasked(array: Array) -> bool:
    """Return whether an array is traced, so that its values are unknown.

    On an accelerator the answer would have to be waited for, and work that is decided by it could
    not be recorded once and replayed; nor can it be followed once and compiled.

    Example:
        >>> unasked(np.zeros(3))
        False
        >>> with undecided():
        ...     unasked(np.zeros(3))
        True
    """
    return not deciding() or on_accelerator(array)


def on_accelerator(array: Array) -> bool:
    """Return whether an array lies on an accelerator of PyTorch.

    Example:
        >>> on_accelerator(np.zeros(3))
        False
    """
    return getattr(getattr(array, "device", None), "type", "cpu") != "cpu"


def as_like(value: Any, like: Array) -> Array:
    """Return ``value`` as an array of the library, type and device of ``like``."""
    if type(like) is np.ndarray:
        return np.asarray(value, dtype=like.dtype)
    xp = namespace(like)
    return xp.asarray(value, dtype=like.dtype, device=like.device)


_FIXED: dict[tuple[int, Any, Any], tuple[Floats, Array]] = {}


def fixed(value: Floats, like: Array) -> Array:
    """Return a module constant as a cached array of the kind of ``like``.

    It is converted once for every library, type and device, so that an accelerator, which works
    ahead of the processor, does not wait for the same few numbers again and again.

    Example:
        >>> fixed(np.eye(2), np.zeros(1)).shape
        (2, 2)
    """
    if type(like) is np.ndarray:
        return np.asarray(value, dtype=like.dtype)
    key = (id(value), like.dtype, like.device)
    if key not in _FIXED:
        # the constant is kept beside it: its address must not come to mean another one
        _FIXED[key] = (value, as_like(value, like))
    return _FIXED[key][1]


_INDICES: dict[tuple[int, Any], tuple[Any, Array]] = {}


def index_on(rows: NDArray[np.int64], like: Array) -> Array:
    """Return constant indices as an array of the kind of ``like``, converted once on accelerators.

    Example:
        >>> index_on(np.array([2, 0]), np.zeros(1))
        array([2, 0])
    """
    if type(like) is np.ndarray:
        return rows
    if not on_accelerator(like):
        return namespace(like).asarray(rows)
    key = (id(rows), like.device)
    if key not in _INDICES:
        # the constant is kept beside it: its address must not come to mean another one
        _INDICES[key] = (rows, namespace(like).asarray(rows, device=like.device))
    return _INDICES[key][1]


def column_of(value: Any, like: Array) -> Array:
    """Return a number as an array (1, 1) of the library of ``like``; an array (N, 1) stays."""
    if isinstance(value, int | float):
        return as_like([[value]], like)
    return as_like(value, like)


def true_spans(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first row, and the row after the last, of each run of true rows.

    Example:
        >>> true_spans(np.array([True, False, True, True]))
        [(0, 1), (2, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(first, end) for first, end in edges.reshape(-1, 2).tolist()]
