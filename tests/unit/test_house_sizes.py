"""Files and functions stay small enough to read at once."""

from __future__ import annotations

import ast
import statistics
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("seals", "plugins", "robots", "animals", "conf", "experiments")
LONGEST_FILE = 450
MEDIAN_FILE = 130
LONGEST_FUNCTION = 60
FUNCTION_95TH = 45


def file_lengths(root: Path) -> dict[str, int]:
    """Return the number of lines of every Python file that holds more than its docstring."""
    files = (path for folder in FOLDERS for path in (root / folder).rglob("*.py"))
    lengths = {str(path.relative_to(root)): len(path.read_text().splitlines()) for path in files}
    return {path: count for path, count in lengths.items() if count > 3}


def function_lengths(root: Path) -> dict[str, int]:
    """Return the number of lines of every function, without its docstring."""
    found = {}
    for path in file_lengths(root):
        for node in ast.walk(ast.parse((root / path).read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                text = node.body[0] if ast.get_docstring(node) is not None else None
                words = (text.end_lineno or 0) - text.lineno + 1 if text else 0
                length = (node.end_lineno or node.lineno) - node.lineno + 1 - words
                found[f"{path}:{node.lineno} {node.name}"] = length
    return found


def size_breaches(root: Path) -> list[str]:
    """Find files and functions above the bars, and medians above theirs."""
    files, functions = file_lengths(root), function_lengths(root)
    found = [f"{path}: {n} lines" for path, n in files.items() if n > LONGEST_FILE]
    found += [f"{name}: {n} lines" for name, n in functions.items() if n > LONGEST_FUNCTION]
    if statistics.median(files.values()) > MEDIAN_FILE:
        found.append(f"median file has {statistics.median(files.values())} lines")
    ordered = sorted(functions.values())
    if ordered and ordered[int(0.95 * (len(ordered) - 1))] > FUNCTION_95TH:
        found.append(f"5 % of functions are longer than {FUNCTION_95TH} lines")
    return found


def test_sizes() -> None:
    """No file above 450 lines, median at most 130; functions at most 60, 95 % at most 45."""
    assert size_breaches(ROOT) == []


def test_the_size_rule_bites(tmp_path: Path) -> None:
    """A long file and a long function are found."""
    (tmp_path / "seals").mkdir()
    body = "".join(f"    x = {i}\n" for i in range(70))
    (tmp_path / "seals" / "long.py").write_text("def f():\n" + body + "\n" * 450)
    found = " ".join(size_breaches(tmp_path))
    assert "long.py: 521 lines" in found
    assert "f: 71 lines" in found
    assert "median file" in found
