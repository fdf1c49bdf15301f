"""Graph of scalar operations: equal ones are one node, constants are folded."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from seals.errors import ConfigError

_NUMBER = itertools.count()


class Node:
    """Result of an operation.

    Args:
        op: name of the operation.
        args: nodes and numbers; the index of an input.
        graph: all nodes of the law by what they do.
        logical: whether it is true or false.

    Attributes:
        wide: whether it is in double precision where the rest of the law is not, see `widen`.
    """

    __slots__ = ("args", "graph", "logical", "number", "op", "wide")

    def __init__(
        self, op: str, args: tuple[Any, ...], graph: dict[Any, Node], *, logical: bool
    ) -> None:
        self.op, self.args, self.graph, self.logical = op, args, graph, logical
        self.wide: bool = op == "widen" or (op != "narrow" and any(x.wide for x in self.sources()))
        self.number = next(_NUMBER)

    def __bool__(self) -> bool:
        raise ConfigError("a law asks for a number to decide what comes next")

    def sources(self) -> list[Node]:
        """Return the nodes that it is made of."""
        first = self.args[0]
        parts = [*first.first, *first.last, first.done] if isinstance(first, Loop) else self.args
        return [x for x in parts if isinstance(x, Node)]


Entry: TypeAlias = Any
"""A node, a number, or true or false."""

LOGICAL = frozenset({"less", "less_equal", "equal", "not_equal", "and", "or", "not"})


def given(index: int, graph: dict[Any, Node]) -> Node:
    """Return the node of an input."""
    return _node("input", (index,), graph)


class Table:
    """Numbers that laws look up by an index that they work out.

    Args:
        values: rows of numbers, shape (N,) or (N, k).
    """

    __slots__ = ("columns", "shape", "values")

    def __init__(self, values: Any) -> None:
        self.values, self.shape = np.ascontiguousarray(values, dtype=np.float64), values.shape
        self.columns = values.shape[1] if len(values.shape) > 1 else 1

    def __repr__(self) -> str:
        # equal keys of nodes are equal tables
        return f"table {id(self)}"

    def entry(self, row: Entry, column: int) -> Entry:
        """Return a number of a row, whose index is a whole number; the nearest row beyond them."""
        if isinstance(row, Node):
            return _node("look_up", (row, self, column), row.graph)
        nearest = min(max(int(row), 0), self.shape[0] - 1)
        return float(self.values.flat[nearest * self.columns + column])


class Loop:
    """Entries that a law changes again and again.

    Its nodes are ``carried`` (loop, k), an entry at the begin of a pass, and ``looped`` (loop, k),
    the entry after the last one.

    Args:
        count: passes.
        first: entries before the first pass.

    Attributes:
        last: entries after a pass, of the carried ones.
        done: condition after a pass that ends the loop; False for none.
    """

    __slots__ = ("count", "done", "first", "last")

    def __init__(self, count: int, first: Sequence[Entry]) -> None:
        self.count, self.first = count, list(first)
        self.last: list[Entry] = []
        self.done: Entry = False

    def __repr__(self) -> str:
        return f"loop {id(self)}"

    def node(self, op: str, k: int, like: Node) -> Node:
        """Return the node of an entry in a pass, or after all of them, of the kind of another."""
        found = _node(op, (self, k), like.graph)
        found.logical, found.wide = like.logical, like.wide
        return found


def needed(outputs: Sequence[Node]) -> list[Node]:
    """Return the nodes that some results are made of, each after its arguments."""
    found, waiting = set(outputs), list(set(outputs))
    while waiting:
        new = [x for x in waiting.pop().sources() if x not in found]
        found.update(new)
        waiting += new
    return sorted(found, key=lambda node: node.number)


def _node(op: str, args: tuple[Any, ...], graph: dict[Any, Node]) -> Node:
    # 0.0 and False, or 0.0 and -0.0, are equal keys
    key = (op, *((x.number,) if isinstance(x, Node) else (repr(x),) for x in args))
    found = graph.get(key)
    if found is None:
        found = graph[key] = Node(op, args, graph, logical=op in LOGICAL)
    return found


def _of(op: str, *args: Entry) -> Any:
    graph = next((x.graph for x in args if isinstance(x, Node)), None)
    return NUMBERS[op](*args) if graph is None else _node(op, args, graph)


def _is(entry: Entry, number: float) -> bool:
    return not isinstance(entry, Node) and entry == number


def _in_order(a: Entry, b: Entry) -> tuple[Entry, Entry]:
    """Return the terms of a sum or a product, whichever came first, so that equal ones are one."""
    if isinstance(a, Node) and isinstance(b, Node) and a.number > b.number:
        return b, a
    return (a, b) if isinstance(a, Node) else (b, a)


SINGLE = "single"
"""Key of a graph whose numbers are in single precision."""


def widen(a: Entry) -> Entry:
    """Return an entry in double precision; what is worked out from it is, too."""
    if not isinstance(a, Node) or a.wide or a.logical or SINGLE not in a.graph:
        return a
    return _of("widen", a)


def narrow(a: Entry) -> Entry:
    """Return an entry in the precision of the law."""
    return _of("narrow", a) if isinstance(a, Node) and a.wide and not a.logical else a


def add(a: Entry, b: Entry) -> Entry:
    """Return a + b."""
    if _is(a, 0.0):
        return b
    return a if _is(b, 0.0) else _of("add", *_in_order(a, b))


def subtract(a: Entry, b: Entry) -> Entry:
    """Return a - b."""
    if _is(b, 0.0):
        return a
    if a is b:
        return 0.0
    return negative(b) if _is(a, 0.0) else _of("subtract", a, b)


def multiply(a: Entry, b: Entry) -> Entry:
    """Return a b; 0 where either is the number 0."""
    if _is(a, 0.0) or _is(b, 0.0):
        return 0.0
    for one, other in ((a, b), (b, a)):
        if _is(one, 1.0):
            return other
        if _is(one, -1.0):
            return negative(other)
    return _of("multiply", *_in_order(a, b))


def divide(a: Entry, b: Entry) -> Entry:
    """Return a / b."""
    if _is(b, 1.0) or (_is(a, 0.0) and not _is(b, 0.0)):
        return a
    return _of("divide", a, b)


def negative(a: Entry) -> Entry:
    """Return -a."""
    if isinstance(a, Node) and a.op == "negative":
        return a.args[0]
    return _of("negative", a)


def power(a: Entry, b: Entry) -> Entry:
    """Return a to the power b; squares are products."""
    if _is(b, 2.0):
        return multiply(a, a)
    return a if _is(b, 1.0) else _of("power", a, b)


def where(condition: Entry, a: Entry, b: Entry) -> Entry:
    """Return a where the condition holds, else b."""
    if not isinstance(condition, Node):
        return a if condition else b
    return a if a is b else _of("where", condition, a, b)


def both(a: Entry, b: Entry) -> Entry:
    """Return whether both conditions hold."""
    for one, other in ((a, b), (b, a)):
        if not isinstance(one, Node):
            return other if one else False
    return _of("and", a, b)


def either(a: Entry, b: Entry) -> Entry:
    """Return whether a condition holds."""
    for one, other in ((a, b), (b, a)):
        if not isinstance(one, Node):
            return True if one else other
    return _of("or", a, b)


def sign(a: Entry) -> Entry:
    """Return -1, 0 or 1."""
    return where(_of("less", 0.0, a), 1.0, where(_of("less", a, 0.0), -1.0, 0.0))


def plain(op: str, *, turned: bool = False) -> Callable[..., Any]:
    """Return a function that adds an operation; ``turned`` exchanges its two arguments."""
    if turned:
        return lambda a, b: _of(op, b, a)
    return lambda *args: _of(op, *args)


NUMBERS: Mapping[str, Callable[..., Any]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b if b else math.copysign(math.inf, a) if a else math.nan,
    "negative": lambda a: -a,
    "absolute": abs,
    "power": lambda a, b: a**b,
    "maximum": max,
    "minimum": min,
    "less": lambda a, b: a < b,
    "less_equal": lambda a, b: a <= b,
    "equal": lambda a, b: a == b,
    "not_equal": lambda a, b: a != b,
    "not": lambda a: not a,
    "atan2": math.atan2,
    **{n: getattr(math, n) for n in ("sqrt", "exp", "log", "sin", "cos", "tan", "tanh", "floor")},
    **{n: getattr(math, n) for n in ("asin", "acos", "atan", "log1p", "expm1")},
}
"""Operations on plain numbers."""

ELEMENTWISE: Mapping[str, Callable[..., Any]] = {
    **{name: plain(name) for name in NUMBERS},
    **{f.__name__: f for f in (add, subtract, multiply, divide, negative, power, where, sign)},
    "greater": plain("less", turned=True),
    "greater_equal": plain("less_equal", turned=True),
    "logical_and": both,
    "logical_or": either,
    "logical_not": plain("not"),
}
"""Operations of the array API, entry by entry."""
