"""Nothing that is read from a file or a socket is unpickled: the sources are searched."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
INSTALLED = ("seals", "plugins", "robots", "animals", "experiments")
FOLDERS = (*INSTALLED, "benchmarks", "docs", "tests")
MODULES = {"pickle", "_pickle", "cPickle", "cloudpickle", "dill", "shelve", "marshal", "copyreg"}
MODULES |= {"joblib", "pickletools", "jsonpickle"}
"""Modules that make objects of bytes."""
PIPES = {"multiprocessing", "concurrent"}
"""Modules that send objects between processes as pickles; searched for in what is installed."""
LOADERS = {("torch", "load"), ("torch", "save"), ("pd", "read_pickle"), ("pandas", "read_pickle")}
LOADERS |= {("yaml", "unsafe_load"), ("yaml", "full_load"), ("joblib", "load")}
WORDS = (*MODULES, *PIPES, "torch.load", "torch.save", "read_pickle", "np.load", "unsafe_load")
WORDS += ("full_load", "allow_pickle")
"""A source without any of these is not looked at any closer."""
ALLOWED = {
    "seals/sysid/parallel.py": "a pool of children forked from this very process",
    "seals/view/live.py": "a pipe to a child of its own, read as bytes",
    "seals/view/live_child.py": "the other end of that pipe",
    "tests/unit/test_diagnose_drops.py": "what a pool's child sends back, made in the test",
    "tests/unit/test_learn_demonstrations.py": "writes pickles that must not be opened",
    "tests/unit/test_learn_training.py": "writes pickles that must not be opened",
    "tests/unit/test_logs_broken.py": "writes pickles that must not be opened",
    "tests/unit/test_run_checkpoint.py": "writes pickles that must not be opened",
    "tests/unit/test_state_file.py": "writes pickles that must not be opened",
}
"""Files in which such a thing stands, and why it may."""


def uses(tree: ast.AST, modules: set[str] = MODULES | PIPES) -> Iterator[str]:
    """Yield the uses of pickles in a source: imports, loaders, switches."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
            yield from (name for name in names if name.partition(".")[0] in modules)
        elif isinstance(node, ast.ImportFrom):
            if (node.module or "").partition(".")[0] in modules:
                yield str(node.module)
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if (node.value.id, node.attr) in LOADERS:
                yield f"{node.value.id}.{node.attr}"
        elif isinstance(node, ast.Call):
            yield from _calls(node)


def _calls(node: ast.Call) -> Iterator[str]:
    """Yield what a call allows or imports by name."""
    for keyword in node.keywords:
        no = isinstance(keyword.value, ast.Constant) and keyword.value.value is False
        if keyword.arg == "allow_pickle" and not no:
            yield "allow_pickle"
    words = [w.value for w in node.args if isinstance(w, ast.Constant) and isinstance(w.value, str)]
    called = getattr(node.func, "attr", getattr(node.func, "id", ""))
    if called in ("import_module", "__import__"):
        yield from (word for word in words if word.partition(".")[0] in MODULES)
    of_numpy = getattr(getattr(node.func, "value", None), "id", "") == "np"
    said = any(keyword.arg == "allow_pickle" for keyword in node.keywords)
    if called == "load" and of_numpy and not said:
        yield "np.load without allow_pickle=False"


def found(root: Path) -> dict[str, list[str]]:
    """Return the uses by file."""
    out = {}
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*.py")):
            text = path.read_text(encoding="utf-8")
            if not any(word in text for word in WORDS):
                continue
            modules = MODULES | PIPES if folder in INSTALLED else MODULES
            if words := list(uses(ast.parse(text), modules)):
                out[path.relative_to(root).as_posix()] = words
    return out


def test_no_pickle_but_where_it_is_said_why() -> None:
    """Checkpoints, demonstrations and policies are arrays and JSON; pipes lead to own children."""
    here = found(ROOT)
    strange = {name: words for name, words in here.items() if name not in ALLOWED}
    assert not strange, strange


def test_the_list_of_exceptions_is_short_and_true() -> None:
    """An exception without its cause would let the next one in."""
    assert set(ALLOWED) - set(found(ROOT)) == set()
    assert sum(not name.startswith("tests/") for name in ALLOWED) <= 4


def test_the_search_finds_what_it_looks_for() -> None:
    """One line of each kind."""
    lines = {
        "import pickle": "pickle",
        "from multiprocessing.connection import Client": "multiprocessing.connection",
        "import torch; torch.load(path, weights_only=True)": "torch.load",
        "np.load(path, allow_pickle=flag)": "allow_pickle",
        "np.load(path)": "np.load without allow_pickle=False",
        "importlib.import_module('dill')": "dill",
    }
    for line, word in lines.items():
        assert list(uses(ast.parse(line))) == [word], line
    assert not list(uses(ast.parse("np.load(path, allow_pickle=False); json.load(file)")))
