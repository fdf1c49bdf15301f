"""Numbers that record which comparisons would change with another threshold.

A :class:`Traced` number carries, beside its value, the values that it would have with each
threshold lowered or raised. Arithmetic carries them on; a comparison whose outcome would differ
is noted in a :class:`Trace`. A program that is run once on traced thresholds thus tells which
changes of one threshold cannot change its path: those that no comparison noted.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

Change: TypeAlias = tuple[str, int]
"""A threshold by name, and -1 (lowered) or +1 (raised)."""


class Trace:
    """Recorded threshold changes with an influence, by stage of the program.

    Attributes:
        stage: name of the stage that runs.
        noted: changes that would have altered a comparison or an array, by stage.
        used: names of thresholds that took part in any arithmetic or comparison.
    """

    def __init__(self) -> None:
        """Begin with nothing noted."""
        self.stage = ""
        self.noted: dict[str, set[Change]] = {}
        self.used: set[str] = set()

    def note(self, change: Change) -> None:
        """Record that a change would alter this stage."""
        self.noted.setdefault(self.stage, set()).add(change)


class Traced(float):
    """A number with the values it would have under other thresholds.

    Args:
        value: as the program runs.
        others: values under each change of a threshold.
        trace: in which comparisons are noted.
    """

    __slots__ = ("others", "trace")
    others: dict[Change, float]
    trace: Trace

    def __new__(cls, value: float, others: Mapping[Change, float], trace: Trace) -> Traced:
        """Make a number and remember its alternatives."""
        out = super().__new__(cls, value)
        out.others, out.trace = dict(others), trace
        return out

    def __hash__(self) -> int:
        """Hash as the plain number does."""
        return float.__hash__(self)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        """Apply a function of NumPy to the value and to every alternative."""
        act = getattr(ufunc, method)
        return _applied(lambda *x: act(*x, **options), inputs, self.trace)


def _applied(function: Callable[..., Any], inputs: tuple[Any, ...], trace: Trace) -> Any:
    """Apply a function to values and alternatives; note outcomes that differ."""
    base = function(*(float(x) if isinstance(x, Traced) else x for x in inputs))
    if base is NotImplemented:
        return base
    changes = {c for x in inputs if isinstance(x, Traced) for c in x.others}
    trace.used |= {name for name, _ in changes}
    others = {
        change: function(
            *(x.others.get(change, float(x)) if isinstance(x, Traced) else x for x in inputs)
        )
        for change in changes
    }
    if isinstance(base, int | float | np.integer | np.floating) and not isinstance(base, bool):
        return Traced(float(base), {c: float(v) for c, v in others.items()}, trace)
    for change, other in others.items():
        if not np.array_equal(np.asarray(base), np.asarray(other), equal_nan=False):
            trace.note(change)
    return base


def _binary(function: Callable[[Any, Any], Any], *, swapped: bool) -> Callable[[Any, Any], Any]:
    """Make a method of an operator of two numbers."""

    def method(self: Traced, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        pair = (other, self) if swapped else (self, other)
        return _applied(function, pair, self.trace)

    return method


def _unary(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Make a method of an operator of one number."""

    def method(self: Traced) -> Any:
        return _applied(function, (self,), self.trace)

    return method


for _name in ("add", "sub", "mul", "truediv", "pow", "mod", "floordiv"):
    setattr(Traced, f"__{_name}__", _binary(getattr(operator, _name), swapped=False))
    setattr(Traced, f"__r{_name}__", _binary(getattr(operator, _name), swapped=True))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Traced, f"__{_name}__", _binary(getattr(operator, _name), swapped=False))
for _name in ("neg", "abs"):
    setattr(
        Traced,
        f"__{_name}__",
        _unary(getattr(operator, _name)),
    )
