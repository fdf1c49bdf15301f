"""Conversion of a scalar graph to statements of C, one call for each row."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from seals.scalar_compiler.graph import Loop, Node, Table, needed

_SIGNS = {
    **{"add": "+", "subtract": "-", "multiply": "*", "divide": "/"},
    **{"less": "<", "less_equal": "<=", "equal": "==", "not_equal": "!=", "and": "&&", "or": "||"},
}
# a motion that is not a number stays one, as in the machine code
_EXTREME = {"maximum": "<=", "minimum": ">="}
# not every compiler has them; quotients in which the error of u drops out (Higham 2002, 1.14.1)
_NEAR_ONE = {
    "log1p": ("{one} + {}", "{u} == {one} ? {x} : ::log({u}) * {x} / ({u} - {one})"),
    "expm1": (
        "::exp({})",
        "{u} == {one} ? {x} : {x} < -40 || {x} > 40 ? {u} - {one} : "
        "({u} - {one}) * {x} / ::log({u})",
    ),
}
_NAMES = {"absolute": "fabs", "power": "pow"}
_Depth = frozenset[Loop]
"""Loops inside which a node has its value."""


def statements_of(
    outputs: Sequence[Any], read: str, write: str, *, number: str = "double"
) -> list[str]:
    """Return statements that work out the entries of some results.

    Args:
        outputs: entries; numbers are left out.
        read: format of the place of an input, of its number.
        write: format of the place of a result, of its number.
        number: type of all numbers, ``double`` or ``float``.

    Example:
        >>> from seals.scalar_compiler.graph import given, multiply
        >>> x = given(0, {})
        >>> statements_of([multiply(x, x), 1.0], "a[{}]", "b[{}]")
        ['const double v0 = a[0];', 'const double v1 = v0 * v0;', 'b[0] = v1;']
    """
    text = _Text(outputs, read, number)
    written = list(text.block(frozenset()))
    return written + [
        f"{write.format(k)} = {text.names[x]};" for k, x in enumerate(outputs) if x in text.names
    ]


def tables_of_graph(outputs: Sequence[Any]) -> list[Table]:
    """Return the tables of some results, which the statements call ``table0`` and so on."""
    nodes = needed([x for x in outputs if isinstance(x, Node)])
    return list(dict.fromkeys(x.args[1] for x in nodes if x.op == "look_up"))


class _Text:
    """Statements of a graph, loop inside loop.

    Attributes:
        names: of the nodes that are written.
    """

    def __init__(self, outputs: Sequence[Any], read: str, number: str) -> None:
        self._nodes = needed([x for x in outputs if isinstance(x, Node)])
        self._tables = {table: k for k, table in enumerate(tables_of_graph(outputs))}
        self._read, self._type = read, number
        self.names: dict[Any, str] = {}
        self._inside: dict[_Depth, list[Node]] = {}
        depths: dict[Node, _Depth] = {}
        for node in self._nodes:
            own = frozenset().union(*(depths[x] for x in node.sources() if x in depths))
            if node.op == "carried":
                own |= {node.args[0]}
            if node.op == "looped":
                own -= {node.args[0]}
            depths[node] = own
            self._inside.setdefault(own, []).append(node)

    def block(self, depth: _Depth) -> Iterator[str]:
        """Yield the statements of what has its value inside some loops, in order."""
        for node in self._inside.get(depth, []):
            if node.op == "carried":
                continue
            if node.op == "looped":
                yield from self._loop(node.args[0], depth)
            else:
                yield from self._statement(node)

    def _loop(self, loop: Loop, depth: _Depth) -> Iterator[str]:
        """Yield a loop, when its first result is asked for."""
        mine = [x for x in self._nodes if x.op in {"carried", "looped"} and x.args[0] is loop]
        if mine[0] in self.names:
            return
        held = {}
        for node in mine:
            k = node.args[1]
            kind, first = self._kind(node), self._entry(loop.first[k], node.wide)
            if loop.last[k] is node:
                self.names[node] = first
                continue
            if k not in held:
                held[k] = f"c{len(self.names)}"
                yield f"{kind} {held[k]} = {first};"
            self.names[node] = held[k]
        turn = f"i{len(self.names)}"
        yield f"for (int {turn} = 0; {turn} < {loop.count}; ++{turn}) {{"
        yield from self.block(depth | {loop})
        # all of them at once: an entry may become what another one was
        yield from (
            f"const auto {name}n = {self._entry(loop.last[k])};" for k, name in held.items()
        )
        yield from (f"{name} = {name}n;" for name in held.values())
        if isinstance(loop.done, Node):
            yield f"if ({self._entry(loop.done)}) break;"
        yield "}"

    def _statement(self, node: Node) -> Iterator[str]:
        name = self.names[node] = f"v{len(self.names)}"
        kind = self._kind(node)
        if node.op in _NEAR_ONE:
            one = self._entry(1.0, node.wide)
            first = _NEAR_ONE[node.op][0].format(self._entry(node.args[0]), one=one)
            yield f"const {kind} {name}u = {first};"
        yield f"const {kind} {name} = {self._expression(node)};"

    def _kind(self, node: Node) -> str:
        return "bool" if node.logical else "double" if node.wide else self._type

    def _expression(self, node: Node) -> str:
        if node.op == "input":
            return self._read.format(node.args[0])
        if node.op == "look_up":
            return self._looked_up(*node.args)
        wide = any(isinstance(x, Node) and x.wide for x in node.args) and node.op != "narrow"
        given = [self._entry(x, wide) for x in node.args]
        if node.op in {"widen", "narrow"}:
            return f"({self._kind(node)}){given[0]}"
        if node.op in _NEAR_ONE:
            one = self._entry(1.0, wide)
            return _NEAR_ONE[node.op][1].format(x=given[0], u=f"{self.names[node]}u", one=one)
        return _operation(node.op, given)

    def _looked_up(self, row: Node, table: Table, column: int) -> str:
        """Return a number of a table; an index beyond it, or none, is that of the nearest row."""
        place, last = self._entry(row), self._entry(float(table.shape[0] - 1))
        nothing = self._entry(0.0)
        above = f"({place} > {nothing} ? {place} : {nothing})"
        nearest = f"({above} < {last} ? {above} : {last})"
        return f"table{self._tables[table]}[(int){nearest} * {table.columns} + {column}]"

    def _entry(self, value: Any, wide: bool = False) -> str:
        """Return a node or a number as it stands in the text."""
        kind = "double" if wide else self._type
        return self.names[value] if isinstance(value, Node) else literal(value, kind)


def _operation(op: str, given: Sequence[str]) -> str:
    if op in _SIGNS:
        return f"{given[0]} {_SIGNS[op]} {given[1]}"
    if op in _EXTREME:
        return f"!({given[0]} {_EXTREME[op]} {given[1]}) ? {given[0]} : {given[1]}"
    if op == "where":
        return f"{given[0]} ? {given[1]} : {given[2]}"
    if op in {"negative", "not"}:
        return f"{'-' if op == 'negative' else '!'}{given[0]}"
    return f"::{_NAMES.get(op, op)}({', '.join(given)})"


def literal(value: float, number: str) -> str:
    """Return a number, or true or false, of a type as C writes it.

    Example:
        >>> literal(0.5, "float"), literal(-math.inf, "double"), literal(True, "float")
        ('(0.5f)', '(-1.0 / 0.0)', 'true')
    """
    if isinstance(value, bool):
        return str(value).lower()
    suffix = "f" if number == "float" else ""
    if math.isfinite(value):
        return f"({float(value)!r}{suffix})"
    one = 0.0 if math.isnan(value) else math.copysign(1.0, value)
    return f"({one}{suffix} / 0.0{suffix})"
