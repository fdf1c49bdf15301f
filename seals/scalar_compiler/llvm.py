"""Conversion of a scalar graph to LLVM IR in double precision."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.scalar_compiler.graph import Node, Table, needed

PIECE = 1500
"""Operations of one function: the time to compile one grows faster than its length."""
_PLAIN = {
    **{"add": "fadd double", "subtract": "fsub double", "multiply": "fmul double"},
    **{"divide": "fdiv double", "negative": "fneg double"},
    **{"less": "fcmp olt double", "less_equal": "fcmp ole double"},
    **{"equal": "fcmp oeq double", "not_equal": "fcmp une double"},
    **{"and": "and i1", "or": "or i1", "not": "xor i1 1,"},
}
# a motion that is not a number stays one
_EXTREME = {"maximum": "ugt", "minimum": "ult"}
_INTRINSIC = {"sqrt": "llvm.sqrt.f64", "absolute": "llvm.fabs.f64", "floor": "llvm.floor.f64"}
_LIBRARY = {"power": "pow", **{n: n for n in ("exp", "log", "sin", "cos", "tan", "tanh", "atan2")}}
_LIBRARY |= {n: n for n in ("asin", "acos", "atan", "log1p", "expm1")}
_TWO = frozenset({"pow", "atan2"})


class Text(NamedTuple):
    """Text of a law.

    Args:
        lines: of ``law(inputs, outputs, work)``.
        work: numbers of ``work`` that it writes.
        tables: whose addresses it expects in ``work`` after them.
    """

    lines: str
    work: int
    tables: list[Table]

    def memory(self) -> Floats:
        """Return new memory for ``work``."""
        found = np.zeros(max(1, self.work + len(self.tables)))
        addresses = [table.values.ctypes.data for table in self.tables]
        found.view(np.uint64)[self.work : self.work + len(addresses)] = addresses
        return found


def text_of(outputs: Sequence[Any]) -> Text:
    """Return the text of a law.

    Args:
        outputs: entries of the results; numbers are left out.
    """
    nodes = needed([x for x in outputs if isinstance(x, Node)])
    pieces = [nodes[k : k + PIECE] for k in range(0, len(nodes), PIECE)]
    piece_of = {node: k for k, piece in enumerate(pieces) for node in piece}
    shared: dict[Node, int] = {}
    for node in nodes:
        for x in node.args:
            if isinstance(x, Node) and x.op != "input" and piece_of[x] != piece_of[node]:
                shared.setdefault(x, len(shared))
    asked = (node.args[1] for node in nodes if node.op == "look_up")
    tables = {table: len(shared) + k for k, table in enumerate(dict.fromkeys(asked))}
    wanted: dict[int, list[int]] = {}
    for place, x in enumerate(outputs):
        if isinstance(x, Node):
            wanted.setdefault(piece_of[x], []).append(place)
    lines = []
    for k, piece in enumerate(pieces):
        lines += _Function(k, piece, shared, tables).written(
            [(p, outputs[p]) for p in wanted.get(k, [])]
        )
    calls = [f"  call void @piece{k}(ptr %given, ptr %out, ptr %work)" for k in range(len(pieces))]
    head = [f"declare double @{name}(double)" for name in _INTRINSIC.values()]
    head += [
        f"declare double @{n}(double{', double' if n in _TWO else ''})" for n in _LIBRARY.values()
    ]
    last = ["define void @law(ptr %given, ptr %out, ptr %work) {", *calls, "  ret void", "}"]
    return Text("\n".join([*head, *lines, *last, ""]), len(shared), list(tables))


class _Function:
    """Text of one piece."""

    def __init__(
        self, number: int, piece: list[Node], shared: dict[Node, int], tables: dict[Table, int]
    ) -> None:
        self._head = f"define internal void @piece{number}(ptr noalias %given, ptr noalias %out, "
        self._head += "ptr noalias %work) noinline {"
        self._piece, self._shared, self._tables = piece, shared, tables
        self._names: dict[Any, str] = {}
        self.lines: list[str] = []

    def written(self, outputs: list[tuple[int, Node]]) -> list[str]:
        """Return the lines of the function.

        Args:
            outputs: places of results, and their nodes.
        """
        for node in self._piece:
            name = self._names[node] = self._operation(node)
            if node in self._shared:
                self._store(self._number(node, name), "work", self._shared[node])
        for place, node in outputs:
            self._store(self._number(node, self._names[node]), "out", place)
        return [self._head, *self.lines, "  ret void", "}"]

    def _add(self, text: str) -> str:
        name = f"%v{len(self.lines)}"
        self.lines.append(f"  {name} = {text}")
        return name

    def _load(self, memory: str, place: int) -> str:
        return self._add(f"load double, ptr {self._address(memory, place)}")

    def _address(self, memory: str, place: int) -> str:
        return self._add(f"getelementptr double, ptr %{memory}, i64 {place}")

    def _store(self, name: str, memory: str, place: int) -> None:
        self.lines.append(f"  store double {name}, ptr {self._address(memory, place)}")

    def _number(self, node: Node, name: str) -> str:
        """Return a condition as 0 or 1; a number as it is."""
        return self._add(f"uitofp i1 {name} to double") if node.logical else name

    def _given(self, x: Any) -> str:
        """Return an argument as it stands in the text."""
        if not isinstance(x, Node):
            return str(int(x)) if isinstance(x, bool) else f"0x{_bits(x):016X}"
        if x not in self._names:
            if x.op == "input":
                self._names[x] = self._load("given", x.args[0])
            else:
                name = self._load("work", self._shared[x])
                self._names[x] = self._add(f"fcmp une double {name}, 0.0") if x.logical else name
        return self._names[x]

    def _operation(self, node: Node) -> str:
        op = node.op
        if op == "input":
            return self._load("given", node.args[0])
        if op == "look_up":
            return self._looked_up(*node.args)
        given = [self._given(x) for x in node.args]
        if op in _PLAIN:
            return self._add(f"{_PLAIN[op]} {', '.join(given)}")
        if op in _EXTREME:
            which = self._add(f"fcmp {_EXTREME[op]} double {given[0]}, {given[1]}")
            return self._add(f"select i1 {which}, double {given[0]}, double {given[1]}")
        if op == "where":
            kind = "i1" if node.logical else "double"
            return self._add(f"select i1 {given[0]}, {kind} {given[1]}, {kind} {given[2]}")
        law = _INTRINSIC.get(op) or _LIBRARY[op]
        return self._add(f"call double @{law}({', '.join(f'double {x}' for x in given)})")

    def _looked_up(self, row: Node, table: Table, column: int) -> str:
        """Return a number of a table; an index beyond it, or none, is that of the nearest row."""
        place, last = self._given(row), f"0x{_bits(table.shape[0] - 1):016X}"
        above = self._add(f"fcmp ogt double {place}, 0.0")
        place = self._add(f"select i1 {above}, double {place}, double 0.0")
        below = self._add(f"fcmp olt double {place}, {last}")
        place = self._add(f"select i1 {below}, double {place}, double {last}")
        whole = self._add(f"fptosi double {place} to i64")
        first = self._add(f"mul i64 {whole}, {table.columns}")
        at = self._add(f"add i64 {first}, {column}")
        begin = self._add(f"load ptr, ptr {self._address('work', self._tables[table])}")
        return self._add(
            f"load double, ptr {self._add(f'getelementptr double, ptr {begin}, i64 {at}')}"
        )


def _bits(number: float) -> int:
    found: int = struct.unpack("<Q", struct.pack("<d", number))[0]
    return found
