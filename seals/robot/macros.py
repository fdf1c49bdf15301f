"""Expansion of xacro macros to a URDF."""

from __future__ import annotations

import ast
import contextlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.parsers.expat import ExpatError

from seals.errors import MissingExtra, RobotError

_INSIDE = re.compile(r"_|(gi|cr|ag|f|tb|co|func)_|(vars|type|mro)$")
"""Names through which an expression would get at the interpreter that evaluates it."""


def holds_macros(text: str) -> bool:
    """Return whether the text of a URDF needs xacro.

    Example:
        >>> holds_macros('<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"/>')
        True
    """
    return re.search(r"<xacro:|xmlns:xacro", text) is not None


def expanded(path: Path) -> str:
    """Return the URDF that a xacro file stands for.

    Args:
        path: of the file; files that it includes are found as xacro finds them.

    Raises:
        MissingExtra: the package xacro is not installed.
        RobotError: the macros cannot be expanded.
    """
    try:
        import xacro
    except ImportError as cause:
        raise MissingExtra(
            f"URDF {path} holds xacro macros, which need the package xacro; it is not installed.\n"
            "Install it: pip install xacro. Or expand the file where it is: "
            "xacro model.urdf.xacro > model.urdf"
        ) from cause
    try:
        with _arithmetic_only(xacro):
            return str(xacro.process_file(str(path)).toxml())
    except (xacro.XacroException, ExpatError, OSError) as cause:
        text = " ".join(str(cause).split())[:300]
        raise RobotError(
            f"URDF {path}: xacro cannot expand it: {text}.\n"
            "Arguments without a default and packages of ROS are not known here: "
            "expand it where they are."
        ) from cause


@contextlib.contextmanager
def _arithmetic_only(xacro: Any) -> Iterator[None]:
    """Let xacro evaluate no expression that reaches for the interpreter.

    The package itself looks at the outermost names only, and hands out ``vars`` and ``type``.
    """
    evaluate = xacro.safe_eval

    def checked(expression: str, *symbols: Any) -> Any:
        for node in ast.walk(ast.parse(expression.strip(), mode="eval")):
            name = getattr(node, "attr", getattr(node, "id", ""))
            if isinstance(node, ast.Attribute | ast.Name) and _INSIDE.match(name):
                raise xacro.XacroException(f"'{name}' is not a valid name in an expression")
        return evaluate(expression, *symbols)

    xacro.safe_eval = checked
    try:
        yield
    finally:
        xacro.safe_eval = evaluate
