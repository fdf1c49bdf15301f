"""Conversion of a scalar graph to statements of C, in double precision, one call for each row."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from seals.world.scalar_compiler.graph import Node, needed
from seals.world.scalar_compiler.kernel import CannotCompile

_SIGNS = {
    **{"add": "+", "subtract": "-", "multiply": "*", "divide": "/"},
    **{"less": "<", "less_equal": "<=", "equal": "==", "not_equal": "!=", "and": "&&", "or": "||"},
}
# a motion that is not a number stays one, as in the machine code
_EXTREME = {"maximum": "<=", "minimum": ">="}
# not every compiler has them; quotients in which the error of u drops out (Higham 2002, 1.14.1)
_NEAR_ONE = {
    "log1p": ("1.0 + {}", "{u} == 1.0 ? {x} : ::log({u}) * {x} / ({u} - 1.0)"),
    "expm1": (
        "::exp({})",
        "{u} == 1.0 ? {x} : {x} < -40.0 || {x} > 40.0 ? {u} - 1.0 : ({u} - 1.0) * {x} / ::log({u})",
    ),
}
_NAMES = {"absolute": "fabs", "power": "pow"}


def statements_of(outputs: Sequence[Any], read: str, write: str) -> list[str]:
    """Return statements that work out the entries of some results.

    Args:
        outputs: entries; numbers are left out.
        read: format of the place of an input, of its number.
        write: format of the place of a result, of its number.

    Example:
        >>> from seals.world.scalar_compiler.graph import given, multiply
        >>> x = given(0, {})
        >>> statements_of([multiply(x, x), 1.0], "a[{}]", "b[{}]")
        ['const double v0 = a[0];', 'const double v1 = v0 * v0;', 'b[0] = v1;']
    """
    names: dict[Node, str] = {}
    lines = []
    for node in needed([x for x in outputs if isinstance(x, Node)]):
        if node.op == "look_up":
            raise CannotCompile(
                "tables of hulls have no form as C.\nGive hulls shapes, or take fused=false"
            )
        name = names[node] = f"v{len(names)}"
        kind = "bool" if node.logical else "double"
        if node.op in _NEAR_ONE:
            first = _NEAR_ONE[node.op][0].format(names[node.args[0]])
            lines.append(f"const double {name}u = {first};")
        asked = node.op == "input"
        text = read.format(node.args[0]) if asked else _expression(node, names)
        lines.append(f"const {kind} {name} = {text};")
    return lines + [
        f"{write.format(k)} = {names[x]};" for k, x in enumerate(outputs) if isinstance(x, Node)
    ]


def _expression(node: Node, names: dict[Node, str]) -> str:
    op = node.op
    given = [names[x] if isinstance(x, Node) else _number(x) for x in node.args]
    if op in _NEAR_ONE:
        return _NEAR_ONE[op][1].format(x=given[0], u=f"{names[node]}u")
    if op in _SIGNS:
        return f"{given[0]} {_SIGNS[op]} {given[1]}"
    if op in _EXTREME:
        return f"!({given[0]} {_EXTREME[op]} {given[1]}) ? {given[0]} : {given[1]}"
    if op == "where":
        return f"{given[0]} ? {given[1]} : {given[2]}"
    if op in {"negative", "not"}:
        return f"{'-' if op == 'negative' else '!'}{given[0]}"
    return f"::{_NAMES.get(op, op)}({', '.join(given)})"


def _number(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if math.isfinite(value):
        return f"({float(value)!r})"
    return "(0.0 / 0.0)" if math.isnan(value) else f"({math.copysign(1.0, value)} / 0.0)"
