"""A module is a topic and a function does one thing: limits counted by syntax, not by layout."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("seals", "plugins", "robots", "animals", "conf", "experiments")
LONGEST_FILE = 800
"""Lines."""
LONGEST_FUNCTION = 80
"""Statements, without docstrings; 95 % of the functions have fewer than FUNCTION_95TH."""
FUNCTION_95TH = 30
BLOCKS = ("body", "orelse", "finalbody", "handlers", "cases")


def file_lengths(root: Path) -> dict[str, int]:
    """Return the number of lines of every Python file."""
    files = (path for folder in FOLDERS for path in (root / folder).rglob("*.py"))
    return {str(path.relative_to(root)): len(path.read_text().splitlines()) for path in files}


def function_lengths(root: Path) -> dict[str, int]:
    """Return the number of statements of every function, without its docstring."""
    found: dict[str, int] = {}

    def count(node: ast.AST, path: str) -> int:
        """Statements in a node; statements hold statements in these fields alone."""
        inner = [part for field in BLOCKS for part in getattr(node, field, ())]
        number = sum(count(part, path) for part in inner)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            found[f"{path}:{node.lineno} {node.name}"] = number - bool(ast.get_docstring(node))
        return number + isinstance(node, ast.stmt)

    for path in file_lengths(root):
        count(ast.parse((root / path).read_text(encoding="utf-8")), path)
    return found


def size_breaches(root: Path) -> list[str]:
    """Find files and functions above the limits, and a share of long functions above its own."""
    files, functions = file_lengths(root), function_lengths(root)
    found = [f"{path}: {n} lines" for path, n in files.items() if n > LONGEST_FILE]
    found += [f"{name}: {n} statements" for name, n in functions.items() if n > LONGEST_FUNCTION]
    ordered = sorted(functions.values())
    if ordered and ordered[int(0.95 * (len(ordered) - 1))] >= FUNCTION_95TH:
        found.append(f"5 % of functions have {FUNCTION_95TH} statements or more")
    return found


def test_sizes() -> None:
    """No file above 800 lines, no function above 80 statements, 95 % below 30."""
    assert size_breaches(ROOT) == []


def test_the_size_rule_bites(tmp_path: Path) -> None:
    """A long file and a long function are found; a docstring does not count."""
    (tmp_path / "seals").mkdir()
    body = "".join(f"    x = {i}\n" for i in range(81))
    (tmp_path / "seals" / "long.py").write_text(f'def f():\n    """Doc."""\n{body}' + "\n" * 730)
    assert size_breaches(tmp_path) == [
        "seals/long.py: 813 lines",
        "seals/long.py:1 f: 81 statements",
        "5 % of functions have 30 statements or more",
    ]
